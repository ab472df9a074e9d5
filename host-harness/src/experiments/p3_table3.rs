//! P3 Table 3: memory traffic of builds that compress, and of refits.

use rayon::prelude::*;
use xylem_core::node::Coordinates;

use super::paper::p3;
use super::{Column, Experiment, ExperimentError, Lab, Loaded, Outcome, Table, Value, setup};
use crate::report::html::Source;
use crate::run::{self, BuildOptions, RefitMethod};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p3-table3",
    place: "P3 Table 3",
    title: "Memory traffic of builds and refits of quantized trees",
    needs_scenes: true,
    run,
};

const MIB: f64 = 1048576.0;

const COLUMNS: [Column; 5] = [
    Column::new("separate_mib", "B", Source::Counted),
    Column::new("relative_mib", "R0", Source::Counted),
    Column::new("relative_treelets_mib", "R1", Source::Counted),
    Column::new("modulo_mib", "M0", Source::Counted),
    Column::new("modulo_treelets_mib", "M1", Source::Counted),
];

const REPAIRS: [Column; 4] = [
    Column::new("relative_repairs", "R0", Source::Counted).places(0),
    Column::new("relative_treelets_repairs", "R1", Source::Counted).places(0),
    Column::new("modulo_repairs", "M0", Source::Counted).places(0),
    Column::new("modulo_treelets_repairs", "M1", Source::Counted).places(0),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    use Coordinates::{Modulo, Relative};
    let scenes = outcome.scenes(lab, &p3::TABLE_3_BUILD.map(|(scene, _)| scene))?;
    let streamed = |coordinates, depth| setup::function(setup::streamed(coordinates, depth));
    let ways = [(Relative, 1), (Relative, 2), (Modulo, 1), (Modulo, 2)];
    let mut options = vec![setup::separate()];
    options.extend(ways.map(|(coordinates, depth)| streamed(coordinates, depth)));
    // P3's estimate, to tell its part in the difference.
    options.extend(ways.map(|(coordinates, depth)| {
        let mut config = setup::streamed(coordinates, depth);
        if let Some(compression) = &mut config.compression {
            compression.margin = 0;
        }
        setup::function(config)
    }));
    let builds = lab.builds(&scenes, &options)?;
    let mut bytes = Table::new("Bytes on the memory bus, in MiB", "scene", COLUMNS);
    let mut repairs = Table::new("Nodes encoded again", "scene", REPAIRS);
    let mut plain = Table::new("The same with an estimate without margin", "scene", REPAIRS);
    for (scene, paper) in &p3::TABLE_3_BUILD {
        let here = scenes.iter().position(|loaded| loaded.scene == *scene).map(|at| &builds[at]);
        let triangles = here.map(|builds| builds[0].primitives);
        let values = [0, 1, 2, 3, 4].map(|i| {
            let ours = here.map(|builds| builds[i].traffic.total().bytes() as f64 / MIB);
            Value::new(ours, Some(paper[i]))
        });
        bytes.scene(scene, triangles, values);
        if let Some(builds) = here {
            let count = |i: usize| Value::ours(builds[i].compressor.backtracks() as f64);
            repairs.scene(scene, triangles, [1, 2, 3, 4].map(count));
            plain.scene(scene, triangles, [5, 6, 7, 8].map(count));
        }
    }
    let refits = refits(lab, &scenes, &options[..5])?;
    let mut refitted = Table::new("Refits: bytes on the memory bus, in MiB", "scene", COLUMNS);
    for (scene, paper) in &p3::TABLE_3_REFIT {
        let here = scenes.iter().position(|loaded| loaded.scene == *scene);
        let values = [0, 1, 2, 3, 4].map(|i| {
            let ours = here.map(|at| refits[at * 5 + i] as f64 / MIB);
            Value::new(ours, Some(paper[i]))
        });
        refitted.scene(scene, here.map(|at| builds[at][0].primitives), values);
    }
    outcome.tables.extend([bytes, refitted, repairs, plain]);
    outcome.configuration.push(setup::P3_TRAFFIC.to_owned());
    outcome.configuration.push(
        "B: 64-byte nodes are written, read again and compressed. R: relative coordinates, M: modulo; 0: \
         no treelets, 1: one layer of them."
            .to_owned(),
    );
    outcome.notes.extend(NOTES.map(str::to_owned));
    Ok(())
}

/// Bytes of refits to the same triangles, scene by scene, for each of `options`.
fn refits(
    lab: &Lab<'_>,
    scenes: &[Loaded],
    options: &[BuildOptions],
) -> Result<Vec<u64>, ExperimentError> {
    let jobs: Vec<_> =
        scenes.iter().flat_map(|scene| options.iter().map(move |o| (scene, o))).collect();
    let refit = |(loaded, options): &(&Loaded, &BuildOptions)| {
        lab.say(&format!("refitting {}", loaded.mesh.name));
        let scene = || loaded.mesh.name.clone();
        let triangles = &loaded.mesh.triangles;
        let mut run = run::build(triangles, options)
            .map_err(|source| ExperimentError::Build { scene: scene(), source })?;
        let method = options.config.compression.map_or(RefitMethod::TopDown, RefitMethod::InPlace);
        let refit = run::refit(&mut run, triangles, &method, options.memory)
            .map_err(|source| ExperimentError::Refit { scene: scene(), source })?;
        run.check().map_err(|source| ExperimentError::Build { scene: scene(), source })?;
        Ok(refit.traffic.total().bytes())
    };
    jobs.par_iter().map(refit).collect()
}

const NOTES: [&str; 3] = [
    "A refit reads 16 bytes a node, 4 a leaf table entry and 40 a triangle, and writes 16 a node; with a \
     separate pass 64 are written and read on the way (P3 §5.2).",
    "Ours have fewer repairs than P3's. A node's grid is guessed as for a box that was already rounded to \
     a parent's grid twice as coarse. P3 takes the exponent of the exact box, which is too fine \
     where rounding takes the box over a power of two.",
    "On an integer grid a flat box is one unit thick, so planes of finely meshed cloth cause no runs of \
     repairs as they do in P3 §4.4, and there is no minimum scale to set.",
];
