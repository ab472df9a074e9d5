//! Cycle model of the clustering emitter: its events in, cycles out.
//!
//! | Property | Value |
//! |---|---|
//! | Throughput | one beat a cycle: each sweep takes a cluster, meets it with `R` others at once, decides on one |
//! | First pass | one cluster every 2 cycles, the multi-merge's rate |
//! | Other passes | one cluster a cycle |
//! | Latency | a sweep's decision follows its beat by 6 cycles: union, two subtractions' products and sums, comparison tree |
//! | Node port | one 64-byte node a cycle; more of them in one beat stretch it |
//! | Leaf port | one leaf of up to four entries a cycle; likewise |
//! | End of a pass | windows drain one cluster a beat, one sweep after the other; then the latencies |
//!
//! The core's [`Chain`] moves all units in lockstep, so the time of a pass is the sum over its beats.
//! [`PlocModel`] is a [`Probe`] that adds it up while the core builds: not clocked itself, it says how
//! long the sweeps take when memory keeps up. Buses say how long memory takes.
//!
//! [`Chain`]: xylem_core::emit::Chain

use xylem_core::emit::{MAX_OPEN_LEAF, PlocConfig};
use xylem_core::probe::Probe;

/// What the unit's parts take, in cycles.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PlocTiming {
    /// Between two clusters of the first pass.
    pub merge_interval: u64,
    /// Between two clusters of the other passes.
    pub list_interval: u64,
    /// From a cluster's entry to the decision that it allows.
    pub distance_latency: u64,
    /// To write a node.
    pub node_interval: u64,
    /// To write a leaf's entries.
    pub leaf_interval: u64,
}

impl Default for PlocTiming {
    /// The values of the table above.
    fn default() -> Self {
        Self {
            merge_interval: 2,
            list_interval: 1,
            distance_latency: 6,
            node_interval: 1,
            leaf_interval: 1,
        }
    }
}

/// What a pass over a list took.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct PassCycles {
    /// Clusters in the list.
    pub clusters: u64,
    /// Steps of the chain.
    pub beats: u64,
    /// Cycles, the latency of the chain included.
    pub cycles: u64,
    /// Cycles beyond the interval of the input in which the ports stretched beats.
    pub port_stalls: u64,
    /// Areas computed, of at most `R · K` a beat.
    pub distances: u64,
    /// Nodes made.
    pub nodes: u64,
    /// Leaves closed.
    pub leaves: u64,
}

/// The model.
///
/// # Examples
///
/// ```
/// use xylem::machine::ploc::PlocModel;
/// use xylem::run::{self, Buffers, BuildOptions};
/// use xylem::scene::{LoadOptions, procedural};
/// use xylem_core::emit::{EmitterKind, PlocConfig};
///
/// let soup = procedural::soup("terrain:5").unwrap().unwrap();
/// let mesh = soup.into_mesh("terrain", &LoadOptions::default()).unwrap();
/// let mut options = BuildOptions::default();
/// options.config.emitter = EmitterKind::Ploc(PlocConfig::DEFAULT);
///
/// let (mut memory, layout) = run::load(&mesh.triangles, &options.config).unwrap();
/// let mut model = PlocModel::new(PlocConfig::DEFAULT);
/// let count = mesh.triangles.len() as u32;
/// let mut buffers = Buffers::new(&options.config);
/// run::job(&mut memory, &layout, &options, count, &mut buffers, &mut model).unwrap();
/// assert!(model.cycles() > 2 * u64::from(count));
/// ```
#[derive(Debug, Clone)]
pub struct PlocModel {
    config: PlocConfig,
    timing: PlocTiming,
    passes: Vec<PassCycles>,
    /// Nodes and leaves of the beat under way.
    nodes: u64,
    leaves: u64,
}

impl PlocModel {
    /// A model with the default timing.
    pub fn new(config: PlocConfig) -> Self {
        Self::with_timing(config, PlocTiming::default())
    }

    /// A model with its own timing.
    pub const fn with_timing(config: PlocConfig, timing: PlocTiming) -> Self {
        Self { config, timing, passes: Vec::new(), nodes: 0, leaves: 0 }
    }

    /// What each pass took so far.
    pub fn passes(&self) -> &[PassCycles] {
        &self.passes
    }

    /// Cycles of all passes. Those of the first one overlap with the merge that feeds it.
    pub fn cycles(&self) -> u64 {
        self.passes.iter().map(|pass| pass.cycles).sum()
    }

    /// Which part of the distance units' cycles computed an area, or `None` before the first.
    pub fn distance_utilisation(&self) -> Option<f64> {
        let units = u64::from(self.config.radius * self.config.chain);
        let distances: u64 = self.passes.iter().map(|pass| pass.distances).sum();
        let slots = units * self.cycles();
        (slots > 0).then(|| distances as f64 / slots as f64)
    }

    /// Bytes that the windows of all sweeps hold on chip, each cluster rounded up to whole bytes.
    ///
    /// A cluster is a box of six 24-bit coordinates, four 31-bit references (or a 32-bit pointer in
    /// their place), 3 bits that say which, 7 of depth and 8 of weight; in a window it also has the
    /// 56-bit key and the place of its nearest neighbour, 5 bits and a side, and the mark of a
    /// cluster that is done.
    pub fn window_bytes(config: &PlocConfig) -> u64 {
        let cluster = 6 * 24 + 31 * MAX_OPEN_LEAF as u64 + 3 + 7 + 8;
        let slot = cluster + 56 + 6 + 1;
        u64::from(config.window_clusters()) * slot.div_ceil(8)
    }
}

