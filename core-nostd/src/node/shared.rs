//! The shared-plane node: two boxes in 8 bytes, half of their planes taken from the parent.

use heapless::Vec;

use crate::error::ConfigError;

/// How planes are shared: what a reader must know beside the nodes.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Sharing {
    /// Where a reader finds a node's grid.
    pub grids: Grids,
    /// A box is given a grid on which it still spans 2^6 cells at most when its planes are rounded
    /// outward to a grid that is coarser by this power of two, 0 to 5. What a box may so inherit
    /// from an ancestor without being too large for its grid grows with it.
    pub margin: u8,
    /// How much finer a grid may be on one axis than on its coarsest, as a power of two. It keeps
    /// boxes with no thickness from grids that no ancestor's plane fits.
    pub flatness: u8,
}

/// Where a reader finds the grid of a node.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Grids {
    /// It follows from the decoded box, as Vaidyanathan et al. 2016 have it.
    Derived,
    /// It follows from the exact box, which no reader has, so the parent says how much finer it is.
    Stored,
}

impl Sharing {
    /// For streaming.
    pub const STREAMED: Self = Self { grids: Grids::Stored, margin: 3, flatness: 4 };

    /// For compression from the root down.
    pub const TOP_DOWN: Self = Self { grids: Grids::Derived, margin: 0, flatness: 4 };

    /// Checks the parameters.
    ///
    /// # Errors
    /// [`ConfigError::Sharing`].
    pub fn check(&self) -> Result<(), ConfigError> {
        if self.margin <= 5 && self.flatness < 32 { Ok(()) } else { Err(ConfigError::Sharing) }
    }
}

/// A plane that a child does not inherit.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Plane {
    /// A cell of the node's grid, modulo 2^6; for an upper plane the one above the box.
    Cell(u8),
    /// Grid units, where a descendant that inherits the plane would not bear it rounded. The upper
    /// plane is above the box.
    Exact(i32),
}

/// What a node says about where its children are.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Link {
    /// Words of the right subtree, if both children are nodes.
    pub words: u32,
    /// Leaf table entries of the right child if the left one is a node, otherwise of the left one.
    pub entries: u32,
}

/// The shared-plane node of Vaidyanathan et al. 2016, with pointers for a stream.
///
/// It is one little-endian word of 8 bytes:
///
/// | bits   | field                                                                    |
/// |--------|--------------------------------------------------------------------------|
/// | 0..36  | six planes that are not inherited: lower x, upper x, lower y, ...        |
/// | 36..42 | for each plane of the node, which child inherits it                      |
/// | 42..44 | whether child 0 and child 1 are leaves                                   |
/// | 44     | the word before this one is an extension                                 |
/// | 45..64 | for each child that is a node, how much finer its grid is on x, y and z, each that many ones and a zero (with [`Grids::Stored`]); then the link |
///
/// Nodes are in the order of completion: if child 1 is a node, it is just before this one and its
/// extensions; if both are, child 0 is in front of all words of child 1. Leaf table entries are in the
/// same order, so that a reader that carries the range of a subtree needs one size to divide it:
/// the [`Link`]. Where a child is a leaf, it is the leaf's size in 8 bits. Where both are nodes, it
/// begins with 2 bits that tell how the rest is divided: into the right subtree's words less one, and
/// how many entries it has beyond one more than words. That is nothing for 0; 1 to 4, 2 bits, for 1; -1 to
/// -4 for 2; and for 3 it is 5 or more and has the upper half of the bits.
///
/// An extension says what does not fit. Bit 0 tells that another one is in front of it, bits 1..3 what
/// it holds, which then is not in the node: 0, how much finer grids are (six times 5 bits); 1, the link
/// (words 30, entries 30); 2, two exact planes (number 3 bits, plane plus 2^23 25 bits; number 7 is
/// none).
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct SharedNode {
    /// Of the two planes on each side of each axis, the one that is not inherited: lower x, upper x,
    /// lower y and so on.
    pub planes: [Plane; 6],
    /// Which child inherits each plane of the node.
    pub heirs: [u8; 6],
    /// Which children are leaves.
    pub leaves: [bool; 2],
    /// How much finer each child's grid is, as a power of two; 0 for leaves.
    pub finer: [[u8; 3]; 2],
    /// Where children are.
    pub link: Link,
}

