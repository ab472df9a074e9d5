//! The insertion sorter that orders one block while it is being read.

use super::{Item, MAX_BURST};
use crate::probe::Probe;

/// The longest block: two bursts.
pub const MAX_BLOCK: usize = 2 * MAX_BURST;

/// Puts a block of at most two of the longest bursts into `sorted` in the order of its codes; equal
/// codes keep their order. Both are equally long.
///
/// This is the pre-sorter of P2 §5.5, which does one compare-and-swap a cycle; the probe is told of
/// each. Here the codes before each record's are counted, as no branch of that depends on a code, and
/// records move once.
pub fn insertion_sort<P: Probe>(block: &[Item], sorted: &mut [Item], probe: &mut P) {
    let block = &block[..block.len().min(MAX_BLOCK)];
    let narrow = block.iter().fold(0, |all, item| all | item.code) <= i32::MAX as u64;
    let (code32, code64) = (|item: &Item| item.code as i32, |item: &Item| item.code as i64);
    match (narrow, block.len() <= MAX_BLOCK / 2) {
        (true, true) => place::<_, 32, _>(block, sorted, i32::MAX, code32, probe),
        (true, false) => place::<_, 64, _>(block, sorted, i32::MAX, code32, probe),
        (false, _) => place::<_, 64, _>(block, sorted, i64::MAX, code64, probe),
    }
}

/// The same for at most `N` records and one type of keys, which have the order of the codes and none
/// above `last`.
#[inline]
fn place<K: Copy + Ord, const N: usize, P: Probe>(
    block: &[Item],
    sorted: &mut [Item],
    last: K,
    key: impl Fn(&Item) -> K,
    probe: &mut P,
) {
    let mut keys = [last; N];
    for (to, item) in keys.iter_mut().zip(block) {
        *to = key(item);
    }
    // Records of one code have the same number of lower ones; the next of them goes behind.
    let mut equal = [0u8; N];
    for (i, (item, key)) in block.iter().zip(&keys).enumerate() {
        let lower = keys.iter().map(|other| u32::from(other < key)).sum::<u32>() as usize;
        if let Some(equal) = equal.get_mut(lower)
            && let Some(to) = sorted.get_mut(lower + usize::from(*equal))
        {
            *to = *item;
            *equal += 1;
        }
        // It is compared with those before it that it passes, and with the one that stops it.
        let passed = keys[..i].iter().map(|other| u32::from(other > key)).sum::<u32>() as usize;
        for _ in 0..i.min(passed + 1) {
            probe.compare_swap();
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
