//! The streaming compressors over memory that returns other nodes than were written, over damaged
//! nodes, and over nodes that no emitter sends: a typed error or a tree that can be checked and
//! searched.

#![no_main]

use libfuzzer_sys::fuzz_target;
use xylem_core::compress::{
    Compression, Compressor, HeldNode, MAX_LINES, OpenWide, Place, Repairs, SharedCompressor,
    WideCompressor,
};
use xylem_core::error::BuildError;
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{
    Bvh2Node, Bvh2View, Child, NodeFormat, NodeIndex, SharedNode, Subtree, Tree,
};
use xylem_core::quality;
use xylem_core::traverse::{Method, Query, Scene, trace_by};
use xylem_fuzz::{Input, Memory, OutOfMemory, pristine};

/// Memory whose reads of nodes are damaged while damage is left.
struct Treacherous<'a> {
    memory: Memory,
    damage: Input<'a>,
    nodes: Region,
}

impl Bus for Treacherous<'_> {
    type Error = OutOfMemory;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), OutOfMemory> {
        self.memory.read(addr, buf)?;
        let inside = addr >= self.nodes.base && addr.0 < self.nodes.base.0 + self.nodes.size;
        let kind = if inside { self.damage.byte() } else { 0 };
        if kind & 1 == 1 {
            for _ in 0..=kind >> 5 {
                let [place, flip] = self.damage.array();
                let at = usize::from(place) % buf.len();
                buf[at] ^= flip;
            }
            Memory::count_damaged(self.memory.format, buf.len());
        }
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), OutOfMemory> {
        self.memory.write(addr, bytes)
    }
}

/// The compressors.
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
enum Any<'a> {
    Pairs(Compressor<'a>),
    Wide(WideCompressor<'a>),
    Shared(SharedCompressor),
}

impl Any<'_> {
    fn accept(
        &mut self,
        bus: &mut impl Bus<Error = OutOfMemory>,
        node: &Bvh2Node,
        index: NodeIndex,
    ) -> Result<(), BuildError<OutOfMemory>> {
        match self {
            Any::Pairs(pairs) => pairs.accept(bus, node, index, Place::Next, &mut ()),
            Any::Wide(wide) => wide.accept(bus, node, index, &mut ()),
            Any::Shared(shared) => shared.accept(bus, node, index, &mut ()),
        }
    }

    /// Gives how many nodes, or words of them, there are. `sent` is how many were accepted.
    fn finish(
        self,
        bus: &mut impl Bus<Error = OutOfMemory>,
        root: Option<&Subtree>,
        sent: u32,
    ) -> Result<u32, BuildError<OutOfMemory>> {
        match self {
            Any::Pairs(pairs) => pairs.finish(bus, root, &mut ()).map(|()| sent),
            Any::Wide(wide) => wide.finish(bus, root, &mut ()),
            Any::Shared(shared) => {
                let words = shared.words();
                shared.finish(bus).map(|()| words)
            }
        }
    }
}

/// What is damaged.
#[derive(Clone, Copy, PartialEq, Eq)]
enum Damage {
    /// What the compressor reads back.
    Reads,
    /// The nodes that it is sent.
    Nodes,
    /// There is nothing but what the fuzzer sends.
    All,
}