/// A node's words: itself, then its extensions from the last to the first.
pub type SharedWords = Vec<u64, { SharedNode::MAX_WORDS }>;

const EXTENDED: u32 = 44;
const TAIL: u32 = 45;
const TAIL_BITS: u32 = 19;
const OFFSET: i32 = 1 << 23;
const FINER: u64 = 0;
const LINK: u64 = 1;
const PLANES: u64 = 2;

impl SharedNode {
    /// Bytes of a word.
    pub const WORD_BYTES: u32 = 8;

    /// The most words of a node.
    pub const MAX_WORDS: usize = 6;

    /// The highest number of words or entries.
    pub const MAX_LINK: u32 = (1 << 30) - 1;

    /// Whether another extension is in front of the words at hand.
    #[inline]
    pub fn is_extended(words: &[u64]) -> bool {
        match words {
            [] => false,
            [node] => node >> EXTENDED & 1 == 1,
            [.., last] => last & 1 == 1,
        }
    }

    /// The node as words. Numbers are cut to their fields; those of a link are at most
    /// [`SharedNode::MAX_LINK`].
    pub fn to_words(&self, grids: Grids) -> SharedWords {
        let mut extensions = Vec::<u64, 5>::new();
        let mut word = 0;
        let mut exact = Vec::<u64, 6>::new();
        for (k, (plane, heir)) in (0..).zip(self.planes.iter().zip(&self.heirs)) {
            match plane {
                Plane::Cell(cell) => word |= u64::from(cell & 63) << (6 * k),
                Plane::Exact(at) => _ = exact.push(k | u64::from((at + OFFSET) as u32) << 3),
            }
            word |= u64::from(heir & 1) << (36 + k);
        }
        for (i, leaf) in self.leaves.iter().enumerate() {
            word |= u64::from(*leaf) << (42 + i);
        }
        let (finer, used) = self.unary(grids);
        let fits = used <= TAIL_BITS;
        let link = if fits { self.short_link(TAIL_BITS - used) } else { None };
        let tail = match (link, self.short_link(TAIL_BITS)) {
            (Some(link), _) => finer | link << used,
            (None, Some(link)) => {
                _ = extensions.push(FINER << 1 | self.finer_fields() << 3);
                link
            }
            (None, None) => {
                let Link { words, entries } = self.link;
                let both = u64::from(words) | u64::from(entries) << 30;
                _ = extensions.push(LINK << 1 | both << 3);
                if !fits {
                    _ = extensions.push(FINER << 1 | self.finer_fields() << 3);
                }
                if fits { finer } else { 0 }
            }
        };
        for two in exact.chunks(2) {
            let second = two.get(1).copied().unwrap_or(7);
            _ = extensions.push(PLANES << 1 | two[0] << 3 | second << 31);
        }
        word |= tail << TAIL;
        word |= u64::from(!extensions.is_empty()) << EXTENDED;
        let mut words = SharedWords::new();
        _ = words.push(word);
        let last = extensions.len();
        for (i, extension) in (1..).zip(extensions) {
            _ = words.push(extension | u64::from(i < last));
        }
        words
    }

