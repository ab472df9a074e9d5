//! P1 Table 1: memory words per primitive by sorting algorithm.

use super::paper::p1;
use super::{Column, Experiment, ExperimentError, Lab, Outcome, Table, Value};
use crate::report::html::Source;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p1-table1",
    place: "P1 Table 1",
    title: "Sorting algorithms in tree construction, words per primitive",
    needs_scenes: false,
    run,
};

const COLUMNS: [Column; 4] = [
    Column::new("read_words", "read", Source::Computed).places(0),
    Column::new("sort_words", "sort", Source::Computed).places(0),
    Column::new("write_words", "BVH", Source::Computed).places(0),
    Column::new("total_words", "total", Source::Computed).places(0),
];

/// Bytes of a word. The table's heading says 32 bytes; 32 bits are what its numbers are in.
const WORD: f64 = 4.0;
/// A triangle and its reference.
const PRIMITIVE: f64 = 40.0;
/// A Morton code and a reference; a box and a reference.
const RECORDS: [f64; 2] = [8.0, 28.0];
/// Two boxes and two pointers.
const NODE: f64 = 56.0;
/// Passes of a radix-16 sort over 32-bit keys, each of which reads twice and writes once.
const RADIX_MOVES: f64 = 3.0 * 32.0 / 4.0;

fn run(_: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let mut table = Table::new("Words of 32 bits per primitive", "sort", COLUMNS);
    for ((name, paper), ours) in p1::TABLE_1.into_iter().zip(rows()) {
        let values = [0, 1, 2, 3].map(|i| Value::both(ours[i], paper[i]));
        table.row(name, values);
    }
    outcome.tables.push(table);
    outcome.configuration.push(
        "Worked out from the sizes of records: triangles of 40 bytes, codes of 8 or boxes of 28 with \
         their reference, nodes of 56, radix-16 over 32 bits with two reads and a write a pass."
            .to_owned(),
    );
    outcome.notes.push(
        "The paper's heading says \"32B IO words\": its numbers are words of 32 bits. Where codes are \
         sorted, primitives are read again when the tree is written, 10 of the 24 words."
            .to_owned(),
    );
    Ok(())
}

/// Codes and boxes, each with the counting sort and with one and two merge passes.
fn rows() -> impl Iterator<Item = [f64; 4]> {
    RECORDS.into_iter().flat_map(|record| {
        [RADIX_MOVES, 2.0, 4.0].into_iter().map(move |moves| {
            let again = if record == RECORDS[0] { PRIMITIVE } else { 0.0 };
            let words = [PRIMITIVE, moves * record, NODE + again].map(|bytes| bytes / WORD);
            [words[0], words[1], words[2], words.iter().sum()]
        })
    })
}
