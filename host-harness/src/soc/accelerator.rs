//! The accelerator beside the simulated core: the register map in front of the cycle model.
//!
//! Registers behave as `fpga/regs/registers.md` says, locks and commands included. A build runs on the
//! clocked MergeTree when it is started, on a copy of memory; its bytes, counters and status appear when
//! the modelled cycles have passed on the core's clock. Neither side slows the other's memory down.

use xylem_core::mem::Region;
use xylem_regs::{
    Access, COUNTERS_CYCLES_LO, CTRL, Ctrl, ERROR_ADDR, ERROR_INFO, ErrorCode, INT_ENABLE,
    INT_STATUS, JOB_PRIMITIVES, MAP_SIZE, REGISTERS, RESULT_LEAVES, RESULT_NODES, ROOT_HI_X,
    ROOT_LEAF_SIZE, ROOT_LO_X, ROOT_POINTER, RegionId, Register, RegisterInfo, STATUS, Status,
};

use super::jobs::{self, Failure, JobRun, Parameters};
use crate::bus::FlatMemory;
use crate::machine::config::MachineConfig;
use xylem_core::num::MortonWidth;
use xylem_core::pipeline::BuildConfig;
use xylem_core::sort::SortConfig;

/// A named configuration of the accelerator: that of `fpga/rtl/configs.toml`.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct AcceleratorConfig {
    /// Its name.
    pub name: &'static str,
    /// The scratchpad `M`, in records.
    pub capacity: u32,
    /// The burst `B`, in records.
    pub burst: u32,
    /// Insertion sorters.
    pub sorters: u32,
    /// Records of the FIFO behind the merge.
    pub fifo: u32,
    /// Lines of input that are read ahead.
    pub read_ahead: u32,
    /// Bits of the longest Morton code.
    pub code_bits: u32,
}

impl AcceleratorConfig {
    /// For simulation.
    pub const SMALL: Self = Self {
        name: "small",
        capacity: 128,
        burst: 4,
        sorters: 2,
        fifo: 4,
        read_ahead: 8,
        code_bits: 63,
    };

    /// P2's sorter.
    pub const PAPER: Self = Self {
        name: "paper",
        capacity: 8192,
        burst: 16,
        sorters: 8,
        fifo: 16,
        read_ahead: 32,
        code_bits: 63,
    };

    /// All of them.
    pub const ALL: [Self; 2] = [Self::SMALL, Self::PAPER];

    /// The configuration of that name.
    pub fn by_name(name: &str) -> Option<&'static Self> {
        Self::ALL.iter().find(|config| config.name == name)
    }

    /// The cycle model of the builder.
    pub(super) fn machine(&self, morton: MortonWidth, max_leaf_size: u32) -> MachineConfig {
        let (capacity, burst) = (self.capacity, self.burst);
        let sort = SortConfig { capacity, burst, ..SortConfig::PAPER };
        let build = BuildConfig { morton, max_leaf_size, sort, ..BuildConfig::default() };
        MachineConfig {
            sorters: self.sorters,
            fifo: self.fifo,
            read_ahead: self.read_ahead,
            ..MachineConfig::p2(build)
        }
    }
}

/// The accelerator: registers, and the job that runs.
#[derive(Debug)]
pub(super) struct Accelerator {
    config: AcceleratorConfig,
    latency: u32,
    /// What memory's first byte is called on the bus.
    origin: u32,
    words: Vec<u32>,
    running: Option<Running>,
}

/// A job under way: what it will have come to, and when.
#[derive(Debug)]
struct Running {
    since: u64,
    run: JobRun,
}

impl Accelerator {
    /// An idle accelerator whose memory answers after `latency` cycles and starts at `origin`.
    pub fn new(config: AcceleratorConfig, latency: u32, origin: u32) -> Self {
        let mut words = vec![0; MAP_SIZE as usize / 4];
        for register in &REGISTERS {
            words[register.offset as usize / 4] = register.reset;
        }
        let width = config.capacity / (2 * config.burst);
        let capabilities = [
            ("cap.sort", config.capacity | config.burst << 24),
            ("cap.merge", width | 255 << 16),
            ("cap.geometry", 24 | config.code_bits << 8),
            ("cap.features", jobs::FEATURES),
        ];
        for (path, value) in capabilities {
            let register = REGISTERS.iter().find(|register| register.path == path);
            words[register.map_or(0, |register| register.offset as usize / 4)] = value;
        }
        Self { config, latency, origin, words, running: None }
    }

