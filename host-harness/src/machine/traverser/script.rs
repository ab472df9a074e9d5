//! What the unit does for a ray, step by step, from what the core reports while it traces it.
//!
//! | what            | cycles, after its words have been taken                                       |
//! |-----------------|-------------------------------------------------------------------------------|
//! | ray             | 5 words, 1, the longest of its reciprocals'                                   |
//! | root            | 6 axes and 5 behind them for the verdict                                      |
//! | quantized pair  | 1 word, 6 axes, 5                                                             |
//! | 64-byte node    | 1 word, 7 for the others with 6 axes among them, 5                            |
//! | pop             | 2; 1 if nothing waits                                                         |
//! | leaf entry      | 1 word, 1 to look at it, 5 words of the triangle, 1                           |
//! | triangle test   | 20 if the line misses it, 63 outside of the interval, 129 for a hit           |
//! | hit record      | 3 words, and one cycle or more for each full line                             |

use std::cell::RefCell;
use std::collections::VecDeque;

use xylem_core::geom::{Aabb, Ray, Triangle};
use xylem_core::mem::{Bus, ByteAddr};
use xylem_core::node::LeafEntry;
use xylem_core::probe::Probe;
use xylem_core::traverse::{self, Hit, Query, TraceError};

use super::{TraverserConfig, TraverserError, TraverserJob};
use crate::bus::{FlatMemory, MemoryError};

/// A part of the unit's work.
#[derive(Clone, Copy, Debug)]
pub enum Step {
    /// Takes the word at an address.
    Word {
        /// The address.
        addr: u32,
        /// What it is of; of a node, the first.
        of: Records,
    },
    /// Takes some cycles; box tests end in those of them that `tests` names, counted from 1.
    Wait {
        /// How many.
        cycles: u32,
        /// Where box tests end; 0 is nowhere.
        tests: [u32; 2],
    },
    /// Tests a triangle.
    Triangle {
        /// How long it takes.
        cycles: u32,
    },
    /// Writes a record.
    Record(Option<Hit>),
    /// Writes what is left and ends the job.
    Flush {
        /// Why, if not because all is done.
        error: Option<TraverserError>,
    },
}

/// What memory is read for.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Records {
    /// Rays.
    Rays,
    /// Nodes.
    Nodes,
    /// Leaf table entries.
    Entries,
    /// Triangles.
    Triangles,
}

/// Steps that are still to be done.
#[derive(Clone, Debug, Default)]
pub struct Script(VecDeque<Step>);

impl Script {
    /// The step at hand.
    pub fn first(&self) -> Option<Step> {
        self.0.front().copied()
    }

    /// The step at hand is done.
    pub fn pop(&mut self) {
        self.0.pop_front();
    }

    /// Adds a step.
    pub fn push(&mut self, step: Step) {
        self.0.push_back(step);
    }

    fn wait(&mut self, cycles: u32) {
        self.push(Step::Wait { cycles, tests: [0; 2] });
    }

    fn words(&mut self, of: Records, addr: u32, count: u32) {
        for word in 0..count {
            self.push(Step::Word { addr: addr.wrapping_add(8 * word), of });
        }
    }

    /// Adds what is done for the ray `index` at `addr`.
    pub fn trace(
        &mut self,
        config: &TraverserConfig,
        memory: &FlatMemory,
        job: &TraverserJob,
        (index, addr): (u32, u32),
    ) {
        self.words(Records::Rays, addr, 5);
        self.wait(1);
        let result = self.search(config, memory, job, (index, addr));
        self.push(match result {
            Ok(hit) => Step::Record(hit),
            Err(error) => Step::Flush { error: Some(error) },
        });
    }

