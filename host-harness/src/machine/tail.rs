//! What takes the merge's output: the hierarchy emitter in gates' detail, or another emitter by its
//! tape.

use xylem_core::compress::HeldNode;
use xylem_core::emit::EmitterKind;
use xylem_core::error::BuildError;
use xylem_core::node::Tree;
use xylem_core::pipeline::{BuildConfig, BuildRegions, TreeStream};
use xylem_core::probe::Stage;
use xylem_core::sort::Item;
use xylem_core::toplevel::TopLevel;

use super::compress::CompressUnit;
use super::compressor::CompressorEvents;
use super::compressor::unit::CompressorUnit;
use super::emit::{Did, EmitUnit};
use super::player::Player;
use super::port::{Access, LINE_BYTES, PortError};
use super::tape::{OutOfRange, Tape};
use super::toplevel::TopEvents;
use super::writer::Writer;
use crate::bus::Traffic;

/// The end of the builder's pipeline.
#[derive(Debug)]
#[expect(clippy::large_enum_variant, reason = "there is one")]
pub(super) enum Tail<'a> {
    /// The hierarchy emitter, modelled unit by unit.
    Emitter(EmitUnit),
    /// The hierarchy emitter with the streaming compressor, likewise.
    Compress(CompressUnit<'a>),
    /// Any emitter of the core, played from tape.
    Tape(TapeUnit<'a>),
    /// No emitter: whoever watches the sorter.
    Sink(Sink<'a>),
}

/// Takes the sorted stream, cycle by cycle.
pub(super) struct Sink<'a> {
    take: Take<'a>,
    ended: bool,
}

/// What is offered in a cycle, and whether all has left; says whether it takes what is offered.
pub type Take<'a> = &'a mut dyn FnMut(Option<&Item>, bool) -> bool;

impl<'a> Sink<'a> {
    /// A sink that asks `take` in every cycle.
    pub fn new(take: Take<'a>) -> Self {
        Self { take, ended: false }
    }
}

impl std::fmt::Debug for Sink<'_> {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("Sink").field("ended", &self.ended).finish_non_exhaustive()
    }
}

/// The core's emitter with its tape.
#[derive(Debug)]
pub(super) struct TapeUnit<'a> {
    tape: &'a Tape,
    /// The core's, until the input has ended.
    stream: Option<TreeStream<'a>>,
    player: Player,
    scratchpad: Vec<Item>,
    tree: Option<Tree>,
    /// Whether work is the top-level builder's.
    top: bool,
}

/// Write ports of the tail.
pub(super) const PORTS: usize = 2;

impl<'a> Tail<'a> {
    /// Whether there are units for the emitter that `config` asks for.
    pub fn has_units(config: &BuildConfig) -> bool {
        config.emitter == EmitterKind::Lbvh
            && config.top_level == TopLevel::None
            && config.join_leaves == 0
            && config.sharing.is_none()
            && !config.collapse
            && config.compression.as_ref().is_none_or(CompressorUnit::has)
    }

    /// Those units; `held` has room for what the compressor holds.
    pub fn units(config: &BuildConfig, regions: &BuildRegions, held: &'a mut [HeldNode]) -> Self {
        match config.compression {
            None => Self::Emitter(EmitUnit::new(config, regions)),
            Some(compression) => {
                Self::Compress(CompressUnit::new(config, compression, regions, held))
            }
        }
    }

    /// Runs one cycle in which `item` is offered; with `end`, no item follows.
    ///
    /// # Errors
    /// [`BuildError`] of the emitter.
    pub fn tick(
        &mut self,
        item: Option<&Item>,
        end: bool,
        image: &mut [u8],
    ) -> Result<Did, BuildError<PortError>> {
        match self {
            Self::Emitter(unit) => unit.tick(item, end, image),
            Self::Compress(unit) => unit.tick(item, end, image),
            Self::Tape(unit) => unit.tick(item, end, image),
            Self::Sink(sink) => {
                sink.ended |= end;
                let accepted = (sink.take)(item, end) && item.is_some();
                Ok(Did { accepted, worked: accepted })
            }
        }
    }

    /// Whether the tree is done and sent.
    pub fn is_finished(&self) -> bool {
        match self {
            Self::Emitter(unit) => unit.is_finished(),
            Self::Compress(unit) => unit.is_finished(),
            Self::Tape(unit) => unit.tree.is_some() && unit.player.is_done(),
            Self::Sink(sink) => sink.ended,
        }
    }

    /// The tree, when it is finished.
    pub fn tree(&self) -> Option<&Tree> {
        match self {
            Self::Emitter(unit) => unit.tree(),
            Self::Compress(unit) => unit.tree(),
            Self::Tape(unit) => unit.tree.as_ref(),
            Self::Sink(_) => None,
        }
    }

    /// Whether the unit at work is the top-level builder.
    pub fn is_top(&self) -> bool {
        matches!(self, Self::Tape(unit) if unit.top)
    }

    fn writers(&self) -> [Option<&Writer>; PORTS] {
        match self {
            Self::Emitter(unit) => unit.writers().map(Some),
            Self::Compress(unit) => [None, Some(unit.leaf_table())],
            Self::Tape(_) | Self::Sink(_) => [None, None],
        }
    }

