//! A build on the clock beside the core's, in memories that start equal.

use xylem::bus::FlatMemory;
use xylem::machine::config::MachineConfig;
use xylem::machine::mergetree::{self, MachineError, MachineRun};
use xylem::machine::port::Port;
use xylem::run::{self, Buffers, Layout};
use xylem_core::geom::Triangle;
use xylem_core::node::Tree;
use xylem_core::pipeline;

/// A scene in memory and the tree that the core builds over it.
#[derive(Debug)]
pub struct Expected {
    /// The machine.
    pub config: MachineConfig,
    /// Where things are.
    pub layout: Layout,
    /// Primitives.
    pub count: u32,
    /// Memory with the input in it and nothing else.
    pub input: FlatMemory,
    /// Memory after the core's build.
    pub output: FlatMemory,
    /// The core's tree.
    pub tree: Tree,
}

impl Expected {
    /// Builds with the core.
    ///
    /// # Panics
    /// If the core refuses the scene.
    pub fn new(triangles: &[Triangle], config: MachineConfig) -> Self {
        let runs = config.runs();
        let (input, layout) = run::load(triangles, &runs).unwrap_or_else(|e| panic!("{e}"));
        let mut output = input.clone();
        let mut buffers = Buffers::new(&runs);
        let count = triangles.len() as u32;
        let (mut workspace, mut storage) = buffers.parts();
        let (bus, regions) = (&mut output, &layout.build);
        let (workspace, storage) = (&mut workspace, &mut storage);
        let tree = pipeline::build_with(bus, &runs, regions, count, workspace, storage, &mut ());
        let tree = tree.unwrap_or_else(|e| panic!("{e}"));
        Self { config, layout, count, input, output, tree }
    }

    /// Builds on the clock.
    ///
    /// # Errors
    /// The machine's.
    pub fn run<P: Port>(&self, port: &mut P) -> Result<(MachineRun, FlatMemory), MachineError> {
        let mut memory = self.input.clone();
        let run =
            mergetree::build(&self.config, &mut memory, &self.layout.build, self.count, port)?;
        Ok((run, memory))
    }

    /// Builds on the clock and compares: the descriptor, nodes and leaf table; and the runs, where
    /// they are as long as the core's.
    ///
    /// # Panics
    /// If anything differs, or the machine fails.
    pub fn assert_same<P: Port>(&self, what: &str, port: &mut P) -> MachineRun {
        let (run, memory) = self.run(port).unwrap_or_else(|e| panic!("{what}: {e}"));
        assert_eq!(run.tree, self.tree, "{what}: descriptor");
        let regions = &self.layout.build;
        let mut compared = vec![("nodes", regions.nodes), ("leaf table", regions.leaf_table)];
        if !self.config.overlap {
            compared.extend([("runs A", regions.runs_a), ("runs B", regions.runs_b)]);
        }
        for (name, region) in compared {
            assert!(memory.region(region) == self.output.region(region), "{what}: {name}");
        }
        run
    }
}