    fn search(
        &mut self,
        config: &TraverserConfig,
        memory: &FlatMemory,
        job: &TraverserJob,
        (index, addr): (u32, u32),
    ) -> Result<Option<Hit>, TraverserError> {
        let mut bytes = [0; Ray::BYTES];
        memory.snapshot().read(ByteAddr(addr), &mut bytes).map_err(|_| TraverserError::Regions)?;
        let Ok(ray) = Ray::from_bytes(&bytes) else {
            self.wait(1);
            return Err(TraverserError::BadRay(index));
        };
        let log = RefCell::new(Log::default());
        let mut bus = Recorder { memory, log: &log };
        let result = traverse::trace(&mut bus, &job.scene, &ray, job.query, &mut Listener(&log));
        let events = log.into_inner().0;
        if events.is_empty() {
            self.wait(1); // An empty interval.
            return Ok(None);
        }
        self.wait(reciprocal_cycles(&ray));
        self.push(Step::Wait { cycles: 11, tests: [8, 0] });
        self.replay(config, job, &ray, &events)?;
        self.end(job, &events, result)
    }

    /// Adds the steps of all events but what ended the search.
    fn replay(
        &mut self,
        config: &TraverserConfig,
        job: &TraverserJob,
        ray: &Ray,
        events: &[Event],
    ) -> Result<(), TraverserError> {
        let nodes = job.scene.tree.nodes.base.0;
        let stride = job.scene.tree.format.bytes();
        // The level of the node at hand and of those that wait.
        let mut level = 0;
        let mut waiting = Vec::new();
        for (i, event) in events.iter().enumerate() {
            match *event {
                Event::Tested | Event::Best => {}
                Event::Push => waiting.push(level),
                Event::Pop => {
                    self.wait(2);
                    level = waiting.pop().unwrap_or(0);
                }
                Event::Node(addr) => {
                    if level == config.depth {
                        self.wait(1);
                        return Err(TraverserError::CorruptNode((addr - nodes) / stride));
                    }
                    level += 1;
                    self.push(Step::Word { addr, of: Records::Nodes });
                    self.push(if stride == 64 {
                        Step::Wait { cycles: 12, tests: [9, 12] }
                    } else {
                        Step::Wait { cycles: 11, tests: [8, 11] }
                    });
                }
                Event::Entry(addr) => {
                    self.words(Records::Entries, addr & !7, 1);
                    self.wait(1);
                }
                Event::Triangle(addr, triangle) => {
                    self.words(Records::Triangles, addr, 5);
                    self.wait(1);
                    let hit = events.get(i + 2) == Some(&Event::Best);
                    if events.get(i + 1) == Some(&Event::Tested) {
                        let cycles = match triangle.crossing(ray) {
                            _ if hit => 129,
                            Some(_) => 63,
                            None => 20,
                        };
                        self.push(Step::Triangle { cycles });
                    }
                }
            }
        }
        Ok(())
    }

    /// Adds the steps of what ended the search, and says what came of it.
    fn end(
        &mut self,
        job: &TraverserJob,
        events: &[Event],
        result: Result<Option<Hit>, TraceError<MemoryError>>,
    ) -> Result<Option<Hit>, TraverserError> {
        let tree = &job.scene.tree;
        let node =
            |index: u32| tree.nodes.base.0.wrapping_add(index.wrapping_mul(tree.format.bytes()));
        match result {
            Ok(hit) => {
                // It ends where nothing waits, but not at the root's box or with the first of any hits.
                let passed = events.len() > 1;
                if passed && !(job.query == Query::Any && hit.is_some()) {
                    self.wait(1);
                }
                Ok(hit)
            }
            Err(TraceError::CorruptNode { index }) => {
                // Its own boxes are wrong, or it is not even read, unless it is the root's box that is.
                let read = events.last() == Some(&Event::Node(node(index)));
                if !read && !root_is_inverted(job) {
                    self.wait(1);
                }
                Err(TraverserError::CorruptNode(index))
            }
            Err(TraceError::CorruptLeaf { entry }) => {
                // It names no triangle, or it is not even read.
                if !matches!(events.last(), Some(Event::Entry(_))) {
                    self.wait(1);
                }
                Err(TraverserError::CorruptLeaf(entry))
            }
            Err(TraceError::CorruptTriangle { primitive }) => {
                self.wait(1);
                Err(TraverserError::CorruptTriangle(primitive.0))
            }
            Err(_) => Err(TraverserError::Regions),
        }
    }
}

