//! The `xylem` command.
fn main() {}
