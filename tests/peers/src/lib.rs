//! Holds what runs Xylem beside other BVH crates: times in `benches/peers.rs`, tree quality in
//! `tests/quality.rs`.
//!
//! A package of its own, outside the workspace's default members, so that building and testing
//! Xylem does not compile its peers.
