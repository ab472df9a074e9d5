//! P3 Fig. 1: traffic by primitive, one primitive a leaf.

use xylem_core::node::Coordinates;
use xylem_core::probe::Stage;
use xylem_core::sort::RecordFormat;

use super::paper::p3;
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value, scenes, setup};
use crate::report::html::Source;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p3-fig1",
    place: "P3 Fig. 1",
    title: "Traffic of builds by primitive",
    needs_scenes: true,
    run,
};

const COLUMNS: [Column; 5] = [
    Column::new("sort_bytes", "input, sort", Source::Counted).places(1),
    Column::new("write_bytes", "nodes, leaves", Source::Counted).places(1),
    Column::new("pass_bytes", "separate pass", Source::Counted).places(1),
    Column::new("repair_bytes", "repairs", Source::Counted).places(1),
    Column::new("total_bytes", "all", Source::Counted).places(1),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let scenes = outcome.scenes(lab, &[&scenes::BUNNY])?;
    let single = |mut options: crate::run::BuildOptions| {
        options.config.max_leaf_size = 1;
        options
    };
    let streamed = |coordinates, depth| setup::function(setup::streamed(coordinates, depth));
    let mut packed = streamed(Coordinates::Modulo, 2);
    packed.config.sort.record = RecordFormat::Packed22;
    let rows = [
        ("separate pass", setup::separate(), Some(p3::FIG_1[0])),
        ("streamed, relative", streamed(Coordinates::Relative, 1), None),
        ("streamed, modulo", streamed(Coordinates::Modulo, 1), None),
        ("streamed, modulo, treelets", streamed(Coordinates::Modulo, 2), Some(p3::FIG_1[1])),
        ("the same, runs of 22 bytes", packed, None),
    ];
    for loaded in &scenes {
        let options = rows.map(|(_, options, _)| single(options));
        let builds = &lab.builds(std::slice::from_ref(loaded), &options)?[0];
        let caption = format!("Bytes a primitive: {}, one primitive a leaf", loaded.scene.name);
        let mut table = Table::new(caption, "build", COLUMNS);
        for ((name, _, paper), built) in rows.iter().zip(builds) {
            let each = |bytes: u64| bytes as f64 / built.primitives as f64;
            let stage = |stage| built.traffic.stage(stage).bytes();
            let sort = stage(Stage::PartialSort) + stage(Stage::Merge);
            let compress = stage(Stage::Compress);
            let is_pass = built.compressor.nodes == 0;
            let (pass, repairs) = if is_pass { (compress, 0) } else { (0, compress) };
            table.row(
                *name,
                [
                    Value::ours(each(sort)),
                    Value::ours(each(stage(Stage::Emit))),
                    Value::ours(each(pass)),
                    Value::ours(each(repairs)),
                    Value::new(Some(each(built.traffic.total().bytes())), *paper),
                ],
            );
        }
        outcome.tables.push(table);
    }
    outcome.configuration.push(setup::P3_TRAFFIC.to_owned());
    outcome.notes.push(
        "The paper's numbers are sums of what §5.2 states, as the figure itself is not part of the text: \
         40 bytes of input, 64 of sorting, 4 of leaf table, and 16 a node, or 64 written, 64 read and 16 \
         written."
            .to_owned(),
    );
    Ok(())
}
