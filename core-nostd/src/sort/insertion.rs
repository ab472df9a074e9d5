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
    if narrow {
        place(block, sorted, |item| item.code as i32, probe);
    } else {
        place(block, sorted, |item| item.code as i64, probe);
    }
}

/// The same for one type of keys, which have the order of the codes.
#[inline]
fn place<K: Copy + Default + Ord, P: Probe>(
    block: &[Item],
    sorted: &mut [Item],
    key: impl Fn(&Item) -> K,
    probe: &mut P,
) {
    let mut keys = [K::default(); MAX_BLOCK];
    for (to, item) in keys.iter_mut().zip(block) {
        *to = key(item);
    }
    let keys = &keys[..block.len()];
    for (i, (item, key)) in block.iter().zip(keys).enumerate() {
        let stay: u32 = keys[..i].iter().map(|other| u32::from(other <= key)).sum();
        let pass: u32 = keys[i + 1..].iter().map(|other| u32::from(other < key)).sum();
        if let Some(to) = sorted.get_mut((stay + pass) as usize) {
            *to = *item;
        }
        // It is compared with those before it that it passes, and with the one that stops it.
        for _ in 0..i.min(i - stay as usize + 1) {
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
