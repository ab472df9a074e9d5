//! BVH building, streaming compression and ray traversal in fixed point, for hardware and for the
//! soft core beside it.
//!
//! This crate states *what* is computed, once: the host harness, the firmware, the cycle models and
//! the RTL all answer to it. It has no clock, no allocation, no floating point and no unsafe code,
//! and gives the same bits on every machine.
//!
//! # Layers
//!
//! - [`num`] and [`geom`]: the integer grid, reciprocals, boxes, rays and the exact triangle test.
//! - [`mem`], [`probe`], [`error`]: the one road to external memory, micro-events for whoever
//!   watches, and what can go wrong.
//! - [`sort`] and [`emit`]: the external merge sort and the hierarchy emitter. Hardware units mirror
//!   their parts one to one.
//! - [`toplevel`]: builders of the top of a tree over what the emitter leaves there.
//! - [`node`] and [`compress`]: byte formats of trees, and how a tree becomes a quantized one.
//! - [`refit`]: new boxes for a tree whose triangles have moved, and when to build it anew.
//! - [`traverse`]: rays through a tree of any format.
//! - [`pipeline`] and [`quality`]: whole builds, and whether and how good a tree came out. Firmware
//!   and harness start here.
//!
//! # Example
//!
//! Four triangles are built into a tree and a ray is traced through it:
//!
//! ```
//! use xylem_core::geom::{Ray, Triangle};
//! use xylem_core::mem::{Bus, ByteAddr, Region};
//! use xylem_core::num::{SubGrid, Time};
//! use xylem_core::pipeline::{BuildConfig, BuildRegions, build};
//! use xylem_core::sort::{InputFormat, SortBuffers, SortConfig};
//! use xylem_core::traverse::{Query, Scene, trace};
//!
//! struct Memory([u8; 4096]);
//!
//! impl Bus for Memory {
//!     type Error = ();
//!     fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), ()> {
//!         let at = addr.0 as usize;
//!         buf.copy_from_slice(self.0.get(at..at + buf.len()).ok_or(())?);
//!         Ok(())
//!     }
//!     fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), ()> {
//!         let at = addr.0 as usize;
//!         self.0.get_mut(at..at + bytes.len()).ok_or(())?.copy_from_slice(bytes);
//!         Ok(())
//!     }
//! }
//!
//! let mut memory = Memory([0; 4096]);
//! for i in 0..4 {
//!     // Triangles across the x axis, at x = 1000, 2000, 3000 and 4000 grid units.
//!     let x = 1000 * (i + 1);
//!     let vertices = [[x, -50, -50], [x, 100, 0], [x, 0, 100]].map(Into::into);
//!     let triangle = Triangle { vertices, id: i as u32 };
//!     memory.write(ByteAddr(40 * i as u32), &triangle.to_bytes())?;
//! }
//! let regions = BuildRegions {
//!     primitives: Region::new(0, 160),
//!     runs_a: Region::new(1024, 1024),
//!     runs_b: Region::default(),
//!     nodes: Region::new(2048, 1024),
//!     leaf_table: Region::new(3072, 1024),
//! };
//! let config = BuildConfig {
//!     input: InputFormat::Triangle40,
//!     sort: SortConfig { capacity: 64, burst: 4, ..SortConfig::PAPER },
//!     ..BuildConfig::default()
//! };
//! let mut buffers = SortBuffers::<64, 8>::new();
//! let tree = build(&mut memory, &config, &regions, 4, &mut buffers.workspace(), &mut ()).unwrap();
//! let scene = Scene { tree, triangles: regions.primitives, triangle_count: 4 };
//!
//! let origin = [SubGrid::from_num(10_000), SubGrid::ZERO, SubGrid::ZERO];
//! let ray = Ray::new(origin, [-(1 << 30), 0, 0].into(), Time::ZERO, Ray::TIME_LIMIT).unwrap();
//! let hit = trace(&mut memory, &scene, &ray, Query::Closest, &mut ()).unwrap().unwrap();
//! assert_eq!((hit.primitive.0, hit.t), (3, Time::from_num(6000)));
//! # Ok::<(), ()>(())
//! ```
#![no_std]
#![forbid(unsafe_code)]

pub mod compress;
pub mod emit;
pub mod error;
pub mod geom;
pub mod mem;
pub mod node;
pub mod num;
pub mod pipeline;
pub mod probe;
pub mod quality;
pub mod refit;
pub mod sort;
#[cfg(test)]
mod testing;
pub mod toplevel;
pub mod traverse;