    /// The interrupt line.
    pub fn interrupt(&self) -> bool {
        self.word(INT_STATUS.offset()) & self.word(INT_ENABLE.offset()) != 0
    }

    /// The cycle in which something will happen by itself; `u64::MAX` while idle.
    pub fn due(&self) -> u64 {
        self.running.as_ref().map_or(u64::MAX, |running| running.since + running.run.cycles)
    }

    /// The register at `offset` in cycle `now`; 0 where the map has a hole.
    pub fn read(&self, offset: u32, now: u64) -> u32 {
        let Some(info) = RegisterInfo::at(offset) else { return 0 };
        let word = match &self.running {
            Some(running) if offset == STATUS.offset() => {
                1 | (running.run.stage_at(now - running.since) as u32) << 8
            }
            _ => self.word(offset),
        };
        word & info.readable()
    }

    /// Writes the register at `offset` in cycle `now`, which has no effect where the map has a hole.
    pub fn write(&mut self, offset: u32, value: u32, now: u64, memory: &mut FlatMemory) {
        let Some(info) = RegisterInfo::at(offset) else { return };
        let locked = if self.running.is_some() { info.locked() } else { 0 };
        let kept = info.mask(|access| access == Access::ReadWrite) & !locked;
        let cleared = value & info.mask(|access| access == Access::WriteOneToClear);
        let word = &mut self.words[offset as usize / 4];
        *word = (*word & !kept | value & kept) & !cleared;
        if offset == CTRL.offset() {
            self.command(value, now, memory);
        }
    }

    /// Ends the job if `now` is its time.
    pub fn advance(&mut self, now: u64, memory: &mut FlatMemory) {
        if self.due() > now {
            return;
        }
        let Some(Running { run, .. }) = self.running.take() else { return };
        for (at, bytes) in &run.written {
            memory.bytes_mut()[*at..*at + bytes.len()].copy_from_slice(bytes);
        }
        for (at, count) in (COUNTERS_CYCLES_LO.offset()..).step_by(8).zip(run.counts) {
            let total = u64::from(self.word(at)) | u64::from(self.word(at + 4)) << 32;
            let total = total.wrapping_add(count);
            self.set(at, total as u32);
            self.set(at + 4, (total >> 32) as u32);
        }
        match run.outcome {
            Ok(tree) => {
                if let Some(root) = tree.root {
                    let corners = [(ROOT_LO_X, root.bounds.min), (ROOT_HI_X, root.bounds.max)];
                    for (x, corner) in corners {
                        for (at, value) in (x.offset()..).step_by(4).zip(corner.to_array()) {
                            self.set(at, value as u32);
                        }
                    }
                    let (index, leaf_size) = jobs::pointer(root.child);
                    self.set(ROOT_POINTER.offset(), index);
                    self.set(ROOT_LEAF_SIZE.offset(), leaf_size);
                }
                self.set(RESULT_NODES.offset(), tree.node_count);
                self.set(RESULT_LEAVES.offset(), tree.leaf_count);
                self.end(None);
            }
            Err(failure) => self.end(Some(failure)),
        }
    }

    fn command(&mut self, value: u32, now: u64, memory: &FlatMemory) {
        let is = |command: Ctrl| value & command.bits() != 0;
        if is(Ctrl::RESET.with_soft_reset(true)) {
            // Its outstanding bursts are the model's business, and that has none.
            self.running = None;
            self.forget();
            for at in (COUNTERS_CYCLES_LO.offset()..MAP_SIZE).step_by(4) {
                self.set(at, 0);
            }
        } else if is(Ctrl::RESET.with_abort_job(true)) {
            if let Some(running) = self.running.take() {
                let stage = running.run.stage_at(now - running.since);
                self.end(Some(Failure { stage, ..Failure::of(ErrorCode::Aborted) }));
            }
        } else if is(Ctrl::RESET.with_start(true)) && self.running.is_none() {
            self.forget();
            let run = jobs::run(&self.config, self.latency, &self.parameters(), memory);
            self.running = Some(Running { since: now, run });
        }
    }