    /// The node of words, or `None` if no node has these.
    pub fn from_words(words: &[u64], grids: Grids) -> Option<Self> {
        let (&word, extensions) = words.split_first()?;
        let field = |from: u32, bits: u32| word >> from & ((1 << bits) - 1);
        let leaves = [field(42, 1) == 1, field(43, 1) == 1];
        let mut node = Self {
            planes: core::array::from_fn(|k| Plane::Cell(field(6 * k as u32, 6) as u8)),
            heirs: core::array::from_fn(|k| field(36 + k as u32, 1) as u8),
            leaves,
            finer: [[0; 3]; 2],
            link: Link { words: 0, entries: 0 },
        };
        let (mut finer, mut link) = (None, None);
        for &extension in extensions {
            let field = |from: u32, bits: u32| extension >> from & ((1 << bits) - 1);
            match field(1, 2) {
                FINER => {
                    finer = Some(
                        [0, 1]
                            .map(|i| [0, 1, 2].map(|axis| field(3 + 5 * (3 * i + axis), 5) as u8)),
                    )
                }
                LINK => {
                    link = Some(Link { words: field(3, 30) as u32, entries: field(33, 30) as u32 });
                }
                PLANES => {
                    for from in [3, 31] {
                        let at = field(from + 3, 25) as i32 - OFFSET;
                        if let Some(plane) = node.planes.get_mut(field(from, 3) as usize) {
                            *plane = Plane::Exact(at);
                        }
                    }
                }
                _ => return None,
            }
        }
        let mut from = TAIL;
        match finer {
            Some(finer) => node.finer = finer,
            None if grids == Grids::Stored => {
                for (finer, _) in node.finer.iter_mut().zip(leaves).filter(|(_, leaf)| !leaf) {
                    for finer in finer {
                        // All bits above the word are zeros, so this ends.
                        let ones = word.checked_shr(from).unwrap_or(0).trailing_ones();
                        *finer = ones as u8;
                        from += ones + 1;
                    }
                }
            }
            None => {}
        }
        node.link = match link {
            Some(link) => link,
            None => {
                let bits = u64::BITS.checked_sub(from)?;
                node.long_link(word.checked_shr(from).unwrap_or(0), bits)?
            }
        };
        Some(node)
    }

    /// How much finer grids are, as bits, and how many they are; too many for the node if above
    /// [`TAIL_BITS`].
    fn unary(&self, grids: Grids) -> (u64, u32) {
        let (mut bits, mut used) = (0u64, 0);
        if grids == Grids::Stored {
            for (finer, _) in self.finer.iter().zip(self.leaves).filter(|(_, leaf)| !leaf) {
                for &finer in finer {
                    let ones = (1u64 << (finer & 31)) - 1;
                    bits |= ones.checked_shl(used).unwrap_or(0);
                    used += u32::from(finer & 31) + 1;
                }
            }
        }
        (bits, used)
    }

    /// The same as fields of an extension.
    fn finer_fields(&self) -> u64 {
        let all = (0..).zip(self.finer.as_flattened());
        all.fold(0, |bits, (i, &finer)| bits | u64::from(finer & 31) << (5 * i))
    }

    /// The link in so many bits, if it fits.
    fn short_link(&self, bits: u32) -> Option<u64> {
        let Link { words, entries } = self.link;
        if self.leaves != [false; 2] {
            return (bits >= 8 && entries < 256).then_some(entries.into());
        }
        let words = u64::from(words).checked_sub(1)?;
        let beyond = i64::from(entries) - words as i64 - 2;
        (0..4).find_map(|tag| {
            let (low, high) = divide(bits, tag)?;
            let beyond = match tag {
                0 => beyond,
                1 => beyond - 1,
                2 => -1 - beyond,
                _ => beyond - 5,
            };
            let fits = words < 1 << low && (0..1 << high).contains(&beyond);
            fits.then_some(tag | words << 2 | (beyond as u64) << (2 + low))
        })
    }

    /// The opposite, from the lowest bits of a word.
    fn long_link(&self, short: u64, bits: u32) -> Option<Link> {
        if self.leaves != [false; 2] {
            return (bits >= 8).then_some(Link { words: 0, entries: short as u32 & 255 });
        }
        let (low, high) = divide(bits, short & 3)?;
        let words = short >> 2 & ((1 << low) - 1);
        let beyond = (short >> (2 + low) & ((1 << high) - 1)) as i64;
        let beyond = match short & 3 {
            0 => 0,
            1 => beyond + 1,
            2 => -1 - beyond,
            _ => beyond + 5,
        };
        let entries = u32::try_from(words as i64 + 2 + beyond).ok()?;
        Some(Link { words: words as u32 + 1, entries })
    }
}

