//! P1 Table 3: build times.

use xylem_core::toplevel::Bins;

use super::paper::p1;
use super::{Built, Column, Experiment, ExperimentError, Lab, Outcome, Table, Value, setup};
use crate::machine::toplevel::SweepUnit;
use crate::report::html::Source;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p1-table3",
    place: "P1 Table 3",
    title: "Build times at 16 and 32 GB/s",
    needs_scenes: true,
    run,
};

const COLUMNS: [Column; 5] = [
    Column::new("ms_16", "16 GB/s ms", Source::Modelled),
    Column::new("ms_32", "32 GB/s ms", Source::Modelled),
    Column::new("ns_per_triangle_16", "ns/tri. at 16", Source::Modelled),
    Column::new("bus_percent_16", "bus % at 16", Source::Modelled).places(1),
    Column::new("top_level_percent_16", "top level %", Source::Modelled).places(1),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let scenes = outcome.scenes(lab, &p1::TABLE_3.map(|(scene, _)| scene))?;
    let options = [
        setup::clocked(setup::p1(), "p1-16"),
        setup::clocked(setup::p1(), "p1-32"),
        setup::with_binned(setup::p1().build, Bins::Eight),
    ];
    let builds = lab.builds(&scenes, &options)?;
    let mut table = Table::new("Milliseconds, top level included", "scene", COLUMNS);
    for (scene, paper) in &p1::TABLE_3 {
        let here = scenes.iter().position(|loaded| loaded.scene == *scene).map(|i| &builds[i]);
        let paper_ns = scene.triangles.map(|n| paper[0] * 1e6 / f64::from(n.count));
        let ours = here.map(|builds| Times::new(builds));
        let values = [
            Value::new(ours.map(|ours| ours.ms[0]), Some(paper[0])),
            Value::new(ours.map(|ours| ours.ms[1]), Some(paper[1])),
            Value::new(ours.map(|ours| ours.ns_per_triangle), paper_ns),
            Value::new(ours.map(|ours| ours.bus_percent), None),
            Value::new(ours.map(|ours| ours.top_percent), None),
        ];
        table.scene(scene, here.map(|builds| builds[0].primitives), values);
    }
    let means = [3, 4].map(|column| table.mean(column));
    let bus = Value::new(means[0], Some(p1::BUS_PERCENT[1]));
    let top = Value::new(means[1], Some(p1::TOP_LEVEL_PERCENT));
    table.row("mean", [Value::NONE, Value::NONE, Value::NONE, bus, top]);
    outcome.tables.push(table);
    outcome.configuration.extend([setup::P1_MACHINE.to_owned(), setup::P1_MEMORIES.to_owned()]);
    outcome.configuration.push(
        "Top level: binned SAH of 8 bins over at most 2048 cells of a 32^3 grid, one cell a cycle and 32 \
         cycles after each sweep, after the rest (P1 §4.5)."
            .to_owned(),
    );
    outcome.notes.extend(
        [
            "Our Sibenik has 7 % more triangles than P1's: compare it by the triangle.",
            "P1 says neither how many cells its top level has nor how its GDDR3 controller drains \
             writes; ours is Ramulator's, with read and write queues of 32. A leaf table adds 2.5 % to \
             our traffic.",
        ]
        .map(str::to_owned),
    );
    Ok(())
}

#[derive(Clone, Copy)]
struct Times {
    ms: [f64; 2],
    ns_per_triangle: f64,
    bus_percent: f64,
    top_percent: f64,
}

impl Times {
    /// The times of a scene's builds: at 16 and 32 GB/s, and the function with its top level.
    fn new(builds: &[std::sync::Arc<Built>]) -> Self {
        let top = SweepUnit::PAPER.cycles(&builds[2].top);
        let ms = [0, 1].map(|i| builds[i].milliseconds(top));
        let bytes = builds[0].traffic.total().bytes() as f64;
        let peak = builds[0].memory().map_or(f64::INFINITY, |memory| memory.peak_gb_per_s);
        Self {
            ms,
            ns_per_triangle: ms[0] * 1e6 / builds[0].primitives.max(1) as f64,
            bus_percent: 100.0 * bytes / (ms[0] * 1e6) / peak,
            top_percent: 100.0 * (1.0 - builds[0].milliseconds(0) / ms[0]),
        }
    }
}