    /// Forgets how the last job ended, and what it gave.
    fn forget(&mut self) {
        for at in [STATUS.offset(), ERROR_INFO.offset(), ERROR_ADDR.offset()] {
            self.set(at, 0);
        }
        for at in (RESULT_NODES.offset()..).step_by(4).take(4) {
            self.set(at, 0);
        }
    }

    fn end(&mut self, failure: Option<Failure>) {
        let event = if failure.is_some() { 0b10 } else { 0b01 };
        let status = Status::from_bits(0b010 | u32::from(failure.is_some()) << 2);
        self.set(STATUS.offset(), status.bits());
        self.set(INT_STATUS.offset(), self.word(INT_STATUS.offset()) | event);
        if let Some(Failure { code, stage, region, addr }) = failure {
            let region = region.map_or(0, |id: RegionId| (id as u32) << 16 | 1 << 15);
            self.set(ERROR_INFO.offset(), code as u32 | (stage as u32) << 8 | region);
            self.set(ERROR_ADDR.offset(), addr);
        }
    }

    fn parameters(&self) -> Parameters {
        let region = |id: usize| {
            let at = xylem_regs::REGION_PRIMITIVES_BASE.offset() + 8 * id as u32;
            Region::new(self.word(at), self.word(at + 4))
        };
        Parameters {
            origin: self.origin,
            job: Ctrl::from_bits(self.word(CTRL.offset())).job().ok(),
            primitives: self.word(JOB_PRIMITIVES.offset()),
            format: Register::from_bits(self.word(xylem_regs::JOB_FORMAT.offset())),
            limits: Register::from_bits(self.word(xylem_regs::JOB_LIMITS.offset())),
            regions: std::array::from_fn(region),
        }
    }

    fn word(&self, offset: u32) -> u32 {
        self.words.get(offset as usize / 4).copied().unwrap_or(0)
    }

    fn set(&mut self, offset: u32, value: u32) {
        if let Some(word) = self.words.get_mut(offset as usize / 4) {
            *word = value;
        }
    }
}

#[cfg(test)]
mod tests {
    use std::cell::RefCell;
    use std::convert::Infallible;
    use std::rc::Rc;

    use embedded_hal::delay::DelayNs;
    use embedded_hal::digital::{ErrorType, InputPin};
    use glam::IVec3;
    use xylem_core::geom::{Ray, Triangle};
    use xylem_core::mem::{Bus, ByteAddr};
    use xylem_core::num::{SubGrid, Time};
    use xylem_driver::{JobError, ProbeError, RegisterAccess, WaitError};
    use xylem_firmware::accelerated::{Accelerated, Part};
    use xylem_firmware::accelerator::{self, AcceleratorError};
    use xylem_firmware::job::{self, Buffers, Clock, Finished, NoClock};
    use xylem_firmware::map::EXTERNAL;

    use xylem_regs::Stage;

    use super::*;
    use crate::bus::MemoryError;
    use crate::soc::SceneBlob;
    use crate::soc::host::external_memory;

    /// The accelerator, memory and time, as all that the driver and the job hold.
    #[derive(Clone, Debug)]
    struct Board(Rc<RefCell<Parts>>);

    #[derive(Debug)]
    struct Parts {
        accelerator: Accelerator,
        memory: FlatMemory,
        now: u64,
    }

    impl Parts {
        fn pass(&mut self, cycles: u64) {
            self.now += cycles;
            self.accelerator.advance(self.now, &mut self.memory);
        }
    }