    /// The line that a write port offers.
    pub fn offer(&self, port: usize) -> Option<Access> {
        match self {
            Self::Tape(unit) if port == 0 => unit.player.write(),
            Self::Compress(unit) if port == 0 => {
                let line = unit.compressor().write()?;
                let addr = line.addr / LINE_BYTES * LINE_BYTES;
                Some(Access { addr, write: true, tag: 0 })
            }
            _ => self.writers()[port]?.offer(),
        }
    }

    /// Whether a write port is inside a burst.
    pub fn in_burst(&self, port: usize) -> bool {
        // Bursts on tape leave one after the other whatever else there is: only runs compete, and
        // they are written by then.
        self.writers()[port].is_some_and(Writer::in_burst)
    }

    /// The line offered was taken.
    pub fn taken(&mut self, port: usize) {
        match (self, port) {
            (Self::Emitter(unit), _) => unit.taken(port),
            (Self::Compress(unit), 0) => unit.compressor_mut().write_taken(),
            (Self::Compress(unit), _) => unit.leaf_taken(),
            (Self::Tape(unit), _) => unit.player.write_taken(),
            (Self::Sink(_), _) => {}
        }
    }

    /// Ends the cycle of what stands at the memory port.
    ///
    /// # Errors
    /// [`BuildError`] of the compressor.
    pub fn end_cycle(&mut self, image: &mut [u8]) -> Result<(), BuildError<PortError>> {
        match self {
            Self::Emitter(unit) => unit.tick_writers(image),
            Self::Compress(unit) => unit.end_cycle(image)?,
            Self::Tape(_) | Self::Sink(_) => {}
        }
        Ok(())
    }

    /// The line that it wants to read.
    pub fn read(&self) -> Option<u32> {
        match self {
            Self::Emitter(_) | Self::Sink(_) => None,
            Self::Compress(unit) => unit.compressor().read(),
            Self::Tape(unit) => unit.player.read(),
        }
    }

    /// The line offered to read was taken.
    pub fn read_taken(&mut self, addr: u32) {
        match self {
            Self::Emitter(_) | Self::Sink(_) => {}
            Self::Compress(unit) => unit.compressor_mut().read_taken(),
            Self::Tape(unit) => unit.player.read_taken(addr),
        }
    }

    /// A line that it asked for has come.
    pub fn arrive(&mut self, addr: u32) {
        match self {
            Self::Emitter(_) | Self::Sink(_) => {}
            Self::Compress(unit) => unit.compressor_mut().arrive(),
            Self::Tape(unit) => unit.player.arrive(addr),
        }
    }

    /// What the compressor did.
    pub fn compressor_events(&self) -> CompressorEvents {
        match self {
            Self::Emitter(_) | Self::Sink(_) => CompressorEvents::default(),
            Self::Compress(unit) => unit.compressor().events(),
            Self::Tape(unit) => unit.tape.compressor_events(),
        }
    }

    /// What the top-level builder did.
    pub fn top_events(&self) -> TopEvents {
        match self {
            Self::Emitter(_) | Self::Compress(_) | Self::Sink(_) => TopEvents::default(),
            Self::Tape(unit) => unit.tape.top_events(),
        }
    }

    /// Adds its bursts to `traffic`.
    pub fn count(&self, traffic: &mut Traffic) {
        match self {
            Self::Emitter(unit) => unit.writers().iter().for_each(|writer| writer.count(traffic)),
            Self::Compress(unit) => {
                unit.compressor().count(traffic);
                unit.leaf_table().count(traffic);
            }
            Self::Tape(unit) => unit.tape.count(traffic),
            Self::Sink(_) => {}
        }
    }
}

impl<'a> TapeUnit<'a> {
    /// A unit that has seen nothing.
    pub fn new(tape: &'a Tape, stream: TreeStream<'a>, scratchpad: usize, read_ahead: u32) -> Self {
        Self {
            tape,
            stream: Some(stream),
            player: Player::new(read_ahead),
            scratchpad: vec![Item::ZERO; scratchpad],
            tree: None,
            top: false,
        }
    }

    fn tick(
        &mut self,
        item: Option<&Item>,
        end: bool,
        image: &mut [u8],
    ) -> Result<Did, BuildError<PortError>> {
        // The tape's bus is the memory image, whose regions were checked.
        let outside = |error: BuildError<OutOfRange>| error.map_bus(|OutOfRange| PortError::Write);
        let mut accepted = false;
        if self.player.is_idle() {
            let (bus, probe) = (&mut self.tape.bus(image), &mut self.tape.probe());
            if let (Some(item), Some(stream)) = (item, &mut self.stream) {
                stream.accept(bus, item, probe).map_err(outside)?;
                accepted = true;
            } else if end && let Some(stream) = self.stream.take() {
                let tree = stream.finish(bus, &mut self.scratchpad, probe);
                self.tree = Some(tree.map_err(outside)?);
            }
            self.tape.drain(&mut self.player.events);
        }
        let (worked, stage) = self.player.tick();
        self.top |= stage == Some(Stage::TopLevel);
        Ok(Did { accepted, worked: worked || accepted })
    }
}
