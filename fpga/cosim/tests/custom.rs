//! The inner steps as custom instructions of VexRiscv: results are the software's, and in fewer cycles.

use xylem_cosim::custom::{self, CustomError, Machine};
use xylem_cosim::tools_for;

#[test]
fn custom_instructions_give_the_software_s_results_in_fewer_cycles() {
    if !tools_for("custom_instructions_give_the_software_s_results_in_fewer_cycles") {
        return;
    }
    let machine = match Machine::new() {
        Err(error @ CustomError::Missing { .. }) => {
            assert!(std::env::var_os("XYLEM_REQUIRE_TOOLS").is_none(), "{error}");
            println!("skipped: custom instructions: {error}");
            return;
        }
        machine => machine.unwrap_or_else(|error| panic!("{error}")),
    };
    let scene = custom::view("sphereflake:0", 2).unwrap_or_else(|error| panic!("{error}"));
    let rows = custom::compare(&machine, &scene, 100_000_000);
    for row in rows.unwrap_or_else(|error| panic!("{error}")) {
        println!("{row:?}");
        assert!(row.accelerator < row.custom && row.custom < row.software, "{row:?}");
    }
}
