//! The insertion sorter that orders one block while it is being read.

use super::{Item, MAX_BURST};
use crate::probe::Probe;

/// The longest block: two bursts.
pub const MAX_BLOCK: usize = 2 * MAX_BURST;

/// Puts a block of at most two of the longest bursts into `sorted` in the order of its codes; equal
/// codes keep their order. Both are equally long.
///
/// This is the pre-sorter of P2 §5.5, which does one compare-and-swap a cycle; the probe is told of
/// each. Here every record's place is counted, as no branch of that depends on codes, and records
/// move once.
pub fn insertion_sort<P: Probe>(block: &[Item], sorted: &mut [Item], probe: &mut P) {
    let mut codes = [0; MAX_BLOCK];
    let mut places = [0u64; MAX_BLOCK];
    for (end, item) in block.iter().enumerate().take(MAX_BLOCK) {
        let mut place = 0;
        for (earlier, code) in places.iter_mut().zip(&codes[..end]) {
            let stays = u64::from(*code <= item.code);
            place += stays;
            *earlier += 1 - stays;
        }
        codes[end] = item.code;
        places[end] = place;
        // A code is compared with those that it passes and with the one that stops it.
        for _ in 0..end.min(end - place as usize + 1) {
            probe.compare_swap();
        }
    }
    for (item, place) in block.iter().zip(places) {
        if let Some(to) = sorted.get_mut(place as usize) {
            *to = *item;
        }
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
