//! P3 Fig. 7: how deep repairs go.

use xylem_core::node::Coordinates;

use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value, scenes, setup};
use crate::report::html::Source;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p3-fig7",
    place: "P3 Fig. 7",
    title: "Repairs by depth below the node that asks for them",
    needs_scenes: true,
    run,
};

const COLUMNS: [Column; 6] = [
    Column::new("depth_1", "1", Source::Counted).places(0),
    Column::new("depth_2", "2", Source::Counted).places(0),
    Column::new("depth_3", "3", Source::Counted).places(0),
    Column::new("depth_4", "4", Source::Counted).places(0),
    Column::new("depth_5", "5", Source::Counted).places(0),
    Column::new("deeper", "deeper", Source::Counted).places(0),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let models =
        [&scenes::ELEPHANT, &scenes::BUNNY, &scenes::CLOTH, &scenes::CRYTEK, &scenes::DRAGON];
    let scenes = outcome.scenes(lab, &models)?;
    let ways = [
        (Coordinates::Relative, 0, "Relative coordinates, P3's estimate"),
        (Coordinates::Modulo, 0, "Modulo coordinates, P3's estimate"),
        (Coordinates::Relative, 1, "Relative coordinates, with a margin"),
        (Coordinates::Modulo, 1, "Modulo coordinates, with a margin"),
    ];
    let options = ways.map(|(coordinates, margin, _)| {
        let mut config = setup::streamed(coordinates, 1);
        if let Some(compression) = &mut config.compression {
            compression.margin = margin;
        }
        setup::function(config)
    });
    let builds = lab.builds(&scenes, &options)?;
    for (i, (_, _, caption)) in ways.iter().enumerate() {
        let mut table = Table::new(*caption, "scene", COLUMNS);
        for (loaded, builds) in scenes.iter().zip(&builds) {
            let depths = &builds[i].compressor.backtracks_by_depth;
            let (few, deeper) = depths.split_at(COLUMNS.len() - 1);
            let counts = few.iter().copied().chain([deeper.iter().sum()]);
            let values = counts.map(|count| Value::ours(count as f64));
            table.scene(loaded.scene, Some(builds[i].primitives), values.collect::<Vec<_>>());
        }
        outcome.tables.push(table);
    }
    outcome.configuration.push(setup::P3_TRAFFIC.to_owned());
    outcome.notes.push(
        "The paper draws its Elephant, without numbers. As there, most repairs end a level or two down; with \
         a margin in the estimate nearly all do."
            .to_owned(),
    );
    Ok(())
}
