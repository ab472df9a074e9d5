//! `xylem dram`: traces of requests.

use super::place::{Place, number, whole};

#[test]
fn a_trace_of_requests_is_replayed_and_its_bytes_clocks_and_energy_are_told() {
    // One read of a closed row: 34 clocks of 1.25 ns; two dies, of which each activates once.
    let place = Place::new().with("one.trace", "0x1f40 R\n");
    let json = place.run(&["dram", "--trace", "one.trace", "--json"]).json();
    let keys = ["mem_cycles", "bytes", "row_hits", "row_misses", "row_conflicts"];
    assert_eq!(keys.map(|key| whole(&json, key)), [34, 64, 0, 1, 0]);
    assert!((number(&json, "gb_per_s") - 64.0 / (34.0 * 1.25)).abs() < 1e-9);
    assert!(number(&json, "energy_pj") > 2.0 * (2943.0 + 1317.0));
    assert!(json["energy"]["source"].as_str().is_some_and(|text| text.contains("DRAMPower")));
    let unpowered = ["dram", "--trace", "one.trace", "--memory", "p1-16", "--json"];
    assert!(place.run(&unpowered).json()["energy_pj"].is_null());
}

#[test]
fn bad_traces_of_requests_are_refused_at_their_line() {
    let place = Place::new().with("bad.trace", "0x0 R\n0x40 Q\n").with("empty.trace", "# none\n");
    place.run(&["dram", "--trace", "bad.trace"]).fails(&["bad.trace:2:", "0x40 Q", "neither R"]);
    place.run(&["dram", "--trace", "empty.trace"]).fails(&["empty.trace", "no request"]);
    place.run(&["dram", "--trace", "none.trace"]).fails(&["none.trace", "cannot read it"]);
    let unknown = ["dram", "--trace", "bad.trace", "--memory", "quick"];
    place.run(&unknown).fails_with(2, &["quick", "slow", "p1-32"]);
}
