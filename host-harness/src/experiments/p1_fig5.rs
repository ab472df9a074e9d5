//! P1 Fig. 5: how busy the units are over time at 32 GB/s.

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
    let trace =
        Trace { name: "32 GB/s", options: setup::clocked(setup::p1(), "p1-32"), paper_bus: None };
    for scene in outcome.scenes(lab, &[&scenes::SIBENIK])? {
        utilisation::draw(lab, outcome, &scene, std::slice::from_ref(&trace))?;
    }
    let configuration = [setup::P1_MACHINE, setup::P1_MEMORIES, setup::TOP_LEVEL];
    outcome.configuration.extend(configuration.map(str::to_owned));
    outcome.notes.push(
        "P1: what scales worst with bandwidth is merging blocks out during the partial sorts, where the \
         heap's record every two cycles is 16 GB/s."
            .to_owned(),
    );
    Ok(())
}
