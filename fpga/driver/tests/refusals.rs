//! Jobs that the driver refuses, each with its error and without a register written.

mod fake;

use std::convert::Infallible;

use fake::Fake;
use fake::fixtures::{Driver, build_job, compression, polled, trace_job, tree};
use xylem_core::mem::Region;
use xylem_core::num::MortonWidth;
use xylem_core::sort::RecordFormat;
use xylem_driver::{
    BuildJob, CompressJob, Compression, ConfigError, NoInterrupt, StartError, TraceJob,
};
use xylem_regs::{CAP_FEATURES, CapFeatures, RegionId, Register};

/// Checks that `start` refuses a job with `expected` before it writes any register.
fn refused(
    start: impl FnOnce(&mut Driver<NoInterrupt>) -> Result<(), StartError<Infallible>>,
    expected: ConfigError,
) {
    let fake = Fake::new();
    assert_eq!(start(&mut polled(&fake)), Err(StartError::Config(expected)));
    assert_eq!(fake.writes(), [], "{expected}");
}

fn refused_build(change: impl FnOnce(&mut BuildJob), expected: ConfigError) {
    let mut job = build_job();
    change(&mut job);
    refused(|xylem| xylem.start_build(&job), expected);
}

fn refused_trace(change: impl FnOnce(&mut TraceJob), expected: ConfigError) {
    let mut job = trace_job();
    change(&mut job);
    refused(|xylem| xylem.start_trace(&job), expected);
}

#[test]
fn empty_jobs_are_refused() {
    refused_build(|job| job.count = 0, ConfigError::Empty { what: "primitive list" });
    refused_trace(|job| job.ray_count = 0, ConfigError::Empty { what: "ray list" });
    refused_trace(|job| job.tree.root = None, ConfigError::Empty { what: "tree" });
}

#[test]
fn bad_regions_are_refused_by_name() {
    let region = RegionId::RunsA;
    let (base, size) = (0x2_0000, 0x8000);
    refused_build(|job| job.regions.runs_a.size = 0, ConfigError::ZeroSize { region });
    refused_build(
        |job| job.regions.runs_a.base.0 += 32,
        ConfigError::Misaligned { region, base: base + 32, size },
    );
    refused_build(
        |job| job.regions.runs_a.size += 1,
        ConfigError::Misaligned { region, base, size: size + 1 },
    );
    refused_build(
        |job| job.regions.runs_a.base.0 = 0xffff_ffc0,
        ConfigError::BeyondAddressSpace { region },
    );
    refused_build(
        |job| job.regions.runs_a.size = 31_936,
        ConfigError::TooSmall { region, needed: 32_000, available: 31_936 },
    );
}

#[test]
fn a_region_may_end_where_memory_ends() {
    let mut job = build_job();
    job.regions.runs_a.base.0 = 0xffff_8000;
    assert_eq!(polled(&Fake::new()).start_build(&job), Ok(()));
}

#[test]
fn regions_may_touch_but_not_overlap() {
    let (first, second) = (RegionId::Primitives, RegionId::RunsA);
    let mut job = build_job();
    job.regions.runs_a.base.0 = 0x1_8000;
    assert_eq!(polled(&Fake::new()).start_build(&job), Ok(()));
    for base in [0x1_7fc0, 0x1_0000, 0x0_8040] {
        refused_build(
            |job| job.regions.runs_a.base.0 = base,
            ConfigError::Overlap { first, second },
        );
    }
}

#[test]
fn a_second_run_region_is_asked_for_only_when_one_merge_pass_is_not_enough() {
    let count = 8192 * 256 + 1;
    let wide = |base: u32| Region::new(base, 0x0800_0000);
    let mut job = build_job();
    job.regions.primitives = wide(0);
    job.regions.runs_a = wide(0x1000_0000);
    job.regions.leaf_table = wide(0x2000_0000);
    job.regions.nodes = wide(0x3000_0000);
    job.count = count - 1;
    assert_eq!(polled(&Fake::new()).start_build(&job), Ok(()));
    job.count = count;
    let region = RegionId::RunsB;
    refused(|xylem| xylem.start_build(&job), ConfigError::ZeroSize { region });
    job.regions.runs_b = wide(0x4000_0000);
    assert_eq!(polled(&Fake::new()).start_build(&job), Ok(()));
}

