//! P1 Fig. 4: how busy the units are over time at 16 GB/s.

use super::paper::p1;
use super::utilisation::{self, Trace};
use super::{Experiment, ExperimentError, Lab, Outcome, scenes, setup};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p1-fig4",
    place: "P1 Fig. 4",
    title: "Simulation trace of Sibenik at 16 GB/s",
    needs_scenes: true,
    run,
};

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let trace = Trace {
        name: "16 GB/s",
        options: setup::clocked(setup::p1(), "p1-16"),
        paper_bus: Some(p1::BUS_PERCENT[0]),
    };
    for scene in outcome.scenes(lab, &[&scenes::SIBENIK])? {
        utilisation::draw(lab, outcome, &scene, std::slice::from_ref(&trace))?;
    }
    let configuration = [setup::P1_MACHINE, setup::P1_MEMORIES, setup::TOP_LEVEL];
    outcome.configuration.extend(configuration.map(str::to_owned));
    outcome.notes.push(
        "P1: most of the time is the multi-merge, limited by memory, with the heap at less than a third \
         of what it can do, which is 50 % here; partial sorts alternate between sorters and heap."
            .to_owned(),
    );
    Ok(())
}
