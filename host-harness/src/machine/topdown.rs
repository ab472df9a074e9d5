//! The separate pass that P3 compares with: a finished tree is read from the root down and written
//! quantized.

use std::collections::VecDeque;

use xylem_core::compress::compress_top_down;
use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::{ByteAddr, Region};
use xylem_core::node::{Bvh2View, Child, NodeIndex, Quantization, Tree};
use xylem_core::probe::Stage;

use super::mergetree::MachineError;
use super::port::{Access, LINE_BYTES, Port, PortError};
use crate::bus::{FlatMemory, Tally, Traffic};

/// A finished pass.
#[derive(Debug)]
pub struct TopDownRun {
    /// The quantized tree.
    pub tree: Tree,
    /// Machine cycles.
    pub cycles: u64,
    /// Traffic of the pass.
    pub traffic: Traffic,
}

/// Compresses `tree` on the clock: the same bytes as [`compress_top_down`].
///
/// P3 §5.3 is generous to its baseline, and so is this: a node is read as soon as its parent is here,
/// there is room for all that are on their way, and a line is written once, when its last node has
/// been encoded. The nodes, of 64 bytes, lie on lines.
///
/// # Errors
/// [`MachineError`]; `time_out` cycles without an answer are one.
pub fn compress<P: Port>(
    memory: &mut FlatMemory,
    tree: &Tree,
    target: Region,
    quantization: &Quantization,
    port: &mut P,
    time_out: u64,
) -> Result<TopDownRun, MachineError> {
    let no_access = |error: BuildError<_>| error.map_bus(|_| PortError::Read);
    let quantized = compress_top_down(memory, tree, target, quantization, &mut ());
    let quantized = quantized.map_err(no_access)?;
    let bytes = quantization.node_bytes();
    let line_of = |index: u32| (target.base.0 + index * bytes) / LINE_BYTES;
    let first_line = target.base.0 / LINE_BYTES;
    // Nodes of each line that are still to come; one that lies in two lines counts in its last.
    let last_line = |index: u32| (target.base.0 + (index + 1) * bytes - 1) / LINE_BYTES;
    let mut missing = vec![0u32; (last_line(tree.node_count) - first_line + 1) as usize];
    for index in 0..tree.node_count {
        for line in line_of(index)..=last_line(index) {
            missing[(line - first_line) as usize] += 1;
        }
    }
    let mut ready = Vec::new();
    if let Some(Child::Inner(NodeIndex(root))) = tree.root.map(|root| root.child) {
        ready.push(root);
    }
    let (mut writes, mut left) = (VecDeque::new(), tree.node_count);
    let (mut cycles, mut moved_at) = (0, 0);
    while left > 0 || !writes.is_empty() {
        if let Some(response) = port.take() {
            moved_at = cycles;
            let addr = ByteAddr(response.access.addr);
            if response.failed {
                let error = if response.access.write { PortError::Write } else { PortError::Read };
                return Err(BuildError::Bus { stage: Stage::Compress, addr, error }.into());
            }
            let index = (addr.0 - tree.nodes.base.0) / LINE_BYTES;
            let corrupt = BuildError::CorruptNode { index };
            let at = addr.0 as usize;
            let node = memory.bytes().get(at..).and_then(<[u8]>::first_chunk).ok_or(corrupt)?;
            let view = Bvh2View::new(node);
            for child in [1, 0] {
                if let Child::Inner(NodeIndex(below)) = view.child(child).ok_or(corrupt)? {
                    ready.push(below);
                }
            }
            left -= 1;
            for line in line_of(index)..=last_line(index) {
                let count = &mut missing[(line - first_line) as usize];
                *count -= 1;
                if *count == 0 {
                    writes.push_back(line * LINE_BYTES);
                }
            }
        }
        if let Some(&index) = ready.last() {
            let addr = tree.nodes.base.0 + index * LINE_BYTES;
            if port.offer(Access { addr, write: false, tag: 0 }) {
                ready.pop();
                moved_at = cycles;
            }
        }
        if let Some(&addr) = writes.front()
            && port.offer(Access { addr, write: true, tag: 0 })
        {
            writes.pop_front();
            moved_at = cycles;
        }
        port.tick();
        cycles += 1;
        if cycles - moved_at > time_out {
            let (stage, error) = (Stage::Compress, PortError::TimeOut);
            return Err(BuildError::Bus { stage, addr: tree.nodes.base, error }.into());
        }
    }
    let nodes = u64::from(tree.node_count);
    let mut traffic = Traffic::default();
    let read = Tally { read_bytes: nodes * 64, reads: nodes, ..Tally::default() };
    let write_bytes = nodes * u64::from(bytes);
    let write = Tally { write_bytes, writes: nodes, ..Tally::default() };
    let time = Tally { millicycles: 1000 * cycles, ..Tally::default() };
    for (region, tally) in [
        (Some(RegionName::Nodes.as_str()), read),
        (Some(RegionName::QuantizedNodes.as_str()), write),
        (None, time),
    ] {
        *traffic.tallies.entry((Stage::Compress, region)).or_default() += tally;
    }
    Ok(TopDownRun { tree: quantized, cycles, traffic })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::machine::port::IdealPort;
    use crate::run::{self, BuildOptions};
    use crate::scene::{LoadOptions, procedural};

    #[test]
    fn the_pass_writes_the_cores_bytes_and_takes_a_latency_a_level_at_least() {
        let soup = procedural::soup("sphereflake:0").unwrap().unwrap();
        let mesh = soup.into_mesh("sphereflake:0", &LoadOptions::default()).unwrap();
        let run = run::build(&mesh.triangles, &BuildOptions::default()).unwrap();
        let depth = run.check().unwrap().depth;
        let (tree, target) = (run.scene.tree, run.layout.quantized_nodes);
        let mut expect = run.memory.clone();
        let quantization = Quantization::MODULO;
        compress_top_down(&mut expect, &tree, target, &quantization, &mut ()).unwrap();
        let mut memory = run.memory.clone();
        for latency in [1, 50] {
            let mut port = IdealPort::new(latency);
            let pass = compress(&mut memory, &tree, target, &quantization, &mut port, 1000);
            let pass = pass.unwrap();
            assert_eq!(memory.bytes(), expect.bytes());
            assert!(pass.cycles >= u64::from(tree.node_count.max((depth - 1) * latency)));
            assert_eq!(pass.traffic.total().bytes(), u64::from(tree.node_count) * 80);
        }
        struct Dead;
        impl Port for Dead {
            fn offer(&mut self, _: Access) -> bool {
                false
            }
            fn take(&mut self) -> Option<super::super::port::Response> {
                None
            }
            fn tick(&mut self) {}
            fn peak_bytes_per_cycle(&self) -> Option<f64> {
                None
            }
        }
        let failure = compress(&mut memory, &tree, target, &quantization, &mut Dead, 1000);
        assert!(failure.unwrap_err().to_string().contains("TimeOut"));
    }
}
