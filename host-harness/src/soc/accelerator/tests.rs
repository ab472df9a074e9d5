//! Driver and job on the simulated accelerator.

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

mod jobs;

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

/// A scene whose quantized nodes are made as the accelerator does.
fn scene(config: &AcceleratorConfig, count: u32) -> SceneBlob {
    let one = |i: i32| {
        let origin = IVec3::new(i << 18, 0, -(1 << 22)).to_array().map(SubGrid::from_num);
        Ray::new(origin, IVec3::Z * (1 << 30), Time::ZERO, Ray::TIME_LIMIT)
    };
    SceneBlob {
        triangles: triangles(count),
        rays: (-5..6).map(|i| one(i).expect("a ray in range")).collect(),
        treelet_depth: config.treelet_depth,
        accelerator: true,
        ..SceneBlob::default()
    }
}

/// A board with a scene on which the software has done its job.
fn board(config: AcceleratorConfig, count: u32) -> (Board, Finished) {
    board_of(config, &scene(&config, count))
}

fn board_of(config: AcceleratorConfig, scene: &SceneBlob) -> (Board, Finished) {
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
    for (config, count) in [(AcceleratorConfig::SMALL, 3000), (AcceleratorConfig::PAPER, 3000)] {
        let (board, done) = board(config, count);
        let report = accelerate(&board, &done).expect("a job that ends well");
        assert!(report.is_equal(), "{}: {report:?}", config.name);
        assert_eq!(report.outputs, [Some(true); 4], "{}", config.name);
        let build = report.parts[Part::Build as usize].expect("a build");
        let counters = build.counters;
        assert!(counters.cycles > u64::from(count) && counters.cycles <= build.cycles);
        assert_eq!(counters.nodes, u64::from(done.report.nodes), "{}", config.name);
        assert_eq!(counters.leaves, u64::from(done.report.leaves), "{}", config.name);
        assert!(counters.bytes_written >= u64::from(done.report.nodes) * 64);
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
    // Boxes, two regions of runs, nodes, two leaf tables, quantized nodes and hits, each padded.
    let needed = 3 * 320 + 640 + 2 * 64 + 192 + 320;
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
        ((xylem_regs::JOB_FORMAT.offset(), 2), bad_config, None),
        ((xylem_regs::JOB_LIMITS.offset(), 31 | 255 << 8), bad_config, None),
        ((region(RegionId::RunsA), EXTERNAL.base.0 + 64 * 1000), bad_config, Some(RegionId::RunsA)),
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
fn a_primitive_off_the_grid_is_a_bad_one() {
    let (board, done) = board(AcceleratorConfig::SMALL, 40);
    let first = done.blob.triangles.base.0 - EXTERNAL.base.0;
    let off = (1i32 << 23).to_le_bytes();
    board.0.borrow_mut().memory.bytes_mut()[first as usize..][..4].copy_from_slice(&off);
    let error = accelerate(&board, &done).expect_err("a triangle off the grid");
    let AcceleratorError::Wait { error: WaitError::Job(error), .. } = error else {
        panic!("{error:?}")
    };
    assert_eq!((error.code, error.addr), (ErrorCode::BadPrimitive, done.blob.triangles.base));
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
