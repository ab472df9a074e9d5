//! Where things are in simulated memory.

use xylem_core::error::RegionName;
use xylem_core::geom::Triangle;
use xylem_core::mem::Region;
use xylem_core::node::{LeafEntry, NodeFormat, QuantizedPair, SharedNode};
use xylem_core::pipeline::{BuildConfig, BuildRegions};
use xylem_core::sort::InputFormat;

/// The regions of one scene, one after the other from address 0, each aligned to 4 KiB.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Layout {
    /// The triangles, which rays are tested against, and which are the input where that is 40-byte
    /// triangles.
    pub triangles: Region,
    /// What the builder uses.
    pub build: BuildRegions,
    /// Room for quantized nodes.
    pub quantized_nodes: Region,
    /// The end of the last region.
    pub size: u64,
}

const ALIGNMENT: u64 = 4096;

/// Bytes to keep free for a node, all its extensions included.
const fn node_room(format: NodeFormat) -> usize {
    match format {
        NodeFormat::Shared(_) => SharedNode::MAX_WORDS * SharedNode::WORD_BYTES as usize,
        _ => format.bytes() as usize,
    }
}

impl Layout {
    /// The regions for `count` primitives, or the number of bytes they would take if that exceeds
    /// the 4 GiB that addresses reach.
    pub fn new(config: &BuildConfig, count: u32) -> Result<Self, u64> {
        let mut size = 0u64;
        let mut overflow = false;
        let mut place = |bytes: u64| {
            let base = size;
            size = (size + bytes).next_multiple_of(ALIGNMENT);
            overflow |= size > u64::from(u32::MAX);
            Region::new(base as u32, bytes as u32)
        };
        let records = |bytes: usize| u64::from(count) * bytes as u64;
        let triangles = place(records(Triangle::BYTES));
        let primitives = match config.input {
            InputFormat::Triangle40 => triangles,
            InputFormat::Box32 => place(records(32)),
        };
        let [runs_a, runs_b] = config.run_bytes(count);
        let build = BuildRegions {
            primitives,
            runs_a: place(runs_a),
            runs_b: place(runs_b),
            nodes: place(records(node_room(config.format()))),
            leaf_table: place(records(LeafEntry::BYTES)),
        };
        let quantized_nodes = match config.format() {
            NodeFormat::Bvh2 => place(records(QuantizedPair::MAX_BYTES)),
            _ => build.nodes,
        };
        let layout = Self { triangles, build, quantized_nodes, size };
        if overflow { Err(size) } else { Ok(layout) }
    }

    /// The regions with their names.
    pub fn named(&self) -> Vec<(RegionName, Region)> {
        let mut regions = vec![
            (RegionName::Primitives, self.build.primitives),
            (RegionName::RunsA, self.build.runs_a),
            (RegionName::RunsB, self.build.runs_b),
            (RegionName::LeafTable, self.build.leaf_table),
            (RegionName::QuantizedNodes, self.quantized_nodes),
        ];
        if self.quantized_nodes != self.build.nodes {
            regions.push((RegionName::Nodes, self.build.nodes));
        }
        if self.triangles != self.build.primitives {
            regions.push((RegionName::Triangles, self.triangles));
        }
        regions
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn regions_do_not_overlap_and_fit_the_size() {
        for input in [InputFormat::Box32, InputFormat::Triangle40] {
            let config = BuildConfig { input, ..BuildConfig::default() };
            let layout = Layout::new(&config, 12_345).unwrap();
            let mut regions: Vec<_> = layout.named().into_iter().map(|(_, r)| r).collect();
            regions.sort_by_key(|r| (r.base, r.size));
            for pair in regions.windows(2) {
                assert!(pair[0].base.0 + pair[0].size <= pair[1].base.0);
            }
            let last = regions.last().unwrap();
            assert!(u64::from(last.base.0 + last.size) <= layout.size);
        }
    }

    #[test]
    fn a_scene_beyond_the_address_space_is_refused_with_its_size() {
        let size = Layout::new(&BuildConfig::default(), 100_000_000).unwrap_err();
        assert!(size > 1 << 32);
    }
}