/// Whether the root's box ends before it begins, which only a quantized tree's root must not.
fn root_is_inverted(job: &TraverserJob) -> bool {
    let quantized = job.scene.tree.format.bytes() != 64;
    quantized && job.scene.tree.root.is_some_and(|root| !root.bounds.is_valid())
}

/// Cycles for the root's grid: two, and one for each doubling of the cells of its coarsest axis.
pub fn root_cycles(bounds: Option<&Aabb>) -> u32 {
    let doublings = |axis: usize| {
        let spans = |bounds: &Aabb, scale: u32| {
            (0..64).contains(&((bounds.max[axis] >> scale) - (bounds.min[axis] >> scale)))
        };
        (0..18).find(|&scale| bounds.is_none_or(|bounds| spans(bounds, scale))).unwrap_or(18)
    };
    2 + (0..3).map(doublings).max().unwrap_or(0)
}

/// Cycles from the start of a ray's three reciprocals to the last one's end: a quotient bit a cycle, without
/// most of those that are zero for sure (`xy_reciprocal`).
fn reciprocal_cycles(ray: &Ray) -> u32 {
    let cycles = |component: i32| {
        let magnitude = component.unsigned_abs();
        if magnitude == 0 {
            return 1;
        }
        let k = u32::BITS - (magnitude - 1).leading_zeros();
        // Before the step that begins with the power 2^s, shifted in by one so that s = -1 is none.
        let skipped =
            [28, 20, 12, 4].into_iter().find(|s| magnitude >= 2 << s).map_or(0, |s| s + 1);
        k + 25 - skipped
    };
    ray.direction().to_array().map(cycles).into_iter().max().unwrap_or(1)
}

/// What the core does for a ray, in order.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
enum Event {
    /// A box or a triangle was tested.
    Tested,
    Push,
    Pop,
    Node(u32),
    Entry(u32),
    Triangle(u32, Triangle),
    /// The triangle was hit.
    Best,
}

#[derive(Debug, Default)]
struct Log(Vec<Event>);

/// Memory that takes down what is read, there or not: whoever asks for a line that is not there hears of it
/// from the port.
struct Recorder<'a> {
    memory: &'a FlatMemory,
    log: &'a RefCell<Log>,
}

impl Bus for Recorder<'_> {
    type Error = MemoryError;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
        let result = self.memory.snapshot().read(addr, buf);
        let event = match buf.len() {
            LeafEntry::BYTES => Event::Entry(addr.0),
            Triangle::BYTES => {
                let mut bytes = [0; Triangle::BYTES];
                bytes.copy_from_slice(buf);
                Event::Triangle(addr.0, Triangle::from_bytes(&bytes))
            }
            _ => Event::Node(addr.0),
        };
        self.log.borrow_mut().0.push(event);
        result
    }

    fn write(&mut self, addr: ByteAddr, _: &[u8]) -> Result<(), MemoryError> {
        Err(MemoryError::ReadOnly { addr })
    }
}

struct Listener<'a>(&'a RefCell<Log>);

impl Listener<'_> {
    fn note(&self, event: Event) {
        self.0.borrow_mut().0.push(event);
    }
}

impl Probe for Listener<'_> {
    fn box_test(&mut self) {
        self.note(Event::Tested);
    }
    fn triangle_test(&mut self) {
        self.note(Event::Tested);
    }
    fn best_hit(&mut self) {
        self.note(Event::Best);
    }
    fn stack_push(&mut self, _: usize) {
        self.note(Event::Push);
    }
    fn stack_pop(&mut self) {
        self.note(Event::Pop);
    }
}
