//! Passes of the clustering emitter over memory: the first from the merge, the others from lists.

use super::nodes::NodePort;
use super::{BuildConfig, BuildRegions};
use crate::compress::HeldNode;
use crate::emit::{Chain, Cluster, PlocConfig, Port, Token, list_bound};
use crate::error::{BuildError, RegionName};
use crate::geom::PrimIndex;
use crate::mem::{BurstWriter, Bus, Region};
use crate::node::{Bvh2Node, LeafEntry, NodeIndex, Tree};
use crate::num::Grid;
use crate::probe::{Probe, Stage};
use crate::sort::{Item, MAX_BURST, RecordFormat};

/// Bytes of a cluster in a list: the sorter's 32-byte record with another meaning.
pub(super) const CLUSTER_BYTES: u32 = 32;

/// How many bytes the list that the first pass over `count` primitives leaves can take.
pub(super) const fn list_bytes(count: u32) -> u64 {
    list_bound(count) as u64 * CLUSTER_BYTES as u64
}

/// The clustering emitter with its write ports.
#[derive(Debug)]
pub(super) struct PlocWriter<'a> {
    chain: Chain,
    outputs: Outputs<'a>,
    lists: Lists,
    grid: Grid,
}

/// Where lists of clusters are in memory.
#[derive(Clone, Copy, Debug)]
struct Lists {
    region: Region,
    name: RegionName,
    /// Records in a burst.
    burst: u32,
}

impl Lists {
    const fn writer(&self) -> BurstWriter {
        let bytes = (self.burst * CLUSTER_BYTES) as usize;
        BurstWriter::new(self.region, self.name, Stage::Emit, bytes)
    }
}

/// What has been written.
#[derive(Debug)]
struct Outputs<'a> {
    nodes: NodePort<'a>,
    leaf_table: BurstWriter,
    tree: Tree,
    list: BurstWriter,
    /// The list goes to the scratchpad instead.
    on_chip: bool,
    /// Clusters in the list so far, and the last of them.
    clusters: u32,
    last: Option<Cluster>,
}

impl<'a> PlocWriter<'a> {
    /// A writer that keeps its lists in `lists`, over `count` primitives to come.
    pub fn new<P: Probe>(
        config: &BuildConfig,
        ploc: &PlocConfig,
        regions: &BuildRegions,
        lists: (Region, RegionName),
        count: u32,
        held: &'a mut [HeldNode],
        probe: &mut P,
    ) -> Self {
        let port =
            |region, name| BurstWriter::new(region, name, Stage::Emit, config.write_burst as usize);
        let lists = Lists { region: lists.0, name: lists.1, burst: config.sort.burst };
        let mut chain = Chain::new(ploc, config.max_leaf_size);
        chain.start(count, probe);
        Self {
            chain,
            outputs: Outputs {
                nodes: NodePort::new(config, regions, held, &mut []),
                leaf_table: port(regions.leaf_table, RegionName::LeafTable),
                tree: Tree::empty(config.format(), regions.nodes, regions.leaf_table),
                list: lists.writer(),
                on_chip: false,
                clusters: 0,
                last: None,
            },
            lists,
            grid: config.grid,
        }
    }

