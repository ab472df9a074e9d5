//! Random cases with a fixed seed.

use proptest::strategy::Strategy;
use proptest::test_runner::{Config, RngAlgorithm, TestCaseError, TestRng, TestRunner};

/// Runs `check` on `cases` values of `strategy` that follow from `seed`, which is printed.
///
/// # Panics
/// If a case fails, with the smallest one found.
pub fn for_all<S: Strategy>(
    seed: u64,
    cases: u32,
    strategy: S,
    check: impl Fn(S::Value) -> Result<(), TestCaseError>,
) {
    let mut bytes = [0; 32];
    bytes[..8].copy_from_slice(&seed.to_le_bytes());
    let config = Config { cases, failure_persistence: None, ..Config::default() };
    let rng = TestRng::from_seed(RngAlgorithm::ChaCha, &bytes);
    println!("{cases} cases, seed {seed:#x}");
    TestRunner::new_with_rng(config, rng).run(&strategy, check).unwrap_or_else(|e| panic!("{e}"));
}
