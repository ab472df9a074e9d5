//! Timing: what a memory's data sheet says, and the one table of rules that follow from it.
//!
//! A rule says how many clocks must lie between two commands. There is no timing anywhere else: the
//! [`Device`](super::Device) only applies [`RULES`].

/// A command on the command bus of a channel.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Command {
    /// Opens a row of a bank.
    Activate,
    /// Closes the row of a bank.
    Precharge,
    /// Closes the rows of all banks.
    PrechargeAll,
    /// Reads a burst from an open row.
    Read,
    /// Writes a burst to an open row.
    Write,
    /// Refreshes all banks, which must be closed.
    Refresh,
}

impl Command {
    /// All commands, each at the index that it has as a number.
    pub const ALL: [Self; 6] = [
        Self::Activate,
        Self::Precharge,
        Self::PrechargeAll,
        Self::Read,
        Self::Write,
        Self::Refresh,
    ];
}

/// Where the two commands of a rule meet.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Hash)]
pub enum Scope {
    /// Both go to the same bank.
    Bank,
    /// Both go to the same channel, whatever the bank. A channel has one rank.
    Channel,
}

/// A rule: `next` may be issued `clocks` after the `window`-th last `previous`, and no earlier.
#[derive(Debug, Clone, Copy)]
pub struct Rule {
    /// The name that data sheets use.
    pub name: &'static str,
    /// The command that starts the wait.
    pub previous: Command,
    /// The command that waits.
    pub next: Command,
    /// Where the two meet.
    pub scope: Scope,
    /// Which `previous` counts: 1 for the last, 4 for the fourth last.
    pub window: usize,
    /// The wait in clocks.
    pub clocks: fn(&Timing) -> u32,
}

/// What the data sheet says, in memory clocks.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// The name of the speed grade.
    pub name: &'static str,
    /// Where the figures are from.
    pub source: &'static str,
    /// One clock in picoseconds.
    pub clock_ps: u32,
    /// CL: read command to data, before the output delay.
    pub cl: u32,
    /// CWL: write command to data.
    pub cwl: u32,
    /// Half the burst length: the clocks for which a burst holds the data bus.
    pub burst: u32,
    /// tDQSCK: delay of the output, in whole clocks.
    pub dqsck: u32,
    /// tCCD: between column commands.
    pub ccd: u32,
    /// tRCD: row command to read.
    pub rcd: u32,
    /// Row command to write; tRCD, except where the model that is followed has its own.
    pub rcd_write: u32,
    /// tRPpb: precharge of one bank.
    pub rp: u32,
    /// tRPab: precharge of all banks.
    pub rp_all: u32,
    /// tRAS: the shortest time for which a row is open.
    pub ras: u32,
    /// tRC: between two activates of one bank.
    pub rc: u32,
    /// tRRD: between activates of different banks.
    pub rrd: u32,
    /// tFAW: in which there may be four activates.
    pub faw: u32,
    /// tWR: end of written data to precharge.
    pub wr: u32,
    /// tWTR: end of written data to read.
    pub wtr: u32,
    /// tRTP: read to precharge.
    pub rtp: u32,
    /// Idle clocks on the data bus between a read and a write.
    pub read_to_write_gap: u32,
    /// Clocks between a write and a read on top of tWTR.
    pub write_to_read_gap: u32,
    /// tREFI: between refreshes; `None` for a memory that is not refreshed.
    pub refi: Option<u32>,
    /// tRFCab: how long a refresh of all banks takes.
    pub rfc: u32,
}

impl Timing {
    /// Clocks from a read command to the end of its data.
    pub const fn read_latency(&self) -> u32 {
        self.cl + self.dqsck + self.burst
    }

    const fn read_to_write(&self) -> u32 {
        (self.cl + self.burst + self.dqsck + self.read_to_write_gap).saturating_sub(self.cwl)
    }

    const fn write_to_read(&self) -> u32 {
        self.cwl + self.burst + self.wtr + self.write_to_read_gap
    }

    const fn write_to_precharge(&self) -> u32 {
        self.cwl + self.burst + self.wr
    }
}

