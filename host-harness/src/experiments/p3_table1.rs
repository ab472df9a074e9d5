//! P3 Table 1: repairs and traffic by treelet depth and coordinates, over all scenes.

use xylem_core::node::Coordinates;

use super::paper::p3;
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value, setup};
use crate::report::html::Source;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p3-table1",
    place: "P3 Table 1",
    title: "Repairs and traffic by coordinates and treelet depth",
    needs_scenes: true,
    run,
};

const fn column(key: &'static str, name: &'static str) -> Column {
    Column::new(key, name, Source::Counted).places(3)
}

const COLUMNS: [Column; 8] = [
    column("relative", "relative"),
    column("relative_2", "2 deep"),
    column("relative_3", "3 deep"),
    column("relative_4", "4 deep"),
    column("modulo", "modulo"),
    column("modulo_2", "2 deep"),
    column("modulo_3", "3 deep"),
    column("modulo_4", "4 deep"),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let scenes = outcome.scenes(lab, &p3::TABLE_3_BUILD.map(|(scene, _)| scene))?;
    let ways = [Coordinates::Relative, Coordinates::Modulo]
        .into_iter()
        .flat_map(|coordinates| (1..=4).map(move |depth| setup::streamed(coordinates, depth)));
    let mut options = vec![setup::separate()];
    options.extend(ways.map(setup::function));
    let builds = lab.builds(&scenes, &options)?;
    let mut repairs =
        Table::new("Repairs, of those in relative coordinates without treelets", "scene", COLUMNS);
    let mut bytes = Table::new("Traffic, of that with a separate pass", "scene", COLUMNS);
    for (loaded, builds) in scenes.iter().zip(&builds) {
        let triangles = Some(builds[0].primitives);
        let count = |i: usize| builds[i].compressor.backtracks() as f64;
        let total = |i: usize| builds[i].traffic.total().bytes() as f64;
        let ways = [1, 2, 3, 4, 5, 6, 7, 8];
        repairs.scene(
            loaded.scene,
            triangles,
            ways.map(|i| Value::ours(count(i) / count(1).max(1.0))),
        );
        bytes.scene(loaded.scene, triangles, ways.map(|i| Value::ours(total(i) / total(0))));
    }
    for (table, paper) in [(&mut repairs, p3::TABLE_1[0]), (&mut bytes, p3::TABLE_1[1])] {
        let means = [0, 1, 2, 3, 4, 5, 6, 7].map(|i| Value::new(table.mean(i), Some(paper[i])));
        table.row("mean; paper's of sixteen", means);
    }
    outcome.tables.extend([repairs, bytes]);
    outcome.configuration.push(setup::P3_TRAFFIC.to_owned());
    outcome.notes.push(
        "Depths count the nodes on a way down a treelet: 1 is none, 2 one layer that stays on chip. Our \
         estimate of a node's grid allows for its parent's rounding, which leaves few repairs more \
         than a level deep; treelets and modulo coordinates save nearly all the others."
            .to_owned(),
    );
    Ok(())
}
