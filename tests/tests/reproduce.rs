//! The papers' tables, made again: what must agree with the papers.

use xylem::experiments::{Experiment, Lab, Outcome};

fn run(id: &str) -> Outcome {
    let lab = Lab::new(&|_| ());
    let experiment = Experiment::by_id(id).unwrap_or_else(|| panic!("no experiment {id}"));
    experiment.run(&lab).unwrap_or_else(|e| panic!("{id}: {e}"))
}

/// Asserts that ours is within `percent` of the paper's in some cells; says which models are not
/// there.
fn assert_within(outcome: &Outcome, percent: f64, cells: &[(&str, &str)]) {
    for (row, key) in cells {
        let value = outcome.value(row, key).unwrap_or_else(|| panic!("no {key} of {row}"));
        let Some(ours) = value.ours else {
            let scene = outcome.missing.iter().find(|missing| missing.scene == *row);
            let scene = scene.unwrap_or_else(|| panic!("{row} is neither here nor missing"));
            println!("skipped: {} {row}: {}", outcome.id, scene.why);
            continue;
        };
        let deviation = value.deviation_percent.unwrap_or_else(|| panic!("no paper's {row} {key}"));
        println!("{} {row} {key}: {ours:.3}, {deviation:+.1} %", outcome.id);
        assert!(deviation.abs() <= percent, "{row} {key}: {value:?}");
    }
}

/// Asserts that ours deviates from the paper's by a per cent in `range`, in one cell.
fn assert_between(outcome: &Outcome, range: [f64; 2], row: &str, key: &str) {
    let value = outcome.value(row, key).unwrap_or_else(|| panic!("no {key} of {row}"));
    match value.deviation_percent {
        Some(deviation) => {
            println!("{} {row} {key}: {deviation:+.1} %", outcome.id);
            assert!((range[0]..=range[1]).contains(&deviation), "{row} {key}: {value:?}");
        }
        None => assert_within(outcome, 0.0, &[(row, key)]),
    }
}

#[test]
fn traffic_is_the_papers() {
    let table = run("p2-table6");
    let ours = ["Bunny", "Cloth", "Crytek", "Dragon"];
    assert_within(&table, 2.0, &ours.map(|scene| (scene, "proposed_mib")));
    // Of the other builder there is a model of a model, over a tree of which details are not known.
    assert_within(&table, 8.0, &ours.map(|scene| (scene, "binned_mib")));
    let absent = table.value("Lion", "proposed_mib").unwrap();
    assert_eq!((absent.ours, absent.paper), (None, Some(230.1)));
    assert!(table.missing.iter().any(|missing| missing.scene == "Lion"));
}

#[test]
fn build_times_are_p1s() {
    let table = run("p1-table3");
    let cells =
        [("Sibenik", "ms_16"), ("Cloth", "ms_16"), ("Dragon", "ms_16"), ("Sibenik", "ms_32")];
    assert_within(&table, 15.0, &cells);
    // A top level over as many cells as P2's takes the cloth 8 % at 32 GB/s: see the table's notes.
    assert_within(&table, 15.0, &[("Dragon", "ms_32")]);
    assert_within(&table, 20.0, &[("Cloth", "ms_32")]);
}

#[test]
fn traffic_of_compressed_builds_is_p3s_or_less_where_fewer_nodes_are_repaired() {
    let table = run("p3-table3");
    let ours = ["Bunny", "Cloth", "Crytek", "Dragon"];
    assert_within(&table, 5.0, &ours.map(|scene| (scene, "separate_mib")));
    for scene in ours {
        for key in ["relative_mib", "relative_treelets_mib", "modulo_mib", "modulo_treelets_mib"] {
            // Below it for the better estimate; see the table's notes.
            assert_between(&table, [-15.0, 3.0], scene, key);
        }
    }
    for row in ours {
        let of = |key| refit_deviation(&table, row, key);
        for key in ["separate_mib", "relative_mib", "modulo_mib", "modulo_treelets_mib"] {
            let Some(deviation) = of(key) else { continue };
            println!("refit of {row}, {key}: {deviation:+.1} %");
            // The papers' cloth was repaired all over for its planes, and ours is not.
            let least = if row == "Cloth" { -40.0 } else { -20.0 };
            assert!((least..=5.0).contains(&deviation), "{row} {key}: {deviation}");
        }
    }
    let repairs = run("p3-table1");
    for scene in ours {
        let Some(value) = repairs.value(scene, "modulo_2") else { continue };
        assert!(value.ours.is_some_and(|ours| ours <= 0.06), "{scene}: {value:?}");
    }
}

fn refit_deviation(outcome: &Outcome, row: &str, key: &str) -> Option<f64> {
    let table = &outcome.tables[1];
    assert!(table.caption.starts_with("Refits"));
    let column = table.columns.iter().position(|column| column.key == key)?;
    let row = table.rows.iter().find(|r| r.name == row)?;
    row.values[column].deviation_percent
}

#[test]
fn times_of_compressed_builds_are_p3s() {
    let table = run("p3-table2");
    // The dragon takes half a minute; `xylem reproduce p3-table2` has it.
    for scene in ["Bunny", "Cloth", "Crytek"] {
        for key in ["exact_ms", "separate_ms", "modulo_treelets_ms"] {
            assert_within(&table, 15.0, &[(scene, key)]);
        }
        // Repairs find their lines in the controller's write queue; see the table's notes.
        assert_between(&table, [-40.0, 15.0], scene, "relative_ms");
        let ours = |key| table.value(scene, key).and_then(|value| value.ours);
        if let (Some(exact), Some(streamed)) = (ours("exact_ms"), ours("modulo_treelets_ms")) {
            assert!(streamed < exact, "{scene}: {streamed} ms, {exact} ms");
        }
    }
}

#[test]
fn sorting_moves_what_the_tables_say_and_the_builder_counts_as_much() {
    for (id, total) in [("p1-table1", "total_words"), ("p2-table1", "total_bytes")] {
        let table = run(id);
        let rows = &table.tables[0].rows;
        assert_eq!(rows.len(), 6);
        for row in rows {
            assert_eq!(table.value(&row.name, total).unwrap().deviation_percent, Some(0.0));
        }
    }
    let table = run("p2-table1");
    let counted = |row: &str| table.value(row, "counted_bytes").unwrap().ours;
    assert_eq!(counted("boxes, radix-16 counting sort"), None);
    for (row, bytes) in [
        ("codes, multimergesort, 1 pass", 148.0),
        ("codes, multimergesort, 2 passes", 164.0),
        ("boxes, multimergesort, 1 pass", 164.0),
        ("boxes, multimergesort, 2 passes", 228.0),
    ] {
        let counted = counted(row).unwrap();
        assert!((counted - bytes).abs() < 0.01, "{row}: {counted}");
    }
}