    impl RegisterAccess for Board {
        type Error = Infallible;
        fn read(&mut self, offset: u32) -> Result<u32, Infallible> {
            let mut parts = self.0.borrow_mut();
            parts.pass(1);
            Ok(parts.accelerator.read(offset, parts.now))
        }
        fn write(&mut self, offset: u32, value: u32) -> Result<(), Infallible> {
            let mut parts = self.0.borrow_mut();
            parts.pass(1);
            let Parts { accelerator, memory, now } = &mut *parts;
            accelerator.write(offset, value, *now, memory);
            Ok(())
        }
    }

    impl DelayNs for Board {
        fn delay_ns(&mut self, ns: u32) {
            self.0.borrow_mut().pass(u64::from(ns / 10));
        }
    }

    impl ErrorType for Board {
        type Error = Infallible;
    }

    impl InputPin for Board {
        fn is_high(&mut self) -> Result<bool, Infallible> {
            Ok(self.0.borrow().accelerator.interrupt())
        }
        fn is_low(&mut self) -> Result<bool, Infallible> {
            self.is_high().map(|high| !high)
        }
    }

    impl Clock for Board {
        fn cycles(&mut self) -> u64 {
            self.0.borrow().now
        }
    }

    impl Bus for Board {
        type Error = MemoryError;
        fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
            let at = ByteAddr(addr.0.wrapping_sub(EXTERNAL.base.0));
            self.0.borrow_mut().memory.read(at, buf)
        }
        fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), MemoryError> {
            let at = ByteAddr(addr.0.wrapping_sub(EXTERNAL.base.0));
            self.0.borrow_mut().memory.write(at, bytes)
        }
    }

    fn triangles(count: u32) -> Vec<Triangle> {
        let mut state = 1u64;
        let mut coordinate = || {
            state = state.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
            (state >> 41) as i32 - (1 << 22)
        };
        let mut point = || IVec3::new(coordinate(), coordinate(), coordinate());
        (0..count).map(|id| Triangle { vertices: [0; 3].map(|_| point()), id }).collect()
    }

    /// A board with a scene on which the software has done its job.
    fn board(config: AcceleratorConfig, count: u32) -> (Board, Finished) {
        let origin = IVec3::new(0, 0, -(1 << 22)).to_array().map(SubGrid::from_num);
        let ray = Ray::new(origin, IVec3::Z * (1 << 30), Time::ZERO, Ray::TIME_LIMIT);
        let scene = SceneBlob {
            triangles: triangles(count),
            rays: vec![ray.expect("a ray in range")],
            accelerator: true,
            ..SceneBlob::default()
        };
        let memory = external_memory(&scene.to_bytes(false).expect("a scene that fits"));
        let accelerator = Accelerator::new(config, 10, EXTERNAL.base.0);
        let mut board = Board(Rc::new(RefCell::new(Parts { accelerator, memory, now: 0 })));
        let mut buffers = Box::new(Buffers::new());
        let done = job::run(&mut board, EXTERNAL, &mut buffers, &mut NoClock, &mut |_| {});
        (board, done.expect("a job that ends well"))
    }

    type Ran = Result<Accelerated, AcceleratorError<MemoryError, Infallible, Infallible>>;

    fn accelerate(board: &Board, done: &Finished) -> Ran {
        let parts = (board.clone(), board.clone(), board.clone());
        accelerator::run(&mut board.clone(), done, &mut board.clone(), parts)
    }

    #[test]
    fn the_accelerator_builds_the_software_s_tree_in_both_configurations() {
        for (config, count) in [(AcceleratorConfig::SMALL, 3000), (AcceleratorConfig::PAPER, 3000)]
        {
            let (board, done) = board(config, count);
            let report = accelerate(&board, &done).expect("a job that ends well");
            assert!(report.is_equal(), "{}: {report:?}", config.name);
            assert_eq!(report.outputs, [Some(true), Some(true), None, None], "{}", config.name);
            let build = report.parts[Part::Build as usize].expect("a build");
            let counters = build.counters;
            assert!(counters.cycles > u64::from(count) && counters.cycles <= build.cycles);
            assert_eq!(counters.nodes, u64::from(done.report.nodes), "{}", config.name);
            assert_eq!(counters.leaves, u64::from(done.report.leaves), "{}", config.name);
            assert!(counters.bytes_written >= u64::from(done.report.nodes) * 64);
            assert_eq!(report.parts[Part::Trace as usize], None);
            // The next job starts from the same state.
            let again = accelerate(&board, &done).expect("a job that ends well");
            let counted = again.parts[Part::Build as usize].map(|part| part.counters);
            assert_eq!(counted, Some(counters), "{}", config.name);
        }
    }

    #[test]
    fn a_wrong_byte_of_the_software_s_is_found() {
        let (board, done) = board(AcceleratorConfig::SMALL, 300);
        let nodes = done.layout.build.nodes.base.0 - EXTERNAL.base.0;
        board.0.borrow_mut().memory.bytes_mut()[nodes as usize + 77] ^= 1;
        let report = accelerate(&board, &done).expect("a job that ends well");
        assert_eq!(report.outputs[..2], [Some(true), Some(false)]);
        assert!(!report.is_equal());
    }

    #[test]
    fn another_device_in_its_place_is_not_used() {
        let (board, done) = board(AcceleratorConfig::SMALL, 10);
        board.0.borrow_mut().accelerator.set(xylem_regs::MAGIC.offset(), 0);
        let error = accelerate(&board, &done).expect_err("no accelerator");
        assert_eq!(error, AcceleratorError::Probe(ProbeError::NotFound { found: 0 }));
    }

    #[test]
    fn memory_that_is_too_small_is_refused_before_the_accelerator_starts() {
        let (board, mut done) = board(AcceleratorConfig::SMALL, 10);
        // Boxes, two regions of runs, nodes, leaf table, quantized nodes and a hit, each padded.
        let needed = 3 * 320 + 640 + 64 + 192 + 64;
        done.layout.free.size = needed - 1;
        let error = accelerate(&board, &done).expect_err("too small");
        assert_eq!(error, AcceleratorError::WorkSpace { needed, size: needed - 1 });
        assert_eq!(board.0.borrow().accelerator.read(STATUS.offset(), 0), 0);
        done.layout.free.size = needed;
        assert!(accelerate(&board, &done).is_ok());
    }

    /// Registers of a build of one box at the start of memory.
    fn registers(change: &[(u32, u32)]) -> (JobError, FlatMemory) {
        let (board, _) = board(AcceleratorConfig::SMALL, 1);
        let at = |line: u32| EXTERNAL.base.0 + 64 * line;
        let region = |id: RegionId| xylem_regs::REGION_PRIMITIVES_BASE.offset() + 8 * id as u32;
        let mut words = vec![
            (JOB_PRIMITIVES.offset(), 1),
            (xylem_regs::JOB_LIMITS.offset(), 30 | 255 << 8),
            (INT_ENABLE.offset(), 3),
        ];
        for (line, id) in (1000..).zip(RegionId::ALL) {
            words.extend([(region(id), at(line)), (region(id) + 4, 64)]);
        }
        words.extend(change);
        words.push((CTRL.offset(), 1 | 1 << 8));
        let mut driver = xylem_driver::Xylem::probe(board.clone(), board.clone(), board.clone())
            .expect("an accelerator");
        for (offset, value) in words {
            RegisterAccess::write(&mut board.clone(), offset, value).expect("a register");
        }
        assert!(!board.0.borrow().accelerator.interrupt());
        let error = match driver.wait(xylem_driver::Micros(1000)) {
            Err(WaitError::Job(error)) => error,
            other => panic!("{other:?}"),
        };
        let memory = board.0.borrow().memory.clone();
        (error, memory)
    }

    #[test]
    fn every_wrong_job_ends_in_its_documented_code() {
        let region = |id: RegionId| xylem_regs::REGION_PRIMITIVES_BASE.offset() + 8 * id as u32;
        let size = |id: RegionId| region(id) + 4;
        let bad_config = ErrorCode::BadConfig;
        let nowhere = 0x4000_0000;
        for (change, code, id) in [
            ((JOB_PRIMITIVES.offset(), 0), bad_config, None),
            ((xylem_regs::JOB_FORMAT.offset(), 1), bad_config, None),
            ((xylem_regs::JOB_LIMITS.offset(), 31 | 255 << 8), bad_config, None),
            (
                (region(RegionId::RunsA), EXTERNAL.base.0 + 64 * 1000),
                bad_config,
                Some(RegionId::RunsA),
            ),
            ((size(RegionId::Hits), 1 << 31), bad_config, Some(RegionId::Hits)),
            ((size(RegionId::Primitives), 0), ErrorCode::OutOfRegion, Some(RegionId::Primitives)),
            ((size(RegionId::RunsA), 0), ErrorCode::RegionFull, Some(RegionId::RunsA)),
            ((size(RegionId::LeafTable), 0), ErrorCode::RegionFull, Some(RegionId::LeafTable)),
            ((region(RegionId::Primitives), nowhere), ErrorCode::BusRead, None),
            ((region(RegionId::Nodes), nowhere), ErrorCode::BusWrite, None),
        ] {
            let (error, _) = registers(&[change]);
            assert_eq!((error.code, error.region), (code, id), "{change:x?}: {error}");
        }
    }

    #[test]
    fn a_box_off_the_grid_is_a_bad_primitive() {
        // The box of line 1000 is 0; lower its corner below the grid in the scene's place instead.
        let (board, done) = board(AcceleratorConfig::SMALL, 40);
        let first = done.blob.triangles.base.0 - EXTERNAL.base.0;
        let off = (1i32 << 23).to_le_bytes();
        board.0.borrow_mut().memory.bytes_mut()[first as usize..][..4].copy_from_slice(&off);
        let error = accelerate(&board, &done).expect_err("a triangle off the grid");
        assert!(matches!(error, AcceleratorError::Triangle(_)), "{error:?}");
        let origin = EXTERNAL.base.0 + 64;
        let primitives = xylem_regs::REGION_PRIMITIVES_BASE.offset();
        // The blob's own words are no boxes.
        let (error, _) = registers(&[(primitives, origin - 64)]);
        assert_eq!((error.code, error.stage), (ErrorCode::BadPrimitive, Stage::Sort));
        assert_eq!(error.addr, ByteAddr(origin - 64));
    }

    #[test]
    fn registers_of_a_job_are_locked_while_it_runs_and_an_abort_ends_it() {
        let (board, _) = board(AcceleratorConfig::SMALL, 10);
        let mut parts = board.0.borrow_mut();
        let Parts { accelerator, memory, .. } = &mut *parts;
        let mut write = |accelerator: &mut Accelerator, offset, value| {
            accelerator.write(offset, value, 5, memory);
        };
        write(accelerator, JOB_PRIMITIVES.offset(), 7);
        write(accelerator, CTRL.offset(), 1 | 1 << 8);
        assert_eq!(accelerator.read(STATUS.offset(), 6) & 1, 1);
        write(accelerator, JOB_PRIMITIVES.offset(), 9);
        write(accelerator, CTRL.offset(), 4 << 8);
        assert_eq!(accelerator.read(JOB_PRIMITIVES.offset(), 6), 7);
        assert_eq!(accelerator.read(CTRL.offset(), 6), 1 << 8);
        write(accelerator, CTRL.offset(), 2 | 1 << 8);
        assert_eq!(accelerator.read(STATUS.offset(), 6), 0b110);
        assert_eq!(accelerator.read(ERROR_INFO.offset(), 6) & 0xff, ErrorCode::Aborted as u32);
        assert_eq!((accelerator.due(), accelerator.read(INT_STATUS.offset(), 6)), (u64::MAX, 0b10));
        write(accelerator, INT_STATUS.offset(), 0b10);
        write(accelerator, CTRL.offset(), 4);
        assert_eq!(accelerator.read(STATUS.offset(), 6), 0);
        assert_eq!(accelerator.read(JOB_PRIMITIVES.offset(), 6), 7);
    }
}