#[test]
fn parameters_beyond_the_capabilities_are_refused_with_the_limits() {
    let parameter = "max_leaf_size";
    for value in [0, 256] {
        refused_build(
            |job| job.max_leaf_size = value,
            ConfigError::OutOfRange { parameter, value, min: 1, max: 255 },
        );
    }
    let parameter = "treelet_depth";
    for value in [1, 3] {
        refused_build(
            |job| {
                let treelet_depth = value as u8;
                job.compressed = Some(Compression { treelet_depth, ..compression() });
            },
            ConfigError::OutOfRange { parameter, value, min: 2, max: 2 },
        );
    }
    let (parameter, value) = ("ray_count", 1 << 26);
    let too_many = TraceJob { ray_count: value, ..trace_job() };
    let max = TraceJob::MAX_COUNT;
    refused(
        |xylem| xylem.start_trace(&too_many),
        ConfigError::OutOfRange { parameter, value, min: 0, max },
    );
}

#[test]
fn combinations_that_make_no_sense_are_refused() {
    refused_build(
        |job| (job.record, job.morton) = (RecordFormat::Pair8, MortonWidth::Bits63),
        ConfigError::PairCode,
    );
    let compressed = CompressJob { tree: tree(), compression: compression() }.tree();
    let twice = CompressJob { tree: compressed, compression: compression() };
    refused(|xylem| xylem.start_compress(&twice), ConfigError::AlreadyCompressed);
}

#[test]
fn features_that_are_absent_are_refused() {
    let all = 0x0013_373f;
    let check = |absent: u32, start: &dyn Fn(&mut Driver<NoInterrupt>) -> bool| {
        let fake = Fake::new();
        assert!(start(&mut polled(&fake)), "{absent:#x}: starts where it is present");
        let fake = Fake::new();
        fake.drive(CAP_FEATURES, CapFeatures::from_bits(all & !absent));
        assert!(!start(&mut polled(&fake)), "{absent:#x}: does not start where it is absent");
        assert_eq!(fake.writes(), []);
    };
    let compress = CompressJob { tree: tree(), compression: compression() };
    check(1, &|xylem| xylem.start_build(&build_job()).is_ok());
    check(2, &|xylem| xylem.start_compress(&compress).is_ok());
    let compressed = BuildJob { compressed: Some(compression()), ..build_job() };
    check(8, &|xylem| xylem.start_build(&compressed).is_ok());
    check(4, &|xylem| xylem.start_trace(&trace_job()).is_ok());
    check(1 << 4, &|xylem| xylem.start_build(&build_job()).is_ok());
    check(1 << 8, &|xylem| xylem.start_build(&build_job()).is_ok());
    check(1 << 12, &|xylem| xylem.start_trace(&trace_job()).is_ok());
    check(1 << 17, &|xylem| xylem.start_compress(&compress).is_ok());
}

#[test]
fn refusals_say_what_where_and_what_to_do() {
    let (region, first, second) = (RegionId::RunsA, RegionId::Nodes, RegionId::Rays);
    let says = |error: ConfigError, text: &str| assert_eq!(error.to_string(), text);
    says(ConfigError::ZeroSize { region }, "region runs_a has size 0; set it aside");
    says(
        ConfigError::Misaligned { region, base: 0x120, size: 0x40 },
        "region runs_a, 0x40 bytes at 0x00000120, is not aligned; base and size must be multiples \
         of 64 bytes",
    );
    says(
        ConfigError::TooSmall { region, needed: 6_400_000_000, available: 64 },
        "region runs_a has 64 bytes; the job needs 6400000000",
    );
    says(
        ConfigError::Overlap { first, second },
        "regions nodes and rays overlap; move one of them",
    );
    says(
        ConfigError::OutOfRange { parameter: "max_leaf_size", value: 256, min: 1, max: 255 },
        "max_leaf_size is 256; this accelerator takes 1 to 255",
    );
}