fuzz_target!(|data: &[u8]| {
    let mut input = Input(data);
    let [kind, mode] = input.array();
    let quantization = input.quantization();
    let repairs = match input.byte() {
        lines @ 2.. if usize::from(lines) <= MAX_LINES => Repairs::InLines(lines),
        _ => Repairs::InMemory,
    };
    let compression =
        Compression { quantization, treelet_depth: 1 + (kind & 3), margin: kind >> 2 & 3, repairs };
    compression.check().expect("the parameters are in their ranges");
    let format = match mode % 3 {
        0 => NodeFormat::Quantized(quantization),
        1 => NodeFormat::Wide(quantization),
        _ => NodeFormat::Shared(input.sharing()),
    };
    let ray = input.ray();
    let target = match (mode / 3 % 3, format) {
        (0, _) => Damage::All,
        // A stream that reads nothing back.
        (_, NodeFormat::Shared(_)) | (1, _) => Damage::Nodes,
        _ => Damage::Reads,
    };

    let whole = pristine();
    let source = whole.scene.tree;
    let sound = nodes(&whole.bytes, &source);
    let mut given = if target == Damage::All { input.0 } else { sound }.to_vec();
    if target == Damage::Nodes {
        spoil(&mut given, &mut input, mode >= 128);
    }
    let count = (given.len() / Bvh2Node::BYTES).min(1024) as u32;
    let base = whole.bytes.len() as u32;
    let bytes_a_node = match format {
        NodeFormat::Shared(_) => SharedNode::WORD_BYTES * SharedNode::MAX_WORDS as u32,
        _ => format.bytes(),
    };
    let region = Region::new(base, count * bytes_a_node);
    let mut memory = Memory::new(whole.bytes.clone(), format);
    memory.bytes.resize((base + region.size) as usize, 0);
    // A node is read back at most once for each that comes after it, and written as often.
    memory.accesses_left = 4 * u64::from(count) * (u64::from(count) + 4);
    let damage = if target == Damage::Reads { input } else { Input(&[]) };
    let mut bus = Treacherous { memory, damage, nodes: region };

    let mut held = vec![HeldNode::EMPTY; compression.held_nodes()];
    let mut open = vec![OpenWide::EMPTY; OpenWide::STACK];
    let mut compressor = match format {
        NodeFormat::Shared(sharing) => Any::Shared(SharedCompressor::new(sharing, region, 512)),
        NodeFormat::Wide(_) => Any::Wide(WideCompressor::new(compression, region, &mut open)),
        _ => Any::Pairs(Compressor::new(compression, region, &mut held)),
    };
    let mut sent = 0;
    let mut records = given.chunks_exact(Bvh2Node::BYTES).take(count as usize).enumerate();
    let outcome = records.try_for_each(|(i, bytes)| {
        let at = i * Bvh2Node::BYTES;
        let original = sound.get(at..at + Bvh2Node::BYTES).filter(|_| target != Damage::All);
        if original != Some(bytes) {
            Memory::count_damaged(format, bytes.len());
        }
        // What is no node any more is sent as it was, so that the stream goes on.
        let node = decode(bytes).or_else(|| decode(original?));
        let Some(node) = node else { return Ok(()) };
        let index = NodeIndex(sent);
        sent += 1;
        compressor.accept(&mut bus, &node, index)
    });
    let root = if target == Damage::All { None } else { source.root };
    let outcome = outcome.and_then(|()| compressor.finish(&mut bus, root.as_ref(), sent));
    match outcome {
        Err(BuildError::Internal) if target == Damage::Reads => {
            panic!("the compressor lost its way")
        }
        Err(_) => {}
        Ok(node_count) => {
            let last = Child::Inner(NodeIndex(node_count.saturating_sub(1)));
            let root = source.root.map(|root| Subtree { child: last, ..root });
            let tree = Tree { format, nodes: region, node_count, root, ..source };
            let scene = Scene { tree, ..whole.scene };
            let mut memory = bus.memory;
            memory.accesses_left = 1 << 16;
            let mut seen = [0; 32];
            let _ = quality::check(&mut memory, &scene, &mut seen);
            for method in Method::ALL {
                memory.accesses_left = 1 << 16;
                let _ = trace_by(method, &mut memory, &scene, &ray, Query::Closest, &mut ());
            }
        }
    }
    Memory::count_execution();
});

/// Damages single bytes, or one in every node by the same input again and again. Mostly boxes and a little:
/// of pointers and of boxes off the grid few survive.
fn spoil(nodes: &mut [u8], input: &mut Input<'_>, every: bool) {
    let mut strike = |node: usize, kind: u8, flip: u8| {
        let kind = usize::from(kind);
        let byte = match kind {
            // The lower half of a coordinate.
            0..240 => 4 * (kind % 12) + (kind / 12) % 2,
            240..250 => kind % 48,
            _ => kind % Bvh2Node::BYTES,
        };
        nodes[node * Bvh2Node::BYTES + byte] ^= flip;
    };
    let count = pristine().scene.tree.node_count as usize;
    if every {
        let (strikes, _) = input.0.as_chunks();
        for (node, [kind, flip]) in strikes.iter().cycle().take(count).enumerate() {
            strike(node, *kind, *flip);
        }
        return;
    }
    while !input.0.is_empty() {
        let [kind, flip, place @ ..] = input.array::<4>();
        strike(usize::from(u16::from_le_bytes(place)) % count, kind, flip);
    }
}

fn decode(bytes: &[u8]) -> Option<Bvh2Node> {
    Bvh2View::new(bytes.try_into().ok()?).to_repr()
}

fn nodes<'a>(bytes: &'a [u8], tree: &Tree) -> &'a [u8] {
    let at = tree.nodes.base.0 as usize;
    &bytes[at..at + tree.node_count as usize * Bvh2Node::BYTES]
}
