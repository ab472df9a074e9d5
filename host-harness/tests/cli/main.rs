//! The `xylem` command as its users meet it: results, messages and exit codes.

mod build;
mod dram;
mod outputs;
mod place;
mod reproduce;
mod scenes;
mod soc;
mod trace;
mod usage;
