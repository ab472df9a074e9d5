//! The streaming compressor over memory that returns other nodes than were written, and over
//! nodes that no emitter sends: a typed error or a tree that can be checked and searched.

#![no_main]

use libfuzzer_sys::fuzz_target;
use xylem_core::compress::{
    Compression, Compressor, HeldNode, MAX_LINES, OpenWide, Place, Repairs, WideCompressor,
};
use xylem_core::error::BuildError;
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{Bvh2Node, Bvh2View, Child, NodeFormat, NodeIndex, Subtree, Tree};
use xylem_core::quality;
use xylem_core::traverse::{Method, Query, Scene, trace_by};
use xylem_fuzz::{Input, Memory, OutOfMemory, pristine};

/// Memory whose reads are damaged while damage is left.
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
            Memory::count_damaged(buf.len());
        }
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), OutOfMemory> {
        self.memory.write(addr, bytes)
    }
}

/// The two compressors.
#[expect(clippy::large_enum_variant, reason = "there is one at a time")]
enum Either<'a> {
    Pairs(Compressor<'a>),
    Wide(WideCompressor<'a>),
}

fuzz_target!(|data: &[u8]| {
    let mut input = Input(data);
    let kind = input.byte();
    let quantization = input.quantization();
    let repairs = match input.byte() {
        lines @ 2.. if usize::from(lines) <= MAX_LINES => Repairs::InLines(lines),
        _ => Repairs::InMemory,
    };
    let compression = Compression {
        quantization,
        treelet_depth: 1 + (kind & 3),
        margin: kind >> 2 & 3,
        repairs,
    };
    compression.check().expect("the parameters are in their ranges");
    let ray = input.ray();

    let whole = pristine();
    let source = whole.scene.tree;
    let own = kind & 16 != 0;
    // Nodes of the fuzzer, or as many of the scene's as there is damage for.
    let given = if own { input.0 } else { nodes(&whole.bytes, &source) };
    let count = (given.len() / Bvh2Node::BYTES).min(1024) as u32;
    let base = whole.bytes.len() as u32;
    let region = Region::new(base, count * quantization.wide_bytes());
    let mut bytes = whole.bytes.clone();
    bytes.resize((base + region.size) as usize, 0);
    // A node is read back at most once for each that comes after it, and written as often.
    let accesses_left = 4 * u64::from(count) * (u64::from(count) + 4);
    let memory = Memory { bytes, nodes: Region::default(), before: Vec::new(), accesses_left };
    let damage = if own { Input(&[]) } else { Input(input.0) };
    let mut bus = Treacherous { memory, damage, nodes: region };

    let mut held = vec![HeldNode::EMPTY; compression.held_nodes()];
    let mut open = vec![OpenWide::EMPTY; OpenWide::STACK];
    let mut compressor = if kind & 32 == 0 {
        Either::Pairs(Compressor::new(compression, region, &mut held))
    } else {
        Either::Wide(WideCompressor::new(compression, region, &mut open))
    };
    let mut sent = 0;
    let outcome = given.chunks_exact(Bvh2Node::BYTES).take(count as usize).try_for_each(|node| {
        let view = node.try_into().expect("64 bytes");
        let Some(node) = Bvh2View::new(view).to_repr() else { return Ok(()) };
        let index = NodeIndex(sent);
        sent += 1;
        match &mut compressor {
            Either::Pairs(pairs) => pairs.accept(&mut bus, &node, index, Place::Next, &mut ()),
            Either::Wide(wide) => wide.accept(&mut bus, &node, index, &mut ()),
        }
    });
    let root = if own { None } else { source.root };
    let outcome = outcome.and_then(|()| {
        let (root, bus) = (root.as_ref(), &mut bus);
        match compressor {
            Either::Pairs(pairs) => {
                pairs.finish(bus, root, &mut ()).map(|()| (NodeFormat::Quantized(quantization), sent))
            }
            Either::Wide(wide) => {
                wide.finish(bus, root, &mut ()).map(|count| (NodeFormat::Wide(quantization), count))
            }
        }
    });
    match outcome {
        Err(BuildError::Internal) if !own => panic!("the compressor lost its way"),
        Err(_) => {}
        Ok((format, node_count)) => {
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

fn nodes<'a>(bytes: &'a [u8], tree: &Tree) -> &'a [u8] {
    let at = tree.nodes.base.0 as usize;
    &bytes[at..at + tree.node_count as usize * Bvh2Node::BYTES]
}