/// All rules: those of LPDDR3 with one rank, as Ramulator 1 has them.
#[rustfmt::skip]
pub const RULES: [Rule; 21] = {
    use Command::{Activate, Precharge, PrechargeAll, Read, Refresh, Write};
    use Scope::{Bank, Channel};
    [
        // The data bus.
        rule("tCCD", Read, Read, Channel, |t| t.ccd),
        rule("tCCD", Write, Write, Channel, |t| t.ccd),
        rule("tRTW", Read, Write, Channel, Timing::read_to_write),
        rule("tWTR", Write, Read, Channel, Timing::write_to_read),
        // Rows.
        rule("tRCD", Activate, Read, Bank, |t| t.rcd),
        rule("tRCD", Activate, Write, Bank, |t| t.rcd_write),
        rule("tRC", Activate, Activate, Bank, |t| t.rc),
        rule("tRRD", Activate, Activate, Channel, |t| t.rrd),
        Rule { window: 4, ..rule("tFAW", Activate, Activate, Channel, |t| t.faw) },
        // Precharge of one bank.
        rule("tRAS", Activate, Precharge, Bank, |t| t.ras),
        rule("tRTP", Read, Precharge, Bank, |t| t.rtp),
        rule("tWR", Write, Precharge, Bank, Timing::write_to_precharge),
        rule("tRPpb", Precharge, Activate, Bank, |t| t.rp),
        // Precharge of all banks.
        rule("tRAS", Activate, PrechargeAll, Channel, |t| t.ras),
        rule("tRTP", Read, PrechargeAll, Channel, |t| t.rtp),
        rule("tWR", Write, PrechargeAll, Channel, Timing::write_to_precharge),
        rule("tRPab", PrechargeAll, Activate, Channel, |t| t.rp_all),
        // Refresh.
        rule("tRPpb", Precharge, Refresh, Channel, |t| t.rp),
        rule("tRPab", PrechargeAll, Refresh, Channel, |t| t.rp_all),
        rule("tRFCab", Refresh, Activate, Channel, |t| t.rfc),
        rule("tRFCab", Refresh, Refresh, Channel, |t| t.rfc),
    ]
};

/// LPDDR3-1600, 8 Gb dies.
pub const LPDDR3_1600: Timing = Timing {
    name: "LPDDR3-1600",
    source: "Ramulator 1, LPDDR3 speed table",
    clock_ps: 1250,
    cl: 12,
    cwl: 6,
    burst: 4,
    dqsck: 2,
    ccd: 4,
    rcd: 15,
    rcd_write: 15,
    rp: 15,
    rp_all: 17,
    ras: 34,
    rc: 48,
    rrd: 8,
    faw: 40,
    wr: 12,
    wtr: 6,
    rtp: 6,
    read_to_write_gap: 1,
    write_to_read_gap: 1,
    refi: Some(3120),
    rfc: 168,
};

/// LPDDR3-1333, 8 Gb dies.
pub const LPDDR3_1333: Timing = Timing {
    name: "LPDDR3-1333",
    clock_ps: 1500,
    cl: 10,
    rcd: 12,
    rcd_write: 12,
    rp: 12,
    rp_all: 14,
    ras: 28,
    rc: 40,
    rrd: 7,
    faw: 34,
    wr: 10,
    wtr: 5,
    rtp: 5,
    refi: Some(2600),
    rfc: 140,
    ..LPDDR3_1600
};

/// GDDR3 at 1 GHz, in the clocks that GPGPU-Sim has for a Samsung K4J52324QH-HC12 at 800 MHz.
///
/// P1 §5 names "the GDDR3 memory controller model from GPGPU-Sim, configured as 1 GHz, 32-bit, dual
/// channel" and no more. Assumed: the clocks of GPGPU-Sim 3.x' Quadro FX 5800 configuration
/// (`nbk=8:CCD=2:RRD=8:RCD=12:RAS=25:RP=10:RC=35:CL=10:WL=7:CDLR=6:WR=11`, burst length 4), kept as
/// clocks at any frequency. GPGPU-Sim has no tFAW and no refresh, and derives read to write as
/// CL + 2 + 2 − WL, write to read as WL + 2 + CDLR, write to precharge as WL + 2 + WR and row to write
/// as RCD − WL − 1. No tRTP is given; taken as the burst's two clocks.
pub const GDDR3_1GHZ: Timing = Timing {
    name: "GDDR3 at 1 GHz",
    source: "GPGPU-Sim 3.x, Quadro FX 5800 (assumed to be P1's)",
    clock_ps: 1000,
    cl: 10,
    cwl: 7,
    burst: 2,
    dqsck: 0,
    ccd: 2,
    rcd: 12,
    rcd_write: 4,
    rp: 10,
    rp_all: 10,
    ras: 25,
    rc: 35,
    rrd: 8,
    faw: 0,
    wr: 11,
    wtr: 6,
    rtp: 2,
    read_to_write_gap: 2,
    write_to_read_gap: 0,
    refi: None,
    rfc: 0,
};

/// The same with the bus clock doubled, as P1 §5 does for 32 GB/s; all waits stay the same in clocks.
pub const GDDR3_2GHZ: Timing = Timing { name: "GDDR3 at 2 GHz", clock_ps: 500, ..GDDR3_1GHZ };

const fn rule(
    name: &'static str,
    previous: Command,
    next: Command,
    scope: Scope,
    clocks: fn(&Timing) -> u32,
) -> Rule {
    Rule { name, previous, next, scope, window: 1, clocks }
}
