//! The insertion sorter that orders one block while it is being read.

use super::Item;
use crate::probe::Probe;

/// Sorts a block by code; equal codes keep their order.
///
/// This is the pre-sorter of P2 §5.5, which does one compare-and-swap a cycle; the probe is told of
/// each.
pub fn insertion_sort<P: Probe>(block: &mut [Item], probe: &mut P) {
    for end in 1..block.len() {
        let item = block[end];
        let mut hole = end;
        while hole > 0 {
            probe.compare_swap();
            if block[hole - 1].code <= item.code {
                break;
            }
            block[hole] = block[hole - 1];
            hole -= 1;
        }
        block[hole] = item;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_sorted_and_equal_codes_keep_their_order() {
        let codes = [3u64, 1, 2, 3, 1, 0];
        let mut reference = 0;
        let mut block = codes.map(|code| {
            reference += 1;
            Item { code, reference: reference - 1, ..Item::ZERO }
        });
        insertion_sort(&mut block, &mut ());
        let order = block.map(|item| (item.code, item.reference));
        assert_eq!(order, [(0, 5), (1, 1), (1, 4), (2, 2), (3, 0), (3, 3)]);
    }
}
