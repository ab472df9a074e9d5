//! Traversal of shared-plane nodes: decompress and test.

use super::search::{Pending, Traversable};
use super::slab::Slabs;
use crate::compress::SharedContext;
use crate::geom::Ray;
use crate::node::{Child, SharedNode, SharedWords, Sharing, Subtree};

/// Shared-plane nodes of a tree with so many leaf table entries.
///
/// Both boxes of a node have twelve planes, of which six are the node's own: hardware keeps their
/// distances and multiplies for the other six only.
#[derive(Debug)]
pub(super) struct Shared {
    pub sharing: Sharing,
    pub entry_count: u32,
}

const WORD: usize = SharedNode::WORD_BYTES as usize;

impl Traversable<2> for Shared {
    type Context = SharedContext;
    /// The node, then its extensions from the last to the first.
    type Bytes = [u8; WORD * SharedNode::MAX_WORDS];
    const EMPTY: Self::Bytes = [0; WORD * SharedNode::MAX_WORDS];

    fn root(&self, _: &Ray, root: &Subtree, _: i64) -> Option<SharedContext> {
        SharedContext::root(root, self.entry_count, &self.sharing)
    }

    #[inline]
    fn more(&self, bytes: &Self::Bytes, have: usize) -> bool {
        SharedNode::is_extended(&words(&bytes[..have.min(bytes.len())]))
    }

    #[inline]
    fn children(
        &self,
        ray: &Ray,
        bytes: &Self::Bytes,
        context: &SharedContext,
        t_max: i64,
    ) -> Option<[Option<Pending<SharedContext>>; 2]> {
        let Child::Inner(index) = context.child else { return None };
        let all = words(bytes);
        let used = (1..=all.len()).find(|&used| !SharedNode::is_extended(&all[..used]))?;
        let node = SharedNode::from_words(&all[..used], self.sharing.grids)?;
        let children = context.decode(index, &node, used, &self.sharing)?;
        Some(children.map(|context| {
            let slabs = Slabs::new(ray, &context.bounds);
            let entry = slabs.entry(ray, ray.t_min().to_bits(), t_max)?;
            Some(Pending { child: context.child, entry, context })
        }))
    }
}

fn words(bytes: &[u8]) -> SharedWords {
    let (words, _) = bytes.as_chunks::<WORD>();
    words.iter().map(|word| u64::from_le_bytes(*word)).collect()
}
