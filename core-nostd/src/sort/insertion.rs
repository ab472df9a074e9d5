//! The insertion sorter that orders one block while it is being read.

use super::{Item, MAX_BURST};
use crate::probe::Probe;

/// The longest block: two bursts.
pub const MAX_BLOCK: usize = 2 * MAX_BURST;

/// Puts a block of at most two of the longest bursts into `sorted` in the order of its codes; equal
/// codes keep their order. Both are equally long.
///
/// This is the pre-sorter of P2 §5.5, which does one compare-and-swap a cycle; the probe is told of
/// each. Codes move through the sort with their places, and the records move once at the end.
pub fn insertion_sort<P: Probe>(block: &[Item], sorted: &mut [Item], probe: &mut P) {
    let mut order = [(0u64, 0u8); MAX_BLOCK];
    let len = block.len().min(MAX_BLOCK);
    for (end, &Item { code, .. }) in block[..len].iter().enumerate() {
        let mut hole = end;
        while hole > 0 {
            probe.compare_swap();
            if order[hole - 1].0 <= code {
                break;
            }
            order[hole] = order[hole - 1];
            hole -= 1;
        }
        order[hole] = (code, end as u8);
    }
    for (to, (_, from)) in sorted.iter_mut().zip(&order[..len]) {
        *to = block[usize::from(*from)];
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_block_is_sorted_and_equal_codes_keep_their_order() {
        let codes = [3u64, 1, 2, 3, 1, 0];
        let mut reference = 0;
        let block = codes.map(|code| {
            reference += 1;
            Item { code, reference: reference - 1, ..Item::ZERO }
        });
        let mut sorted = [Item::ZERO; 6];
        insertion_sort(&block, &mut sorted, &mut ());
        let order = sorted.map(|item| (item.code, item.reference));
        assert_eq!(order, [(0, 5), (1, 1), (1, 4), (2, 2), (3, 0), (3, 3)]);
    }
}
