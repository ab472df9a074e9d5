//! P2 Table VII: what builds move in a second, and the power of the memory.

use super::p2_table3::SCENES;
use super::paper::p2;
use super::scenes::{BUNNY, CRYTEK};
use super::{Column, Experiment, ExperimentError, Lab, Loaded, Outcome, Table, Value, setup};
use crate::machine::config::MachineConfig;
use crate::report::html::Source;

/// The experiment.
pub const EXPERIMENT: Experiment = Experiment {
    id: "p2-table7",
    place: "P2 Table VII",
    title: "Bus utilisation and DRAM power",
    needs_scenes: true,
    run,
};

const COLUMNS: [Column; 4] = [
    Column::new("gb_per_s", "GB/s", Source::Modelled),
    Column::new("bus_percent", "bus %", Source::Modelled).places(1),
    Column::new("dram_mw", "DRAM mW", Source::Modelled).places(0),
    Column::new("pj_per_byte", "pJ/byte", Source::Modelled).places(1),
];

fn run(lab: &Lab<'_>, outcome: &mut Outcome) -> Result<(), ExperimentError> {
    let scenes = outcome.scenes(lab, &SCENES)?;
    let options = setup::MEMORIES.map(|memory| setup::clocked(setup::p2(), memory));
    let builds = lab.builds(&scenes, &options)?;
    let caption = format!("Means of {} models; the paper's of 14", scenes.len());
    let mut table = Table::new(caption, "memory", COLUMNS);
    for (i, paper) in p2::TABLE_7.iter().enumerate() {
        let runs = || builds.iter().filter_map(|row| row[i].clocked.as_ref());
        let power = || {
            runs().filter_map(|run| {
                let energy = run.memory.as_ref()?.energy?;
                Some(energy.dynamic_pj() / (run.milliseconds() * 1e6))
            })
        };
        let rate = mean(runs().map(|run| run.gb_per_s()));
        let milliwatts = mean(power());
        let per_byte = milliwatts.zip(rate).map(|(mw, gb)| mw / gb);
        let bus = mean(runs().filter_map(|run| run.bus_utilisation())).map(|share| 100.0 * share);
        table.row(
            format!("{}, {} GB/s", paper.memory, paper.peak_gb_per_s),
            [
                Value::new(rate, Some(paper.gb_per_s)),
                Value::new(bus, Some(paper.bus_percent)),
                Value::new(milliwatts, Some(paper.dram_mw)),
                Value::new(per_byte, Some(paper.dram_mw / paper.gb_per_s)),
            ],
        );
    }
    outcome.tables.push(table);
    outcome.tables.push(variations(lab, &scenes)?);
    outcome.configuration.extend([setup::P2_MACHINE.to_owned(), setup::P2_MEMORIES.to_owned()]);
    outcome.configuration.push(
        "Power: DRAMPower's equations, less an idle memory's; no I/O, no termination. Logic, 58 to \
         63 mW in the paper, is not modelled."
            .to_owned(),
    );
    outcome.notes.extend(NOTES.map(str::to_owned));
    Ok(())
}

const NOTES: [&str; 3] = [
    "The paper's GB are probably not 10^9 bytes. Its MB of traffic are 2^20; if its rates are such MB \
     over milliseconds, they are 4.9 % higher in GB/s: 9.65, 14.6 and 19.8, or 75, 57 and 46 % of the \
     buses. P3's times on 12.8 GB/s are 9.3 GB/s counted so and 9.6 counted as here.",
    "What remains is within the freedom that the paper leaves. On the wide buses it is the rate of the \
     insertion sorters and the lines read ahead, as the second table shows. On the narrow one it is \
     how many writes the controller gathers before it turns the bus round: with write queues of 8 \
     instead of Ramulator's 32 the bunny and Crytek use 78 and 74 % of the slow bus instead of 81 and \
     78. One port for reads and writes, reads answered in order, read queues of 8, another row-hit cap \
     or another FIFO move it by less than one point.",
    "Our input reader streams whole lines with 32 outstanding, and writes are posted; the paper's RTL \
     test bench passes transactions one by one into Ramulator, with latencies that it does not state.",
];

const VARIATION: [Column; 3] = [
    Column::new("slow_percent", "slow %", Source::Modelled).places(1),
    Column::new("medium_percent", "medium %", Source::Modelled).places(1),
    Column::new("fast_percent", "fast %", Source::Modelled).places(1),
];

/// Bus utilisation with one parameter changed.
fn variations(lab: &Lab<'_>, scenes: &[Loaded]) -> Result<Table, ExperimentError> {
    let small: Vec<Loaded> =
        scenes.iter().filter(|s| [&BUNNY, &CRYTEK].contains(&s.scene)).cloned().collect();
    let names: Vec<_> = small.iter().map(|loaded| loaded.scene.name).collect();
    let caption =
        format!("Bus utilisation with one parameter changed, mean of {}", names.join(", "));
    let mut table = Table::new(caption, "machine", VARIATION);
    let p2 = setup::p2();
    let mut single_writes = p2;
    single_writes.build.write_burst = 64;
    let machines: [(&str, MachineConfig); 5] = [
        ("as above", p2),
        ("4 insertion sorters, not 8", MachineConfig { sorters: 4, ..p2 }),
        ("4 lines read ahead, not 32", MachineConfig { read_ahead: 4, ..p2 }),
        ("8 lines read ahead, not 32", MachineConfig { read_ahead: 8, ..p2 }),
        ("nodes written in 64, not 512 bytes", single_writes),
    ];
    for (name, machine) in machines {
        let options = setup::MEMORIES.map(|memory| setup::clocked(machine, memory));
        let builds = lab.builds(&small, &options)?;
        let used = |i: usize| {
            let shares = builds.iter().filter_map(|row| row[i].clocked.as_ref()?.bus_utilisation());
            Value::new(mean(shares).map(|share| 100.0 * share), None)
        };
        table.row(name, [0, 1, 2].map(used));
    }
    Ok(table)
}

fn mean(values: impl Iterator<Item = f64>) -> Option<f64> {
    let (sum, count) = values.fold((0.0, 0u32), |(sum, count), x| (sum + x, count + 1));
    (count > 0).then(|| sum / f64::from(count))
}