impl Probe for PlocModel {
    fn ploc_pass(&mut self, clusters: u32) {
        let chain = u64::from(self.config.chain);
        let cycles = chain * self.timing.distance_latency;
        (self.nodes, self.leaves) = (0, 0);
        self.passes.push(PassCycles { clusters: clusters.into(), cycles, ..PassCycles::default() });
    }

    #[inline]
    fn ploc_distances(&mut self, pairs: u32) {
        if let Some(pass) = self.passes.last_mut() {
            pass.distances += u64::from(pairs);
        }
    }

    #[inline]
    fn ploc_leaf(&mut self, _entries: u32) {
        self.leaves += 1;
    }

    #[inline]
    fn emit_node(&mut self) {
        self.nodes += 1;
    }

    #[inline]
    fn ploc_beat(&mut self) {
        let PlocTiming { merge_interval, list_interval, node_interval, leaf_interval, .. } =
            self.timing;
        let first = self.passes.len() == 1;
        let Some(pass) = self.passes.last_mut() else { return };
        // The list enters one cluster a beat; the beats after it drain the chain.
        let interval = match pass.beats < pass.clusters {
            true if first => merge_interval,
            true => list_interval,
            false => 1,
        };
        let ports = (self.nodes * node_interval).max(self.leaves * leaf_interval);
        pass.beats += 1;
        pass.cycles += interval.max(ports);
        pass.port_stalls += ports.saturating_sub(interval);
        pass.nodes += self.nodes;
        pass.leaves += self.leaves;
        (self.nodes, self.leaves) = (0, 0);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::{self, Buffers, BuildOptions};
    use glam::IVec3;
    use xylem_core::emit::EmitterKind;
    use xylem_core::geom::Triangle;
    use xylem_core::node::Tree;

    fn build(config: PlocConfig, triangles: &[Triangle]) -> (PlocModel, Tree) {
        let mut options = BuildOptions::default();
        options.config.emitter = EmitterKind::Ploc(config);
        let (mut memory, layout) = run::load(triangles, &options.config).unwrap();
        let mut model = PlocModel::new(config);
        let mut buffers = Buffers::new(&options.config);
        let count = triangles.len() as u32;
        let job = run::job(&mut memory, &layout, &options, count, &mut buffers, &mut model);
        let (tree, _) = job.unwrap();
        (model, tree)
    }

    /// Far-off pairs of small triangles on the diagonal, in Morton order: a pair's nearest
    /// neighbours are each other.
    fn pairs(count: i32) -> Vec<Triangle> {
        (0..2 * count)
            .map(|i| {
                let at = IVec3::splat((i / 2) * 100_000 + (i % 2) * 1000);
                let vertices = [at, at + IVec3::X, at + IVec3::Y];
                Triangle { vertices, id: i as u32 }
            })
            .collect()
    }

    #[test]
    fn a_pass_takes_exactly_its_beats_and_the_latency() {
        let (model, _) = build(PlocConfig { radius: 1, chain: 1 }, &pairs(8));
        let first = model.passes()[0];
        // 16 clusters enter, one decision lags 2, the end follows the last, and the gate it: the
        // window of 3 decides with the third cluster, so 2 are left to drain.
        assert_eq!((first.clusters, first.beats), (16, 16 + 2 + 1 + 1));
        // At most one node a beat from the sweep, made of two leaves: both ports fit in two cycles,
        // and the last pair drains in one more than the beat.
        assert_eq!(first.nodes, 8);
        assert_eq!(first.leaves, 16);
        assert_eq!(first.distances, 15);
        assert_eq!(first.cycles, 16 * 2 + 4 + first.port_stalls + 6);
        assert_eq!(first.port_stalls, 1);
        let second = model.passes()[1];
        assert_eq!((second.clusters, second.beats), (8, 8 + 2 + 1 + 1));
    }

    #[test]
    fn every_node_and_leaf_is_seen_and_one_more_sweep_adds_its_latency() {
        let triangles = pairs(40);
        for chain in 1..=4 {
            let config = PlocConfig { radius: 2, chain };
            let (model, tree) = build(config, &triangles);
            let sum = |of: fn(&PassCycles) -> u64| model.passes().iter().map(of).sum::<u64>();
            assert_eq!(sum(|p| p.nodes), u64::from(tree.node_count));
            // The root of a tree without nodes would be closed after the last beat.
            assert_eq!(sum(|p| p.leaves), u64::from(tree.leaf_count));
            let doubled = PlocTiming { distance_latency: 12, ..PlocTiming::default() };
            let mut slow = PlocModel::with_timing(config, doubled);
            let mut fast = PlocModel::new(config);
            for model in [&mut slow, &mut fast] {
                model.ploc_pass(1);
                model.ploc_beat();
            }
            assert_eq!(slow.cycles() - fast.cycles(), 6 * u64::from(chain));
        }
    }

    #[test]
    fn utilisation_is_a_share_and_absent_before_the_first_pass() {
        let config = PlocConfig::DEFAULT;
        assert_eq!(PlocModel::new(config).distance_utilisation(), None);
        let (model, _) = build(config, &pairs(80));
        let share = model.distance_utilisation().unwrap();
        assert!(share > 0.0 && share < 1.0, "{share}");
        assert_eq!(PlocModel::window_bytes(&config), 4 * 17 * 44);
    }
}
