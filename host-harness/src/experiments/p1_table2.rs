//! P1 Table 2: memory traffic of the binned SAH hardware and of MergeTree.

use super::paper::p1;
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value, setup};
use crate::report::html::Source;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p1-table2",
    place: "P1 Table 2",
    title: "Memory traffic beside Doyle et al.'s builder",
    needs_scenes: true,
    run,
};

const COLUMNS: [Column; 2] = [
    Column::new("doyle_mib", "Doyle MiB", Source::Modelled).places(0),
    Column::new("proposed_mb", "MergeTree MB", Source::Counted).places(1),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let scenes = outcome.scenes(lab, &p1::TABLE_2.map(|(scene, _)| scene))?;
    let builds = lab.builds(&scenes, &[setup::function(setup::p1().build)])?;
    let binned = lab.binned(&scenes);
    let mut table = Table::new("Bytes on the memory bus", "scene", COLUMNS);
    for (scene, [doyle, proposed]) in &p1::TABLE_2 {
        let here = scenes.iter().position(|loaded| loaded.scene == *scene);
        let bytes = here.map(|i| builds[i][0].traffic.total().bytes() as f64 / 1e6);
        let model = here.map(|i| binned[i].mib());
        let values = [Value::new(model, Some(*doyle)), Value::new(bytes, Some(*proposed))];
        table.scene(scene, here.map(|i| builds[i][0].primitives), values);
    }
    outcome.tables.push(table);
    outcome.configuration.push(
        "MergeTree: M = 4096, B = 8, leaves of one primitive; every byte counted. Doyle: P2's model of \
         that builder over a binned SAH tree of 16 bins."
            .to_owned(),
    );
    outcome.notes.push(
        "MergeTree's MB are taken for 10^6 bytes: the conference room's 53 MB of 331 K triangles are 160 \
         bytes each, 32 read, 64 sorted and 64 written. Ours are 164: 4 for a leaf table, which P1's \
         leaves of one primitive can do without and P2's cannot (+2.5 %)."
            .to_owned(),
    );
    Ok(())
}
