//! P2 Table I: memory traffic per primitive by sorting algorithm.

use xylem_core::pipeline::BuildConfig;
use xylem_core::sort::{RecordFormat, SortConfig};

use super::paper::p2;
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value, setup};
use crate::baseline::{PrimitiveTraffic, Sort, Sorted};
use crate::report::html::Source;
use crate::scene::procedural::DEFAULT_SCENE;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p2-table1",
    place: "P2 Table I",
    title: "Sorting algorithms in LBVH construction, bytes per primitive",
    needs_scenes: false,
    run,
};

const COLUMNS: [Column; 5] = [
    Column::new("read_bytes", "read", Source::Computed).places(0),
    Column::new("sort_bytes", "sort", Source::Computed).places(0),
    Column::new("tree_bytes", "BVH", Source::Computed).places(0),
    Column::new("total_bytes", "total", Source::Computed).places(0),
    Column::new("counted_bytes", "ours counted", Source::Counted).places(2),
];

const MERGE: [Sort; 2] = [Sort::MultiMerge { passes: 1 }, Sort::MultiMerge { passes: 2 }];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let rows = [Sorted::Codes, Sorted::Boxes].into_iter().flat_map(|sorted| {
        [Sort::RADIX_16, MERGE[0], MERGE[1]].into_iter().map(move |sort| (sorted, sort))
    });
    let mut table = Table::new("Bytes per primitive", "sort", COLUMNS);
    for ((name, paper), (sorted, sort)) in p2::TABLE_1.into_iter().zip(rows) {
        let row = PrimitiveTraffic::new(sorted, sort);
        let ours = [row.read_bytes, row.sort_bytes, row.tree_bytes, row.bytes()];
        let mut values: Vec<_> = ours
            .into_iter()
            .zip(paper)
            .map(|(ours, paper)| Value::both(ours as f64, paper))
            .collect();
        values.push(Value::new(counted(lab, sorted, sort)?, None));
        table.row(name, values);
    }
    outcome.tables.push(table);
    outcome.configuration.push(format!(
        "Worked out from the sizes of records; multimergesorts are also counted on the bus, per \
         primitive of the computed scene '{DEFAULT_SCENE}', with leaves of one (a tree has one node \
         less than leaves)."
    ));
    Ok(())
}

/// What our builder moves, where it sorts this way.
fn counted(lab: &Lab<'_>, sorted: Sorted, sort: Sort) -> Result<Option<f64>, ExperimentError> {
    let Sort::MultiMerge { passes } = sort else { return Ok(None) };
    let Some(mesh) = lab.mesh(DEFAULT_SCENE)? else { return Ok(None) };
    let record = match sorted {
        Sorted::Codes => RecordFormat::Pair8,
        Sorted::Boxes => RecordFormat::Box32,
    };
    // A scratchpad of 512 records merges 16 runs at a time, so that this scene takes two passes.
    let capacity = if passes == 1 { SortConfig::PAPER.capacity } else { 512 };
    let sort = SortConfig { capacity, record, ..SortConfig::PAPER };
    let config = BuildConfig { sort, max_leaf_size: 1, ..BuildConfig::default() };
    let count = mesh.triangles.len() as u32;
    if u64::from(config.further_passes(count)) + 1 != passes {
        return Ok(None);
    }
    let built = lab.build(&mesh, &setup::function(config))?;
    Ok(Some(built.traffic.total().bytes() as f64 / f64::from(count)))
}
