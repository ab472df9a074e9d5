//! Utilisation of the machine's units over time: P1 Fig. 4 and 5, P2 Fig. 6.

use super::{Chart, Column, ExperimentError, Lab, Loaded, Outcome, Table, Value};
use crate::machine::activity::{Activity, Unit};
use crate::machine::port::LINE_BYTES;
use crate::report::html::Source;
use crate::report::timeline::{Panel, Timeline};
use crate::run::{BuildOptions, ClockedRun};
use xylem_core::probe::Stage;

/// A run to be drawn.
#[derive(Debug)]
pub struct Trace {
    /// The name of its rows and its panel.
    pub name: &'static str,
    /// What is built on the clock.
    pub options: BuildOptions,
    /// The share of the bus that the paper says was used in the whole build, per cent.
    pub paper_bus: Option<f64>,
}

const COLUMNS: [Column; 6] = [
    Column::new("ms", "ms", Source::Modelled).places(3),
    Column::new("bus_percent", "bus %", Source::Modelled).places(1),
    Column::new("sorters_percent", "sorters %", Source::Modelled).places(1),
    Column::new("multi_merge_percent", "multi-merge %", Source::Modelled).places(1),
    Column::new("emitter_percent", "emitter %", Source::Modelled).places(1),
    Column::new("top_level_percent", "top level %", Source::Modelled).places(1),
];

const UNITS: [Unit; 4] = [Unit::Sorters, Unit::MultiMerge, Unit::Emitter, Unit::TopLevel];

/// Builds a scene on the clock for each trace and adds a table of the phases and a chart.
///
/// # Errors
/// [`ExperimentError::Build`].
pub fn draw(
    lab: &Lab<'_>,
    outcome: &mut Outcome,
    scene: &Loaded,
    traces: &[Trace],
) -> Result<(), ExperimentError> {
    let options: Vec<_> = traces.iter().map(|trace| trace.options).collect();
    let builds = lab.builds(std::slice::from_ref(scene), &options)?;
    let name = scene.scene.name;
    let mut table = Table::new(format!("{name} by phases"), "phase", COLUMNS);
    let mut timeline = Timeline {
        lines: ["memory bus"].into_iter().chain(UNITS.map(Unit::name)).collect(),
        panels: Vec::new(),
    };
    for (trace, built) in traces.iter().zip(builds.iter().flatten()) {
        let Some(run) = &built.clocked else { continue };
        add_rows(&mut table, trace, run);
        timeline.panels.push(panel(trace, run));
    }
    outcome.tables.push(table);
    outcome.charts.push(Chart {
        name: outcome.id.to_owned(),
        caption: format!(
            "{name}: busy share of each unit over time; the multi-merge and what it feeds can work \
             every second cycle at most."
        ),
        timeline,
    });
    Ok(())
}

fn add_rows(table: &mut Table, trace: &Trace, run: &ClockedRun) {
    let machine = &run.machine;
    let cycles = |stage| machine.traffic.stage(stage).millicycles / 1000;
    let ms = |cycles: u64| cycles as f64 / (f64::from(run.config.clock_mhz) * 1e3);
    let sorted = cycles(Stage::PartialSort);
    let merged = machine.cycles - cycles(Stage::TopLevel);
    let bus = bus(run);
    for (what, range) in [
        ("partial sorts", 0..sorted),
        ("multi-merge", sorted..merged),
        ("top level", merged..machine.cycles),
        ("whole build", 0..machine.cycles),
    ] {
        let used = 100.0 * mean(&bus, machine.activity.window(), &range);
        let used = match what {
            "whole build" => Value::new(run.bus_utilisation().map(|x| 100.0 * x), trace.paper_bus),
            _ => Value::ours(used),
        };
        let of = |unit| Value::ours(100.0 * unit_mean(&machine.activity, unit, &range));
        let values = [Value::ours(ms(range.end - range.start)), used];
        let values: Vec<_> = values.into_iter().chain(UNITS.map(of)).collect();
        table.row(format!("{}: {what}", trace.name), values);
    }
}

fn panel(trace: &Trace, run: &ClockedRun) -> Panel {
    let activity = &run.machine.activity;
    let mut shares = vec![bus(run)];
    shares.extend(UNITS.map(|unit| activity.shares(unit).collect::<Vec<_>>()));
    let cycles = shares[0].len() as u64 * activity.window();
    let milliseconds = cycles as f64 / (f64::from(run.config.clock_mhz) * 1e3);
    Panel { title: trace.name.to_owned(), milliseconds, shares }
}

/// Lines taken at the port in each window as a share of what the memory can move.
fn bus(run: &ClockedRun) -> Vec<f64> {
    let activity = &run.machine.activity;
    let peak = run.memory.as_ref().map_or(f64::INFINITY, |memory| memory.peak_gb_per_s);
    let bytes_per_cycle = peak * 1e3 / f64::from(run.config.clock_mhz);
    let lines = activity.shares(Unit::ReadPort).zip(activity.shares(Unit::WritePort));
    lines.map(|(read, write)| (read + write) * f64::from(LINE_BYTES) / bytes_per_cycle).collect()
}

fn unit_mean(activity: &Activity, unit: Unit, cycles: &std::ops::Range<u64>) -> f64 {
    mean(&activity.shares(unit).collect::<Vec<_>>(), activity.window(), cycles)
}

/// The mean over some cycles of shares in windows.
fn mean(shares: &[f64], window: u64, cycles: &std::ops::Range<u64>) -> f64 {
    let mut sum = 0.0;
    for (i, share) in shares.iter().enumerate() {
        let start = (i as u64 * window).max(cycles.start);
        let end = ((i as u64 + 1) * window).min(cycles.end);
        sum += share * end.saturating_sub(start) as f64;
    }
    let len = cycles.end.saturating_sub(cycles.start);
    if len > 0 { sum / len as f64 } else { 0.0 }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_mean_takes_parts_of_windows() {
        let shares = [1.0, 0.0, 0.5];
        assert_eq!(mean(&shares, 10, &(0..10)), 1.0);
        assert_eq!(mean(&shares, 10, &(5..15)), 0.5);
        assert_eq!(mean(&shares, 10, &(0..30)), 0.5);
        assert_eq!(mean(&shares, 10, &(7..7)), 0.0);
    }
}