/// How the bits of a link are divided between words and entries after the first two.
const fn divide(bits: u32, tag: u64) -> Option<(u32, u32)> {
    let Some(rest) = bits.checked_sub(2) else { return None };
    let high = match tag {
        0 => 0,
        1 | 2 => 2,
        _ => rest.div_ceil(2),
    };
    match rest.checked_sub(high) {
        Some(low) => Some((low, high)),
        None => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::testing::{Random, cases};

    #[test]
    fn nodes_round_trip_whatever_does_not_fit() {
        let mut random = Random(5);
        let mut lengths = [0; SharedNode::MAX_WORDS + 1];
        for _ in 0..cases(20_000) {
            let leaves = [random.below(2) == 0, random.below(2) == 0];
            let inner = leaves == [false; 2];
            let grids = if random.below(4) == 0 { Grids::Derived } else { Grids::Stored };
            let deepest = 1 + random.below(12);
            let mut finer = || (random.below(deepest)) as u8;
            let mut node = SharedNode {
                planes: [Plane::Cell(0); 6],
                heirs: [0; 6],
                leaves,
                finer: leaves.map(|leaf| {
                    let stored = grids == Grids::Stored && !leaf;
                    [(); 3].map(|()| if stored { finer() } else { 0 })
                }),
                link: Link { words: 0, entries: 1 + random.below(300) as u32 },
            };
            if inner {
                let scale = random.below(29);
                node.link.words = 1 + random.below(1 << scale) as u32;
                let extra = (random.below(20) as u32).saturating_sub(8);
                node.link.entries = (node.link.words + 1 + extra) - random.below(2) as u32;
            }
            for k in 0..6 {
                node.heirs[k] = random.below(2) as u8;
                node.planes[k] = match random.below(2) {
                    0 => Plane::Exact(random.below((1 << 24) + 1) - OFFSET),
                    _ => Plane::Cell(random.below(64) as u8),
                };
            }
            let words = node.to_words(grids);
            for have in 1..=words.len() {
                assert_eq!(SharedNode::is_extended(&words[..have]), have < words.len());
            }
            assert_eq!(SharedNode::from_words(&words, grids), Some(node));
            lengths[words.len()] += 1;
        }
        assert!(lengths[1..].iter().all(|&n| n > 0), "{lengths:?}");
    }

    #[test]
    fn every_word_is_a_node_or_none_and_never_a_panic() {
        let mut random = Random(9);
        let mut refused = 0;
        for _ in 0..cases(20_000) {
            let mut word = || (0..4).fold(0, |bits, _| bits << 16 | random.below(1 << 16) as u64);
            let words = [word(), word(), word()];
            for grids in [Grids::Stored, Grids::Derived] {
                for len in 0..=3 {
                    refused += u32::from(SharedNode::from_words(&words[..len], grids).is_none());
                }
            }
        }
        assert!(refused > 0);
    }

    #[test]
    fn fields_are_in_their_places() {
        let node = SharedNode {
            planes: [1, 2, 3, 4, 5, 63].map(Plane::Cell),
            heirs: [1, 0, 0, 0, 0, 1],
            leaves: [true, false],
            finer: [[0; 3], [1, 0, 3]],
            link: Link { words: 0, entries: 7 },
        };
        let words = node.to_words(Grids::Stored);
        let planes = 1 | 2 << 6 | 3 << 12 | 4 << 18 | 5 << 24 | 63 << 30;
        let tail = (0b011_1001 | 7 << 7) << 45;
        assert_eq!(words.as_slice(), [planes | 0b10_0001 << 36 | 1 << 42 | tail]);
    }
}
