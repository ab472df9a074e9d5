//! P2 Table VI: memory traffic of builds.

use super::paper::p2;
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value};
use crate::report::html::Source;
use crate::run::BuildOptions;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p2-table6",
    place: "P2 Table VI",
    title: "Memory traffic of a build",
    needs_scenes: true,
    run,
};

const MIB: f64 = 1048576.0;

const COLUMNS: [Column; 3] = [
    Column::new("proposed_mib", "MergeTree MiB", Source::Counted),
    Column::new("binned_mib", "binned SAH", Source::Modelled).places(0),
    Column::new("gpu_mib", "GPU HLBVH", Source::Modelled).places(0),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let (scenes, missing) = lab.scenes(&p2::TABLE_6.map(|(scene, _)| scene))?;
    outcome.missing = missing;
    outcome.nothing_at_hand = scenes.is_empty();
    let builds = lab.builds(&scenes, &[BuildOptions::default()])?;
    let mut table = Table::new("Bytes on the memory bus, in MiB", "scene", COLUMNS);
    for (scene, paper) in &p2::TABLE_6 {
        let here = scenes.iter().zip(&builds).find(|(loaded, _)| loaded.scene.name == scene.name);
        let built = here.map(|(_, builds)| &builds[0]);
        let ours = built.map(|built| built.traffic.total().bytes() as f64 / MIB);
        let values =
            [Value::new(ours, Some(paper[0])), Value::paper(paper[1]), Value::paper(paper[2])];
        table.scene(scene, built.map(|built| built.primitives), values);
    }
    outcome.tables.push(table);
    outcome.configuration.push(
        "MergeTree: M = 8192, B = 16, 32-byte boxes, 30-bit codes on a cubic grid, equal codes in one \
         leaf; every byte counted on the bus"
            .to_owned(),
    );
    outcome.notes.push(
        "The paper's MB are 2^20 bytes: with 10^6 none of the models at hand would agree."
            .to_owned(),
    );
    Ok(())
}
