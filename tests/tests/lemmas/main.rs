//! The lemmas of the proof of watertightness (`xylem_core::traverse::watertight`), each on all of a
//! small domain or on all classes of a large one, with the core's own functions.
//!
//! `tests/proof/lemmas.py` proves the same lemmas at full width with a solver.

mod boxes;
mod distances;
mod verdicts;
