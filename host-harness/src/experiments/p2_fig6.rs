//! P2 Fig. 6: how busy the units are over time on three memories.

use xylem_core::toplevel::Bins;

use super::utilisation::{self, Trace};
use super::{Experiment, ExperimentError, Lab, Outcome, scenes, setup};

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p2-fig6",
    place: "P2 Fig. 6",
    title: "Simulation traces of Sibenik on three memories",
    needs_scenes: true,
    run,
};

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let mut machine = setup::p2();
    machine.build = setup::with_binned(machine.build, Bins::Sixteen);
    let traces = setup::MEMORIES.map(|name| Trace {
        name,
        options: setup::clocked(machine, name),
        paper_bus: None,
    });
    for scene in outcome.scenes(lab, &[&scenes::SIBENIK])? {
        utilisation::draw(lab, outcome, &scene, &traces)?;
    }
    let configuration = [setup::P2_MACHINE, setup::P2_MEMORIES, setup::TOP_LEVEL];
    outcome.configuration.extend(configuration.map(str::to_owned));
    outcome.notes.push(
        "P2: limited by bandwidth on the slow bus; on the fast one by latencies and the rates of the \
         units, in the partial sorts above all. Multi-merge and emitter cap at 50 %, the emitter but \
         for runs of stack operations."
            .to_owned(),
    );
    Ok(())
}
