//! The numbers of a set of traced rays.

use std::fmt;

use serde::Serialize;
use xylem_core::node::Quantization;
use xylem_core::traverse::{Method, Multipliers};

use super::units;
use crate::run::TraceRun;
use crate::scene::ConversionCounts;

/// The numbers of a set of traced rays, as `xylem trace --json` prints them. Means are over all
/// rays, those that never reached the tree included.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct TraceReport {
    /// The scene.
    pub scene: String,
    /// The node format, as `--format` names it.
    pub format: &'static str,
    /// The coordinates of quantized nodes, as `--coords` names them.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub coords: Option<&'static str>,
    /// What the rays were asked, as `--query` names it.
    pub query: String,
    /// Rays.
    pub rays: u64,
    /// Rays that hit a triangle.
    pub hits: u64,
    /// Rays without a direction: misses.
    pub zero_direction: u64,
    /// Rays whose interval is empty (`tmin >= tmax`): misses.
    pub empty_interval: u64,
    /// Rays whose interval or line stays outside the grid: misses.
    pub outside_grid: u64,
    /// Boxes tested for each ray, on average.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub box_tests_per_ray: Option<f64>,
    /// Triangles tested for each ray, on average.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub triangle_tests_per_ray: Option<f64>,
    /// Nodes fetched for each ray, on average.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub nodes_per_ray: Option<f64>,
    /// Bytes of nodes fetched for each ray, on average.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub node_bytes_per_ray: Option<f64>,
    /// The deepest stack, in entries.
    pub stack_depth_max: u64,
    /// How long the host took, in milliseconds, on `threads` threads: measured.
    pub host_ms: f64,
    /// Rays the host traced in a second: measured.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub host_rays_per_s: Option<f64>,
    /// Threads of the host.
    pub threads: usize,
    /// How boxes of quantized nodes were tested; absent for exact boxes.
    #[serde(flatten)]
    pub method: Option<MethodReport>,
    /// Rays whose answers were compared with every triangle's; absent without `--check`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub checked: Option<u64>,
    /// How many of them differed; absent without `--check`.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub mismatches: Option<u64>,
}

/// How boxes of quantized nodes are tested, and what a unit that does it multiplies and keeps.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MethodReport {
    /// The method, as `--traversal` names it.
    pub traversal: &'static str,
    /// The multipliers that test the two boxes of a node.
    pub test_multipliers: MultipliersReport,
    /// Those that move the traversal point to a child.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub descend_multipliers: Option<MultipliersReport>,
    /// Those that find the traversal point again after a pop.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub resume_multipliers: Option<MultipliersReport>,
    /// Bits of a stack entry.
    pub stack_entry_bits: u32,
}

/// Some equal multipliers.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct MultipliersReport {
    /// How many.
    pub count: u32,
    /// Widths of the two factors, in bits.
    pub factor_bits: [u32; 2],
}

impl MethodReport {
    /// What a method costs for nodes of a quantization.
    pub fn new(method: Method, quantization: &Quantization) -> Self {
        let cost = method.cost(quantization);
        Self {
            traversal: match method {
                Method::Decompress => "decompress",
                Method::TraversalPoint => "point",
                Method::Incremental => "incremental",
            },
            test_multipliers: MultipliersReport::new(cost.test),
            descend_multipliers: cost.descend.map(MultipliersReport::new),
            resume_multipliers: cost.resume.map(MultipliersReport::new),
            stack_entry_bits: cost.stack_entry_bits,
        }
    }
}

impl MultipliersReport {
    fn new(Multipliers { count, left, right }: Multipliers) -> Self {
        Self { count, factor_bits: [left, right] }
    }
}

impl fmt::Display for MultipliersReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let [left, right] = self.factor_bits;
        write!(f, "{} of {left} x {right} bits", self.count)
    }
}

impl TraceReport {
    /// Collects the numbers of traced rays. `tree` is the format and the coordinates.
    pub fn new(
        scene: &str,
        (format, coords): (&'static str, Option<&'static str>),
        query: impl fmt::Display,
        conversion: &ConversionCounts,
        run: &TraceRun,
    ) -> Self {
        let (rays, sums) = (run.hits.len() as u64, &run.sums);
        let seconds = run.host_time.as_secs_f64();
        Self {
            scene: scene.to_owned(),
            format,
            coords,
            query: query.to_string(),
            rays,
            hits: run.hits.iter().flatten().count() as u64,
            zero_direction: conversion.zero_direction as u64,
            empty_interval: conversion.empty_interval as u64,
            outside_grid: conversion.misses as u64,
            box_tests_per_ray: units::ratio(sums.box_tests, rays),
            triangle_tests_per_ray: units::ratio(sums.triangle_tests, rays),
            nodes_per_ray: units::ratio(sums.nodes, rays),
            node_bytes_per_ray: units::ratio(sums.node_bytes, rays),
            stack_depth_max: sums.stack_depth,
            host_ms: units::milliseconds(run.host_time),
            host_rays_per_s: (rays > 0 && seconds > 0.0).then(|| rays as f64 / seconds),
            threads: rayon::current_num_threads(),
            method: None,
            checked: None,
            mismatches: None,
        }
    }
}

impl fmt::Display for TraceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let n = units::count;
        let mean = |n: Option<f64>| n.map_or("n/a".into(), |n| format!("{n:.2}"));
        let coords = self.coords.map_or(String::new(), |c| format!(", {c} coordinates"));
        writeln!(f, "{}: {}{coords}, {} hits", self.scene, self.format, self.query)?;
        writeln!(f, "  {} rays, {} hit", n(self.rays), n(self.hits))?;
        writeln!(
            f,
            "  misses by themselves: {} without direction, {} with an empty interval, {} outside \
             the grid",
            n(self.zero_direction),
            n(self.empty_interval),
            n(self.outside_grid)
        )?;
        writeln!(
            f,
            "  per ray: {} box tests, {} triangle tests, {} nodes, {} node bytes",
            mean(self.box_tests_per_ray),
            mean(self.triangle_tests_per_ray),
            mean(self.nodes_per_ray),
            mean(self.node_bytes_per_ray)
        )?;
        write!(f, "  deepest stack: {} entries", self.stack_depth_max)?;
        if let Some(method) = &self.method {
            let (test, bits) = (&method.test_multipliers, method.stack_entry_bits);
            write!(f, " of {bits} bits\n  boxes: {}, {test} a node", method.traversal)?;
            if let Some(descend) = &method.descend_multipliers {
                write!(f, ", {descend} a descent")?;
            }
            if let Some(resume) = &method.resume_multipliers {
                write!(f, ", {resume} a pop")?;
            }
        }
        writeln!(f)?;
        let speed = self.host_rays_per_s.map_or("n/a ".into(), units::rate);
        write!(
            f,
            "  host: {:.1} ms, {speed}rays/s (measured, {} threads)",
            self.host_ms, self.threads
        )?;
        if let (Some(checked), Some(mismatches)) = (self.checked, self.mismatches) {
            let (checked, mismatches) = (n(checked), n(mismatches));
            write!(f, "\n  check: {checked} rays against every triangle, {mismatches} mismatches")?;
        }
        Ok(())
    }
}
