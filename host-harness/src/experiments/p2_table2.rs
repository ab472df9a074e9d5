//! P2 Table II: the traffic model of the binned SAH hardware against what was reported of it.

use super::paper::p2;
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value};
use crate::report::html::Source;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p2-table2",
    place: "P2 Table II",
    title: "Traffic model of the binned SAH hardware",
    needs_scenes: true,
    run,
};

const COLUMNS: [Column; 2] = [
    Column::new("reported_mb", "reported MB", Source::Counted),
    Column::new("estimated_mib", "estimated MiB", Source::Modelled).places(1),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let scenes = outcome.scenes(lab, &p2::TABLE_2.map(|(scene, _)| scene))?;
    let binned = lab.binned(&scenes);
    let mut table = Table::new("Memory traffic of a build", "scene", COLUMNS);
    for (scene, [reported, estimated]) in &p2::TABLE_2 {
        let here = scenes.iter().position(|loaded| loaded.scene == *scene);
        let ours = here.map(|i| binned[i].mib());
        let values = [Value::paper(*reported), Value::new(ours, Some(*estimated))];
        table.scene(scene, here.map(|i| scenes[i].mesh.triangles.len() as u64), values);
    }
    outcome.tables.push(table);
    outcome.configuration.push(super::DOYLE_MODEL.to_owned());
    Ok(())
}
