//! Shared-plane nodes from the root down: what the streamed ones are measured against.

use xylem_core::compress::{OpenNode, SharedContext, share};
use xylem_core::mem::Region;
use xylem_core::node::{
    Bvh2Node, Bvh2View, Child, NodeFormat, NodeIndex, SharedNode, Sharing, Subtree, Tree,
};

use crate::bus::FlatMemory;

/// A tree compressed from the root down, and what a stream would have had to repair.
#[derive(Debug, Clone, Copy)]
pub struct SharedTopDown {
    /// The tree.
    pub tree: Tree,
    /// For treelets of 1 to 4 nodes' depth, how many nodes have another grid than the one that follows
    /// from the exact box of the node at the top of the highest treelet that is on chip when
    /// they are written. Each of these must be encoded again at least once.
    pub mismatched: [u32; 4],
}

/// Compresses a tree of 64-byte nodes into `target` with grids that follow from decoded boxes
/// (Vaidyanathan et al. 2016). `None` for a tree that no emitter writes depth first, or no room.
///
/// A **prototype**: it finds sizes of subtrees in a pass of its own and holds the whole tree on the
/// host. The nodes are the core's.
pub fn shared_top_down(
    memory: &mut FlatMemory,
    tree: &Tree,
    target: Region,
    sharing: &Sharing,
) -> Option<SharedTopDown> {
    let mut compressed = Tree { format: NodeFormat::Shared(*sharing), nodes: target, ..*tree };
    let done = |tree| Some(SharedTopDown { tree, mismatched: [0; 4] });
    let Some(root) = tree.root else { return done(compressed) };
    let Child::Inner(NodeIndex(last)) = root.child else { return done(compressed) };
    let nodes = read(memory, tree)?;

    // Children come before parents, so sizes are known; planes do not change them.
    let mut skeleton = Skeleton { nodes: &nodes, open: Vec::new(), at: Vec::new(), sharing };
    let mut words = 0;
    for node in &nodes {
        let below = skeleton.below(node)?;
        let len = share(node, &below, [0; 3])?.to_words(sharing.grids).len() as u32;
        let [left, right] = below;
        words += len;
        skeleton.at.push(words - 1);
        let below = left.words + right.words + len;
        skeleton
            .open
            .push(OpenNode { words: below, ..OpenNode::leaf(left.entries + right.entries) });
    }

    compressed.node_count = words;
    compressed.root.as_mut()?.child = Child::Inner(NodeIndex(*skeleton.at.get(last as usize)?));
    let root = compressed.root.as_ref()?;
    let mut contexts = vec![None; nodes.len()];
    *contexts.get_mut(last as usize)? = Some(SharedContext::root(root, tree.entry_count, sharing)?);
    for i in (0..nodes.len()).rev() {
        let (shared, children) = skeleton.encode(i, &contexts[i]?)?;
        for (word, k) in shared.to_words(sharing.grids).iter().zip(0..) {
            let place = skeleton.at[i].checked_sub(k)?;
            let place = target.record(place, SharedNode::WORD_BYTES)?.0 as usize;
            memory.bytes_mut().get_mut(place..place + 8)?.copy_from_slice(&word.to_le_bytes());
        }
        for (index, context) in children {
            contexts[index] = Some(context);
        }
    }
    let mut mismatched = [0; 4];
    for (levels, mismatched) in mismatched.iter_mut().enumerate() {
        for top in 0..nodes.len() {
            for (i, guess) in skeleton.guesses(top, levels)? {
                *mismatched += u32::from(contexts[i]?.scale != guess.scale);
            }
        }
    }
    Some(SharedTopDown { tree: compressed, mismatched })
}

/// A tree without its planes.
struct Skeleton<'a> {
    nodes: &'a [Bvh2Node],
    /// Sizes of the nodes' subtrees.
    open: Vec<OpenNode>,
    /// The nodes' last words.
    at: Vec<u32>,
    sharing: &'a Sharing,
}

impl Skeleton<'_> {
    /// What is below a node, if its children are known.
    fn below(&self, node: &Bvh2Node) -> Option<[OpenNode; 2]> {
        let child = |child| match child {
            Child::Leaf { count, .. } => Some(OpenNode::leaf(count)),
            Child::Inner(NodeIndex(index)) => self.open.get(index as usize).copied(),
        };
        let [left, right] = &node.children;
        Some([child(left.child)?, child(right.child)?])
    }

    /// A node in a context, and its children that are nodes.
    fn encode(
        &self,
        i: usize,
        context: &SharedContext,
    ) -> Option<(SharedNode, Vec<(usize, SharedContext)>)> {
        let node = &self.nodes[i];
        let shared = share(node, &self.below(node)?, context.scale)?;
        let len = shared.to_words(self.sharing.grids).len();
        let decoded = context.decode(NodeIndex(self.at[i]), &shared, len, self.sharing)?;
        let inner = |(child, context): (&Subtree, SharedContext)| match child.child {
            Child::Inner(NodeIndex(index)) => Some((index as usize, context)),
            Child::Leaf { .. } => None,
        };
        Some((shared, node.children.iter().zip(decoded).filter_map(inner).collect()))
    }

    /// The nodes so many levels below `top`, in the contexts that follow from its exact box. Nodes
    /// nearer to the root than that stay on chip until the end.
    fn guesses(&self, top: usize, levels: usize) -> Option<Vec<(usize, SharedContext)>> {
        let [a, b] = &self.nodes[top].children;
        let child = Child::Inner(NodeIndex(self.at[top]));
        let start = Subtree { bounds: a.bounds.union(&b.bounds), child };
        let mut layer =
            vec![(top, SharedContext::root(&start, self.open[top].entries, self.sharing)?)];
        for _ in 0..levels {
            let mut next = Vec::new();
            for (i, context) in layer {
                next.extend(self.encode(i, &context)?.1);
            }
            layer = next;
        }
        Some(layer)
    }
}

fn read(memory: &FlatMemory, tree: &Tree) -> Option<Vec<Bvh2Node>> {
    let len = Bvh2Node::BYTES;
    let node = |index| {
        let at = tree.nodes.record(index, len as u32)?.0 as usize;
        let bytes = memory.bytes().get(at..at + len)?.try_into().ok()?;
        Bvh2View::new(bytes).to_repr()
    };
    (0..tree.node_count).map(node).collect()
}
