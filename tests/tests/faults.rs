//! A bus that fails, and regions that are too small: the error says where, and what was written
//! before is all there and all there is.

use std::collections::BTreeMap;

use xylem::bus::{Fault, Faulty, FaultyError, FlatMemory, MemoryError, StageClock};
use xylem::scene::Random;
use xylem_core::error::{BuildError, RegionName};
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::node::{Bvh2Node, Quantization, Tree};
use xylem_core::probe::{Probe, Stage};
use xylem_core::sort::RecordFormat;
use xylem_core::traverse::{Query, TraceError};
use xylem_tests::job::{Job, trace};

const SEED: u64 = 0x5eed_fa17;

const RECORDS: [RecordFormat; 3] =
    [RecordFormat::Box32, RecordFormat::Packed22, RecordFormat::Pair8];

type Failure = BuildError<FaultyError<MemoryError>>;

/// 300 triangles in runs of 64, merged 4 at a time: one further merge pass.
fn jobs() -> [Job; 3] {
    RECORDS.map(|record| Job::new(&mut Random::new(SEED), 300, record))
}

/// Builds, then compresses.
fn work<B: Bus, P: Probe>(
    job: &Job,
    bus: &mut B,
    probe: &mut P,
) -> Result<(Tree, Tree), BuildError<B::Error>> {
    let exact = job.build(bus, probe)?;
    let quantized = job.compress(bus, &exact, &Quantization::MODULO, probe)?;
    Ok((exact, quantized))
}

/// One access: when, where, and the bytes if it was a write.
struct Access {
    stage: Stage,
    addr: ByteAddr,
    written: Option<Vec<u8>>,
}

/// A bus that keeps a log.
struct Logged<'a> {
    memory: FlatMemory,
    stage: &'a StageClock,
    log: Vec<Access>,
}

impl Bus for Logged<'_> {
    type Error = MemoryError;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), MemoryError> {
        self.log.push(Access { stage: self.stage.now(), addr, written: None });
        self.memory.read(addr, buf)
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), MemoryError> {
        self.log.push(Access { stage: self.stage.now(), addr, written: Some(bytes.to_vec()) });
        self.memory.write(addr, bytes)
    }
}

#[test]
fn whichever_access_fails_the_error_names_it_and_memory_is_as_it_was_just_before() {
    for job in jobs() {
        let stage = StageClock::default();
        let mut good = Logged { memory: job.memory.clone(), stage: &stage, log: Vec::new() };
        work(&job, &mut good, &mut &stage).unwrap();

        let mut memory = job.memory.clone();
        let mut by_stage = BTreeMap::new();
        for (number, access) in good.log.iter().enumerate() {
            let fault = Fault::Access(number as u64);
            let mut bus = Faulty::new(job.memory.clone(), fault);
            let failure = work(&job, &mut bus, &mut ()).unwrap_err();
            let error = FaultyError::Injected { access: number as u64 };
            let Access { stage, addr, .. } = *access;
            assert_eq!(failure, BuildError::Bus { stage, addr, error }, "access {number}");
            let text = failure.to_string();
            assert!(text.starts_with(&format!("bus error at {addr} during {stage:?}")), "{text}");
            assert!(bus.into_inner().bytes() == memory.bytes(), "access {number}: memory");
            *by_stage.entry(stage).or_insert(0) += 1;
            if let Some(bytes) = &access.written {
                memory.write(addr, bytes).unwrap();
            }
        }
        assert!(good.memory.bytes() == memory.bytes());
        println!("{:?}: every one of {by_stage:?} accesses by stage", job.config.sort.record);
        let stages = [Stage::PartialSort, Stage::Merge, Stage::Emit, Stage::Compress];
        assert!(by_stage.keys().eq(&stages), "{by_stage:?}");
    }
}

