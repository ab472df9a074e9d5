//! `xylem reproduce`: published tables and figures.

use std::fs;

use super::place::{Place, number};

#[test]
fn experiments_without_models_run_and_the_others_say_what_is_missing() {
    let place = Place::new();
    let table = place.run(&["reproduce", "p1-table1", "p2-table1", "--json"]).json();
    let experiments = table["experiments"].as_array().expect("experiments");
    assert_eq!(experiments.len(), 2);
    let row = &experiments[1]["tables"][0]["rows"][4]["total_bytes"];
    let found = ["ours", "paper", "deviation_percent"].map(|key| number(row, key));
    assert_eq!(found, [164.0, 164.0, 0.0]);
    assert!(place.files().is_empty(), "tables alone leave no files");

    let figure = place.run(&["reproduce", "p1-fig4", "--out", "out"]);
    assert_eq!(figure.code(), Some(1));
    let message = figure.message();
    for part in ["p1-fig4", "none of the models is at hand", "XYLEM_SCENES", "scenes/fetch.sh"] {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
    assert!(figure.out().contains("no mesh 'sibenik'"), "{}", figure.out());
    let page = fs::read_to_string(place.path("out/index.html")).expect("a page");
    assert!(page.contains("P1 Fig. 4") && page.contains("Missing: Sibenik"));
}

#[test]
fn experiments_are_listed_and_unknown_ones_refused() {
    let place = Place::new();
    let list = place.run(&["reproduce", "--list", "--json"]).json();
    let ids: Vec<_> =
        list["experiments"].as_array().expect("a list").iter().map(|e| e["id"].as_str()).collect();
    assert!(ids.contains(&Some("p2-table6")) && ids.len() >= 11, "{ids:?}");
    assert!(place.run(&["reproduce"]).out().contains("P2 Table VI"));
    place.run(&["reproduce", "p9-table1"]).fails_with(2, &["p9-table1"]);
    place.run(&["reproduce", "--all", "p1-table1"]).fails_with(2, &["--all"]);
}
