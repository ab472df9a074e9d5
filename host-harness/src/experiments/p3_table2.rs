//! P3 Table 2 and Fig. 11: times of builds that compress.

use std::sync::Arc;

use xylem_core::node::Coordinates;

use super::paper::p3;
use super::{Built, Column, Experiment, ExperimentError, Lab, Outcome, Table, Value, setup};
use crate::machine::config::MachineConfig;
use crate::report::html::Source;
use crate::run::BuildOptions;

/// The table.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p3-table2",
    place: "P3 Table 2",
    title: "Times of builds to 64-byte and to quantized nodes",
    needs_scenes: true,
    run,
};

/// The figure: the same, relative to builds of 64-byte nodes.
pub const FIGURE: Experiment = Experiment {
    id: "p3-fig11",
    place: "P3 Fig. 11",
    title: "Times of builds to quantized nodes, of those to 64-byte nodes",
    needs_scenes: true,
    run: run_figure,
};

const COLUMNS: [Column; 5] = [
    Column::new("exact_ms", "64 bytes", Source::Modelled),
    Column::new("separate_ms", "separate pass", Source::Modelled),
    Column::new("relative_ms", "relative", Source::Modelled),
    Column::new("modulo_treelets_ms", "modulo, treelets 4", Source::Modelled),
    Column::new("held_lines_ms", "relative, 16 lines", Source::Modelled),
];

const RATIOS: [Column; 4] = [
    Column::new("separate", "separate pass", Source::Modelled),
    Column::new("relative", "relative", Source::Modelled),
    Column::new("modulo_treelets", "modulo, treelets 4", Source::Modelled),
    Column::new("held_lines", "relative, 16 lines", Source::Modelled),
];

/// Builds in the order of the columns, with bursts of so many boxes.
fn options(burst: u32) -> [BuildOptions; 5] {
    let clocked = |mut config: xylem_core::pipeline::BuildConfig| {
        config.sort.burst = burst;
        setup::clocked(MachineConfig::p2(config), "p3")
    };
    let exact = clocked(setup::triangles());
    let mut held = setup::streamed(Coordinates::Relative, 1);
    if let Some(compression) = &mut held.compression {
        compression.repairs = setup::HELD;
    }
    [
        exact,
        BuildOptions { format: setup::separate().format, ..exact },
        clocked(setup::streamed(Coordinates::Relative, 1)),
        clocked(setup::streamed(Coordinates::Modulo, 4)),
        clocked(held),
    ]
}

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let scenes = outcome.scenes(lab, &p3::TABLE_2.map(|(scene, _)| scene))?;
    for (burst, columns, caption) in [
        (16, &COLUMNS[..], "Milliseconds, bursts of 16 boxes"),
        (8, &COLUMNS[..4], "Milliseconds, bursts of 8 boxes"),
    ] {
        let builds = lab.builds(&scenes, &options(burst)[..columns.len()])?;
        let mut table = Table::new(caption, "scene", columns.to_vec());
        for (scene, paper) in &p3::TABLE_2 {
            let here = scenes.iter().position(|loaded| loaded.scene == *scene);
            let here = here.map(|at| &builds[at]);
            let ms = |i: usize| here.map(|builds: &Vec<Arc<Built>>| builds[i].milliseconds());
            let values = (0..columns.len()).map(|i| Value::new(ms(i), paper.get(i).copied()));
            table.scene(scene, here.map(|builds| builds[0].primitives), values.collect::<Vec<_>>());
        }
        outcome.tables.push(table);
    }
    outcome.configuration.extend([setup::P3_MACHINE, setup::P3_MEMORY].map(str::to_owned));
    outcome.notes.extend(NOTES.map(str::to_owned));
    Ok(())
}

fn run_figure(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let scenes = outcome.scenes(lab, &p3::TABLE_2.map(|(scene, _)| scene))?;
    let builds = lab.builds(&scenes, &options(16))?;
    let mut table = Table::new("Of the time to 64-byte nodes", "scene", RATIOS);
    for (loaded, builds) in scenes.iter().zip(&builds) {
        let paper = p3::TABLE_2.iter().find(|(scene, _)| *scene == loaded.scene);
        let exact = builds[0].milliseconds();
        let values = [1, 2, 3, 4].map(|i| {
            let paper = paper.and_then(|(_, ms)| Some(ms.get(i)? / ms[0]));
            Value::new(Some(builds[i].milliseconds() / exact), paper)
        });
        table.scene(loaded.scene, Some(builds[0].primitives), values);
    }
    let means = [0, 1, 2, 3].map(|i| Value::new(table.mean(i), p3::FIG_11.get(i).copied()));
    table.row("mean; paper's of sixteen", means);
    outcome.tables.push(table);
    outcome.configuration.extend([setup::P3_MACHINE, setup::P3_MEMORY].map(str::to_owned));
    outcome.notes.extend(NOTES.map(str::to_owned));
    Ok(())
}

const NOTES: [&str; 4] = [
    "P3 §5.3 states buffers of 8 boxes. With 16, as in P2, its times come out; with 8 ours are up to a fifth \
     longer, as the merge then changes rows of the DRAM twice as often.",
    "The separate pass is P3's: every node is read as soon as its parent is here, as many at a time as \
     the memory takes.",
    "A repair in memory waits for what is being written, reads its line, takes 4 cycles, and writes it; \
     then comes the next. By P3's numbers its repairs take about 26 ns each. Ours take less, and there are \
     fewer: the estimate allows for a parent's coarser grid, and the memory controller answers a read of a \
     line that waits in its write queue, as Ramulator's does, which is where most repairs find theirs.",
    "16 lines: a unit of ours. The last 16 lines of 64 bytes stay on chip, and repairs in them cost no \
     traffic; not even relative coordinates without treelets then take longer than others.",
];
