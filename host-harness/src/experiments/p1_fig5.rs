//! P1 Fig. 5: how busy the units are over time at 32 GB/s.

use xylem_core::toplevel::Bins;

use super::utilisation::{self, Trace};
use super::{Experiment, ExperimentError, Lab, Outcome, scenes, setup};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p1-fig5",
    place: "P1 Fig. 5",
    title: "Simulation trace of Sibenik at 32 GB/s",
    needs_scenes: true,
    run,
};

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let machine = setup::p1();
    let trace =
        Trace { name: "32 GB/s", options: setup::clocked(machine, "p1-32"), paper_bus: None };
    for scene in outcome.scenes(lab, &[&scenes::SIBENIK])? {
        let top = setup::with_binned(machine.build, Bins::Eight);
        utilisation::draw(lab, outcome, &scene, std::slice::from_ref(&trace), &top)?;
    }
    outcome.configuration.extend([setup::P1_MACHINE.to_owned(), setup::P1_MEMORIES.to_owned()]);
    outcome.notes.push(
        "P1: what scales worst with bandwidth is merging blocks out during the partial sorts, where the \
         heap's record every two cycles is 16 GB/s."
            .to_owned(),
    );
    Ok(())
}