#[test]
fn whichever_read_of_a_trace_fails_the_error_names_it() {
    let [job, ..] = jobs();
    let mut memory = job.memory.clone();
    let exact = job.build(&mut memory, &mut ()).unwrap();
    let mut tried = 0;
    for quantization in [None, Some(Quantization::RELATIVE), Some(Quantization::MODULO)] {
        let tree = match quantization {
            None => exact,
            Some(q) => job.compress(&mut memory, &exact, &q, &mut ()).unwrap(),
        };
        let scene = job.scene(tree);
        for ray in job.rays(&mut Random::new(SEED), 60) {
            for query in [Query::Closest, Query::Any] {
                let mut good = Faulty::new(memory.snapshot(), Fault::Access(u64::MAX));
                trace(&mut good, &scene, &ray, query).unwrap();
                for access in 0..good.accesses() {
                    let mut bus = Faulty::new(memory.snapshot(), Fault::Access(access));
                    let failure = trace(&mut bus, &scene, &ray, query).unwrap_err();
                    let injected = FaultyError::Injected { access };
                    assert!(
                        matches!(failure, TraceError::Bus { error, .. } if error == injected),
                        "{failure:?}"
                    );
                    assert_eq!(bus.accesses(), access + 1, "it stops at once");
                    tried += 1;
                }
            }
        }
    }
    println!("{tried} reads of traces failed, one at a time");
    assert!(tried > 1000);
}

#[test]
fn a_bad_byte_in_each_region_is_reported_with_its_stage() {
    let [job, ..] = jobs();
    let regions = job.layout.build;
    let cases = [
        (Fault::ReadOf(regions.primitives.base), Stage::PartialSort),
        (Fault::WriteTo(regions.runs_a.base), Stage::PartialSort),
        (Fault::ReadOf(regions.runs_a.base), Stage::Merge),
        (Fault::WriteTo(regions.runs_b.base), Stage::Merge),
        (Fault::ReadOf(regions.runs_b.base), Stage::Merge),
        (Fault::WriteTo(regions.nodes.base), Stage::Emit),
        (Fault::WriteTo(regions.leaf_table.base), Stage::Emit),
        (Fault::ReadOf(regions.nodes.base), Stage::Compress),
        (Fault::WriteTo(job.layout.quantized_nodes.base), Stage::Compress),
    ];
    for (fault, expect) in cases {
        let mut bus = Faulty::new(job.memory.clone(), fault);
        let failure: Failure = work(&job, &mut bus, &mut ()).unwrap_err();
        let base = match fault {
            Fault::ReadOf(byte) | Fault::WriteTo(byte) => byte,
            Fault::Access(_) => unreachable!("all cases name a byte"),
        };
        assert!(
            matches!(failure, BuildError::Bus { stage, addr, .. } if stage == expect && addr == base),
            "{fault:?}: {failure}"
        );
    }
}

#[test]
fn a_region_that_is_too_small_is_named_before_anything_is_written() {
    let [job, ..] = jobs();
    let shrink = |region: Region| Region { size: region.size - 1, ..region };
    let regions = job.layout.build;
    for name in
        [RegionName::Primitives, RegionName::RunsA, RegionName::RunsB, RegionName::LeafTable]
    {
        let mut job = job.clone();
        let region = match name {
            RegionName::Primitives => &mut job.layout.build.primitives,
            RegionName::RunsA => &mut job.layout.build.runs_a,
            RegionName::RunsB => &mut job.layout.build.runs_b,
            _ => &mut job.layout.build.leaf_table,
        };
        *region = shrink(*region);
        let (available, needed) = (region.size, u64::from(region.size) + 1);
        let mut memory = job.memory.clone();
        let failure = job.build(&mut memory, &mut ()).unwrap_err();
        assert_eq!(failure, BuildError::RegionFull { region: name, needed, available });
        let text =
            format!("region `{name}` is too small: {needed} bytes needed, {available} available");
        assert_eq!(failure.to_string(), text);
        assert!(memory.bytes() == job.memory.bytes(), "{name}: nothing was written");
    }

    let mut memory = job.memory.clone();
    let exact = job.build(&mut memory, &mut ()).unwrap();
    let before = memory.clone();
    let needed = u64::from(exact.node_count) * 16;
    let mut small = job.clone();
    small.layout.quantized_nodes.size = needed as u32 - 1;
    let failure =
        small.compress(&mut memory, &exact, &Quantization::RELATIVE, &mut ()).unwrap_err();
    let region = RegionName::QuantizedNodes;
    let available = needed as u32 - 1;
    assert_eq!(failure, BuildError::RegionFull { region, needed, available });
    assert!(memory.bytes() == before.bytes(), "nothing was written");
    assert_eq!(regions, job.layout.build);
}

