//! Where the job puts things in the memory behind the blob.

use xylem_core::mem::Region;
use xylem_core::node::{Bvh2Node, LeafEntry, Quantization, Tree};
use xylem_core::pipeline::{BuildConfig, BuildRegions};
use xylem_core::traverse::Hit;

use crate::blob::{ALIGN, Blob};
use crate::report::OUTPUTS;

/// The regions of one job, one behind the other from the start of the work space, each aligned to
/// 64 bytes.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Layout {
    /// What the builder uses. Its input are the blob's triangles.
    pub build: BuildRegions,
    /// The quantized nodes.
    pub quantized_nodes: Region,
    /// The hit records.
    pub hits: Region,
    /// The memory behind them.
    pub free: Region,
}

impl Layout {
    /// The regions for a blob, or the number of bytes they would take (at most `u32::MAX`) if there
    /// are not as many.
    pub fn new(blob: &Blob, config: &BuildConfig) -> Result<Self, u32> {
        let mut places = Places::new(blob.work);
        let mut place = |bytes| places.place(bytes);
        let count = blob.header.triangles;
        let records = |count: u32, bytes: usize| u64::from(count) * bytes as u64;
        let [runs_a, runs_b] = config.run_bytes(count);
        let mut layout = Self {
            build: BuildRegions {
                primitives: blob.triangles,
                runs_a: place(runs_a),
                runs_b: place(runs_b),
                nodes: place(records(count, Bvh2Node::BYTES)),
                leaf_table: place(records(count, LeafEntry::BYTES)),
            },
            quantized_nodes: place(records(count, Quantization::RELATIVE.node_bytes() as usize)),
            hits: place(records(blob.header.rays, Hit::BYTES)),
            free: Region::default(),
        };
        layout.free = places.rest()?;
        Ok(layout)
    }

    /// The used parts of the regions of [`OUTPUTS`], given the tree of 64-byte nodes.
    pub fn outputs(&self, tree: &Tree) -> [Region; OUTPUTS.len()] {
        let first = |region: Region, count: u32, bytes: usize| Region {
            size: region.size.min(count.saturating_mul(bytes as u32)),
            ..region
        };
        [
            first(self.build.leaf_table, tree.entry_count, LeafEntry::BYTES),
            first(self.build.nodes, tree.node_count, Bvh2Node::BYTES),
            first(
                self.quantized_nodes,
                tree.node_count,
                Quantization::RELATIVE.node_bytes() as usize,
            ),
            self.hits,
        ]
    }
}

/// Hands out pieces of a region, one behind the other, each on a multiple of 64 bytes like the region.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Places {
    all: Region,
    used: u64,
}

impl Places {
    pub const fn new(all: Region) -> Self {
        Self { all, used: 0 }
    }

    /// The next `bytes`, which count only if [`rest`](Self::rest) says that there were as many.
    pub fn place(&mut self, bytes: u64) -> Region {
        let base = u64::from(self.all.base.0) + self.used;
        self.used += bytes.next_multiple_of(u64::from(ALIGN));
        // A base or size that is cut off here belongs to places that `rest` refuses.
        Region::new(base as u32, bytes as u32)
    }

    /// What is left, or how many bytes the pieces take (at most `u32::MAX`) if there are fewer.
    pub fn rest(&self) -> Result<Region, u32> {
        let refused = u32::try_from(self.used).unwrap_or(u32::MAX);
        let left = u64::from(self.all.size).checked_sub(self.used).ok_or(refused)?;
        let base = u64::from(self.all.base.0) + self.used;
        Ok(Region::new(base as u32, left as u32))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::blob::Header;
    use xylem_core::emit::CellConfig;
    use xylem_core::geom::{Ray, Triangle};
    use xylem_core::node::NodeFormat;
    use xylem_core::num::{Grid, MortonWidth};
    use xylem_core::sort::SortConfig;
    use xylem_core::toplevel::TopLevel;
    use xylem_core::traverse::Query;

    fn blob(triangles: u32, rays: u32, work: u32) -> Blob {
        let header = Header {
            machine_traps: false,
            accelerator: false,
            grid: Grid::DEFAULT,
            morton: MortonWidth::Bits30,
            format: NodeFormat::Bvh2,
            treelet_depth: 0,
            query: Query::Closest,
            sort: SortConfig::PAPER,
            max_leaf_size: 255,
            top_level: TopLevel::None,
            cells: CellConfig::default(),
            join_leaves: 0,
            animation: None,
            triangles,
            rays,
        };
        let piece = |base: u32, count: u32, bytes: usize| Region::new(base, count * bytes as u32);
        Blob {
            header,
            triangles: piece(0x100, triangles, Triangle::BYTES),
            rays: piece(0x8000_0000, rays, Ray::BYTES),
            work: Region::new(0x9000_0000, work),
        }
    }

    #[test]
    fn regions_follow_each_other_and_fill_the_work_space_exactly() {
        let config = BuildConfig::default();
        // 100 primitives: 3200 + 6400 + 400 + 1600 bytes; 10 rays: 240; each to a multiple of 64.
        let needed = 3200 + 6400 + 448 + 1600 + 256;
        let layout = Layout::new(&blob(100, 10, needed), &config).unwrap();
        let all = [
            layout.build.runs_a,
            layout.build.nodes,
            layout.build.leaf_table,
            layout.quantized_nodes,
            layout.hits,
        ];
        let mut end = 0x9000_0000;
        for region in all {
            assert_eq!((region.base.0, region.base.0 % 64), (end, 0));
            end += region.size.next_multiple_of(64);
        }
        assert_eq!(end, 0x9000_0000 + needed);
        assert_eq!(layout.free, Region::new(end, 0));
        let roomy = Layout::new(&blob(100, 10, needed + 70), &config).unwrap();
        assert_eq!(roomy, Layout { free: Region::new(end, 70), ..layout });
        assert_eq!(Layout::new(&blob(100, 10, needed - 1), &config), Err(needed));
    }

    #[test]
    fn two_passes_get_a_second_region_of_runs() {
        let sort = SortConfig { capacity: 64, burst: 16, ..SortConfig::PAPER };
        let config = BuildConfig { sort, ..BuildConfig::default() };
        let runs_b = |count| Layout::new(&blob(count, 0, 1 << 20), &config).unwrap().build.runs_b;
        assert_eq!(runs_b(128).size, 0);
        assert_eq!(runs_b(129).size, 129 * 32);
    }

    #[test]
    fn a_layout_beyond_the_address_space_is_refused() {
        let layout = Layout::new(&blob(100_000_000, 0, u32::MAX), &BuildConfig::default());
        assert_eq!(layout, Err(u32::MAX));
    }
}
