//! The host side of Xylem: scenes, simulated memory and clocks, reports and the command line.

pub mod baseline;
pub mod bus;
pub mod cli;
pub mod dram;
pub mod experiments;
pub mod machine;
pub mod report;
pub mod run;
pub mod scene;
pub mod soc;