    /// Takes the next primitive in order.
    #[inline]
    pub fn accept<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        item: &Item,
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        probe.stage(Stage::Emit);
        let token = Token::Cluster(Cluster::of_primitive(item));
        self.chain.beat(token, &mut self.outputs.port(bus, &mut []), probe)?;
        probe.stage(Stage::Merge);
        Ok(())
    }

    /// Ends the first pass and does the others; lists that fit `scratchpad` stay in it.
    pub fn finish<B: Bus, P: Probe>(
        mut self,
        bus: &mut B,
        scratchpad: &mut [Item],
        probe: &mut P,
    ) -> Result<Tree, BuildError<B::Error>> {
        probe.stage(Stage::Emit);
        self.drain(bus, scratchpad, probe)?;
        while self.outputs.clusters > 1 {
            let clusters = core::mem::take(&mut self.outputs.clusters);
            self.chain.start(clusters, probe);
            let was_on_chip = self.outputs.on_chip;
            self.outputs.on_chip = list_bound(clusters) as usize <= scratchpad.len();
            // The list is written over the one that is read, never ahead of it.
            self.outputs.list = self.lists.writer();
            if was_on_chip {
                self.read_scratchpad(bus, clusters, scratchpad, probe)?;
            } else {
                self.read_memory(bus, clusters, scratchpad, probe)?;
            }
            self.drain(bus, scratchpad, probe)?;
        }
        if let Some(root) = self.outputs.last {
            let root = root.close(&mut self.outputs.port(bus, scratchpad), probe)?;
            self.outputs.tree.root = Some(root);
        }
        let Outputs { nodes, mut leaf_table, mut tree, .. } = self.outputs;
        nodes.finish(bus, &mut tree, probe)?;
        leaf_table.flush(bus)?;
        Ok(tree)
    }

    fn read_scratchpad<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        clusters: u32,
        scratchpad: &mut [Item],
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        for index in 0..clusters {
            let record = *scratchpad.get(index as usize).ok_or(BuildError::Internal)?;
            self.feed(bus, index, &record, scratchpad, probe)?;
        }
        Ok(())
    }

    fn read_memory<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        clusters: u32,
        scratchpad: &mut [Item],
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let mut buffer = [0; MAX_BURST * CLUSTER_BYTES as usize];
        for first in (0..clusters).step_by(self.lists.burst as usize) {
            let len = self.lists.burst.min(clusters - first) * CLUSTER_BYTES;
            let bytes = &mut buffer[..len as usize];
            let addr = self.lists.region.at(first * CLUSTER_BYTES, len);
            let addr = addr.ok_or(BuildError::Internal)?;
            let failed = |error| BuildError::Bus { stage: Stage::Emit, addr, error };
            bus.read(addr, bytes).map_err(failed)?;
            for (index, record) in (first..).zip(bytes.chunks_exact(CLUSTER_BYTES as usize)) {
                self.feed(bus, index, &RecordFormat::decode_cluster(record), scratchpad, probe)?;
            }
        }
        Ok(())
    }

    /// Feeds one record of a list to the chain.
    fn feed<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        index: u32,
        record: &Item,
        scratchpad: &mut [Item],
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let cluster = Cluster::from_record(record, &self.grid);
        let cluster = cluster.ok_or(BuildError::CorruptCluster { index })?;
        let port = &mut self.outputs.port(bus, scratchpad);
        self.chain.beat(Token::Cluster(cluster), port, probe).map(|_| ())
    }

    /// Ends the list and empties the chain.
    fn drain<B: Bus, P: Probe>(
        &mut self,
        bus: &mut B,
        scratchpad: &mut [Item],
        probe: &mut P,
    ) -> Result<(), BuildError<B::Error>> {
        let mut token = Token::End;
        while !self.chain.beat(token, &mut self.outputs.port(bus, scratchpad), probe)? {
            token = Token::Bubble;
        }
        self.outputs.list.flush(bus)
    }
}

impl<'o> Outputs<'o> {
    const fn port<'a, B>(
        &'a mut self,
        bus: &'a mut B,
        scratchpad: &'a mut [Item],
    ) -> OutputPort<'a, 'o, B> {
        OutputPort { outputs: self, bus, scratchpad }
    }
}

/// The outputs with the memories that they go to.
struct OutputPort<'a, 'o, B> {
    outputs: &'a mut Outputs<'o>,
    bus: &'a mut B,
    scratchpad: &'a mut [Item],
}

impl<B: Bus> Port for OutputPort<'_, '_, B> {
    type Error = BuildError<B::Error>;

    #[inline]
    fn leaf(&mut self, references: &[u32]) -> Result<u32, Self::Error> {
        let Outputs { leaf_table, tree, .. } = &mut *self.outputs;
        let first = tree.entry_count;
        for (i, &reference) in references.iter().enumerate() {
            let last = i + 1 == references.len();
            let entry = LeafEntry { primitive: PrimIndex(reference), last };
            leaf_table.push(self.bus, &entry.to_bytes())?;
            tree.entry_count += 1;
        }
        tree.leaf_count += 1;
        Ok(first)
    }

    #[inline]
    fn node<P: Probe>(&mut self, node: &Bvh2Node, probe: &mut P) -> Result<NodeIndex, Self::Error> {
        let Outputs { nodes, tree, .. } = &mut *self.outputs;
        let index = nodes.push(self.bus, node, probe)?;
        tree.node_count += 1;
        Ok(index)
    }

    #[inline]
    fn cluster(&mut self, cluster: &Cluster) -> Result<(), Self::Error> {
        let record = cluster.to_record().ok_or(BuildError::Internal)?;
        if self.outputs.on_chip {
            let place = self.scratchpad.get_mut(self.outputs.clusters as usize);
            *place.ok_or(BuildError::Internal)? = record;
        } else {
            RecordFormat::encode_cluster(&record, self.outputs.list.reserve(self.bus)?);
        }
        self.outputs.clusters += 1;
        self.outputs.last = Some(*cluster);
        Ok(())
    }
}