#[test]
fn a_node_region_that_runs_full_keeps_the_nodes_that_fit() {
    for mut job in jobs() {
        let mut memory = job.memory.clone();
        let tree = job.build(&mut memory, &mut ()).unwrap();
        let region = tree.nodes;
        let nodes = tree.node_count as usize * Bvh2Node::BYTES;
        let golden = memory.bytes()[region.base.0 as usize..][..nodes].to_vec();
        for size in [0, 1, 63, 64, 65, 255, 256, 257, nodes / 2, nodes - 64, nodes - 1] {
            job.layout.build.nodes = Region { size: size as u32, ..region };
            let mut memory = job.memory.clone();
            let failure = job.build(&mut memory, &mut ()).unwrap_err();
            let fit = size / Bvh2Node::BYTES * Bvh2Node::BYTES;
            let full = BuildError::RegionFull {
                region: RegionName::Nodes,
                needed: fit as u64 + Bvh2Node::BYTES as u64,
                available: size as u32,
            };
            assert_eq!(failure, full);
            let written = &memory.bytes()[region.base.0 as usize..][..nodes];
            assert!(written[..fit] == golden[..fit], "{size} bytes: the nodes that fit are there");
            assert!(written[fit..].iter().all(|&byte| byte == 0), "{size} bytes: and nothing else");
        }
    }
}

#[test]
fn a_trace_over_regions_that_are_too_small_names_the_region() {
    let [job, ..] = jobs();
    let mut memory = job.memory.clone();
    let exact = job.build(&mut memory, &mut ()).unwrap();
    let quantized = job.compress(&mut memory, &exact, &Quantization::MODULO, &mut ()).unwrap();
    let rays = job.rays(&mut Random::new(SEED), 200);
    for (name, tree) in [
        (RegionName::Nodes, exact),
        (RegionName::QuantizedNodes, quantized),
        (RegionName::LeafTable, exact),
        (RegionName::Triangles, exact),
    ] {
        let mut scene = job.scene(tree);
        let region = match name {
            RegionName::LeafTable => &mut scene.tree.leaf_table,
            RegionName::Triangles => &mut scene.triangles,
            _ => &mut scene.tree.nodes,
        };
        region.size = 0;
        let mut failures = 0;
        for ray in &rays {
            match trace(&mut memory.snapshot(), &scene, ray, Query::Closest) {
                Err(failure) => {
                    assert_eq!(failure, TraceError::OutOfRegion { region: name });
                    failures += 1;
                }
                Ok(hit) => assert_eq!(hit, None, "nothing can be hit"),
            }
        }
        assert!(failures > rays.len() / 4, "{name}: {failures}");
    }
}

#[test]
fn an_invalid_primitive_is_named_by_its_position() {
    let [job, ..] = jobs();
    let base = job.layout.build.primitives.base.0 as usize;
    let cases: [(usize, i32); 4] = [
        // The lowest x above the highest, the highest off the grid, the lowest off the grid, and a
        // reference of 32 bits.
        (0, 1 << 23),
        (12, 1 << 23),
        (0, -(1 << 23) - 1),
        (24, -1),
    ];
    for index in [0usize, 63, 64, 299] {
        for (field, value) in cases {
            let mut memory = job.memory.clone();
            let at = base + 32 * index + field;
            memory.bytes_mut()[at..at + 4].copy_from_slice(&value.to_le_bytes());
            let failure = job.build(&mut memory, &mut ()).unwrap_err();
            let named = matches!(failure, BuildError::InvalidPrimitive { index: i } if i.0 as usize == index);
            assert!(named, "{index} {field}: {failure}");
        }
    }
}
