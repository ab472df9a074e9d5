//! Holds the benchmark that runs Xylem beside other BVH crates; see `benches/peers.rs`.
//!
//! A package of its own, outside the workspace's default members, so that building and testing
//! Xylem does not compile its peers.
