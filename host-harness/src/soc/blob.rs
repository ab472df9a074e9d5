//! Writes scene blobs.

use xylem_core::emit::CellConfig;
use xylem_core::geom::{Ray, Triangle};
use xylem_core::node::{MAX_LEAF_SIZE, NodeFormat, Quantization};
use xylem_core::num::{Grid, MortonWidth};
use xylem_core::refit::RebuildRule;
use xylem_core::sort::SortConfig;
use xylem_core::toplevel::TopLevel;
use xylem_core::traverse::Query;
use xylem_firmware::blob::{ALIGN, Animation, Header};
use xylem_firmware::job::MAX_CELLS;
use xylem_firmware::map::EXTERNAL;

use super::SocError;

/// A scene and its rays as the firmware takes them; the format is [`xylem_firmware::blob`].
#[derive(Clone, Debug)]
pub struct SceneBlob {
    /// The grid of all coordinates.
    pub grid: Grid,
    /// The width of the sort key.
    pub morton: MortonWidth,
    /// The format that rays are traced through.
    pub format: NodeFormat,
    /// How quantized nodes are compressed, see [`Header::treelet_depth`].
    pub treelet_depth: u8,
    /// What rays are asked.
    pub query: Query,
    /// The shape of the sorter.
    pub sort: SortConfig,
    /// The largest leaf, in primitives.
    pub max_leaf_size: u32,
    /// How the top of the tree is built; one of [`TOP_LEVELS`](xylem_firmware::blob::TOP_LEVELS).
    pub top_level: TopLevel,
    /// With a top level, what it is built over: [`MAX_CELLS`] at most.
    pub cells: CellConfig,
    /// Neighbouring leaves are joined up to this many primitives, at most 16; 0 for not at all.
    pub join_leaves: u32,
    /// The triangles, in the first frame if they move.
    pub triangles: Vec<Triangle>,
    /// How they move, if they do.
    pub animation: Option<Motion>,
    /// The rays.
    pub rays: Vec<Ray>,
    /// Whether there is an accelerator that is to do the job too. Not where triangles move.
    pub accelerator: bool,
}

/// The further frames of an animation.
#[derive(Clone, PartialEq, Debug)]
pub struct Motion {
    /// The triangles of every frame but the first, as many in each.
    pub later: Vec<Vec<Triangle>>,
    /// When the tree is rebuilt rather than refitted.
    pub rule: RebuildRule,
}

impl Default for SceneBlob {
    /// No triangles and no rays; quantized nodes in relative coordinates from the root down, closest hits, no top level,
    /// and a sorter and cells that fit the firmware's storage: `M` = 2048, `B` = 16.
    fn default() -> Self {
        Self {
            grid: Grid::DEFAULT,
            morton: MortonWidth::Bits30,
            format: NodeFormat::Quantized(Quantization::RELATIVE),
            treelet_depth: 0,
            query: Query::Closest,
            sort: SortConfig { capacity: 2048, burst: 16, ..SortConfig::PAPER },
            max_leaf_size: MAX_LEAF_SIZE,
            top_level: TopLevel::None,
            cells: CellConfig { capacity: MAX_CELLS as u32, ..CellConfig::default() },
            join_leaves: 0,
            triangles: Vec::new(),
            animation: None,
            rays: Vec::new(),
            accelerator: false,
        }
    }
}

impl SceneBlob {
    /// The blob's bytes. `machine_traps` says whether the core has the standard trap registers.
    ///
    /// # Errors
    /// [`SocError::TooLarge`] if the soft core's external memory cannot hold it; [`SocError::Frames`] if
    /// the triangles of a frame are not as many as those of the first.
    pub fn to_bytes(&self, machine_traps: bool) -> Result<Vec<u8>, SocError> {
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        let later = self.animation.as_ref().map_or(&[][..], |motion| &motion.later);
        let first = self.triangles.len();
        if let Some((at, frame)) = later.iter().enumerate().find(|(_, f)| f.len() != first) {
            return Err(SocError::Frames { first, frame: at + 1, triangles: frame.len() });
        }
        let frames = count(1 + later.len());
        let header = Header {
            machine_traps,
            accelerator: self.accelerator,
            grid: self.grid,
            morton: self.morton,
            format: self.format,
            treelet_depth: self.treelet_depth,
            query: self.query,
            sort: self.sort,
            max_leaf_size: self.max_leaf_size,
            top_level: self.top_level,
            cells: self.cells,
            join_leaves: self.join_leaves,
            animation: self
                .animation
                .as_ref()
                .map(|motion| Animation { frames, rule: motion.rule }),
            triangles: count(self.triangles.len()),
            rays: count(self.rays.len()),
        };
        if header.blob_bytes().is_none_or(|bytes| bytes > EXTERNAL.size) {
            let records = |n: usize, bytes: usize| n as u64 * bytes as u64;
            let frame = records(first, Triangle::BYTES).next_multiple_of(u64::from(ALIGN));
            let needed = u64::from(Header::RECORDS_AT)
                + frame * (1 + later.len() as u64)
                + records(self.rays.len(), Ray::BYTES);
            return Err(SocError::TooLarge { needed, size: EXTERNAL.size });
        }
        let mut bytes = header.to_bytes().to_vec();
        for frame in std::iter::once(&self.triangles).chain(later) {
            bytes.resize(bytes.len().next_multiple_of(ALIGN as usize), 0);
            bytes.extend(frame.iter().flat_map(Triangle::to_bytes));
        }
        bytes.resize(bytes.len().next_multiple_of(ALIGN as usize), 0);
        bytes.extend(self.rays.iter().flat_map(Ray::to_bytes));
        Ok(bytes)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::bus::FlatMemory;
    use xylem_core::mem::Region;
    use xylem_firmware::blob::Blob;

    #[test]
    fn the_firmware_finds_what_was_written() {
        let triangle = Triangle { vertices: [[1, 2, 3].into(); 3], id: 9 };
        let scene = SceneBlob { triangles: vec![triangle; 3], ..SceneBlob::default() };
        let bytes = scene.to_bytes(true).unwrap();
        let all = Region::new(0, 4096);
        let mut memory = FlatMemory::new(4096);
        memory.bytes_mut()[..bytes.len()].copy_from_slice(&bytes);
        let blob = Blob::parse(&mut memory, all).unwrap();
        assert!(blob.header.machine_traps);
        assert_eq!((blob.header.grid, blob.header.sort), (scene.grid, scene.sort));
        assert_eq!((blob.header.triangles, blob.header.rays), (3, 0));
        assert_eq!(memory.region(blob.triangles), triangle.to_bytes().repeat(3));
    }

    #[test]
    fn a_scene_larger_than_memory_is_refused_with_both_sizes() {
        let triangle = Triangle { vertices: [[0, 0, 0].into(); 3], id: 0 };
        let scene = SceneBlob { triangles: vec![triangle; 1_500_000], ..SceneBlob::default() };
        let error = scene.to_bytes(false).unwrap_err();
        assert!(matches!(error, SocError::TooLarge { needed: 60_000_128, size: 58_720_256 }));
    }
}
