//! Energy by DRAMPower's equations: currents of one die times voltages, commands and clocks.
//!
//! A command costs what it draws above standby for as long as it takes; standby costs what it draws
//! for all clocks, more of it while a row is open. Input, output and termination are not in it, and
//! no die ever powers down, as neither Ramulator's controller nor this one lets it.

use serde::Serialize;

use super::config::Config;
use super::stats::ChannelStats;

/// A current on rail 1 at 1.8 V and on rail 2 at 1.2 V, in mA.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Current(pub f64, pub f64);

impl Current {
    /// Power in mW, that is picojoules a nanosecond.
    fn milliwatts(self) -> f64 {
        self.0 * 1.8 + self.1 * 1.2
    }

    fn above(self, standby: Self) -> f64 {
        self.milliwatts() - standby.milliwatts()
    }
}

/// Currents of one x32 die, and the times for which DRAMPower applies them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Power {
    /// Where the figures are from.
    pub source: &'static str,
    /// One clock in nanoseconds.
    pub clock_ns: f64,
    /// IDD0: activate and precharge.
    pub idd0: Current,
    /// IDD2N: standby, all banks closed.
    pub idd2n: Current,
    /// IDD3N: standby, a bank open.
    pub idd3n: Current,
    /// IDD4R: read burst.
    pub idd4r: Current,
    /// IDD4W: write burst.
    pub idd4w: Current,
    /// IDD5: refresh.
    pub idd5: Current,
    /// Clocks of a burst.
    pub burst: u32,
    /// tRAS in clocks.
    pub ras: u32,
    /// tRC in clocks.
    pub rc: u32,
    /// tRP in clocks.
    pub rp: u32,
    /// tRFC in clocks.
    pub rfc: u32,
}

/// An LPDDR3-1600 die of 4 Gb.
pub const LPDDR3_1600_POWER: Power = Power {
    source: "DRAMPower's LPDDR3-1600 memspec, 4 Gb x32 dies, no I/O, no termination",
    clock_ns: 1.25,
    idd0: Current(15.0, 80.0),
    idd2n: Current(2.0, 38.0),
    idd3n: Current(2.0, 45.0),
    idd4r: Current(5.0, 260.0),
    idd4w: Current(10.0, 284.0),
    idd5: Current(40.0, 160.0),
    burst: 4,
    ras: 36,
    rc: 48,
    rp: 12,
    rfc: 104,
};

/// An LPDDR3-1333 die of 4 Gb; its memspec has a clock of 667 MHz.
pub const LPDDR3_1333_POWER: Power = Power {
    source: "DRAMPower's LPDDR3-1333 memspec, 4 Gb x32 dies, no I/O, no termination",
    clock_ns: 1e3 / 667.0,
    idd0: Current(15.0, 78.0),
    idd2n: Current(2.0, 36.0),
    idd3n: Current(2.0, 38.0),
    idd4r: Current(5.0, 243.0),
    idd4w: Current(10.0, 265.0),
    idd5: Current(40.0, 158.0),
    burst: 4,
    ras: 30,
    rc: 40,
    rp: 10,
    rfc: 87,
};

impl Power {
    /// An activate, in picojoules.
    pub fn activate_pj(&self) -> f64 {
        self.idd0.above(self.idd3n) * self.ns(self.ras)
    }

    /// A precharge, in picojoules.
    pub fn precharge_pj(&self) -> f64 {
        self.idd0.above(self.idd2n) * self.ns(self.rc.saturating_sub(self.ras))
    }

    /// A read burst, in picojoules.
    pub fn read_pj(&self) -> f64 {
        self.idd4r.above(self.idd3n) * self.ns(self.burst)
    }

    /// A write burst, in picojoules.
    pub fn write_pj(&self) -> f64 {
        self.idd4w.above(self.idd3n) * self.ns(self.burst)
    }

    /// A refresh of all banks, in picojoules.
    pub fn refresh_pj(&self) -> f64 {
        self.idd5.above(self.idd3n) * self.ns(self.rfc)
    }

    /// Standby with a bank open, in mW.
    pub fn active_mw(&self) -> f64 {
        self.idd3n.milliwatts()
    }

    /// Standby with all banks closed, in mW.
    pub fn precharged_mw(&self) -> f64 {
        self.idd2n.milliwatts()
    }

    /// Clocks of a refresh that count as active: DRAMPower holds the banks open until the last tRP.
    const fn refresh_active_clocks(&self) -> u64 {
        self.rfc.saturating_sub(self.rp) as u64
    }

    fn ns(&self, clocks: u32) -> f64 {
        f64::from(clocks) * self.clock_ns
    }
}

/// Energy of a memory over some time, in picojoules, by what it went into.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Energy {
    /// Where the currents are from.
    pub source: &'static str,
    /// Standby.
    pub background_pj: f64,
    /// Opening and closing rows.
    pub activate_pj: f64,
    /// Reading bursts.
    pub read_pj: f64,
    /// Writing bursts.
    pub write_pj: f64,
    /// Refreshes.
    pub refresh_pj: f64,
    /// Static energy: what the same memory would have used idle for as long, closed and refreshed.
    /// P2 §6 subtracts it from what is measured.
    pub idle_pj: f64,
}

impl Energy {
    /// Everything.
    pub fn total_pj(&self) -> f64 {
        self.background_pj + self.activate_pj + self.read_pj + self.write_pj + self.refresh_pj
    }

    /// What the work added to an idle memory.
    pub fn dynamic_pj(&self) -> f64 {
        self.total_pj() - self.idle_pj
    }

    /// What channels used that counted `channels` (each with the clocks in which a bank was open) in
    /// `clocks` clocks; `None` if there are no currents for this memory.
    pub(super) fn of(
        config: &Config,
        clocks: u64,
        channels: impl Iterator<Item = (ChannelStats, u64)>,
    ) -> Option<Self> {
        let power = config.power?;
        let ns = f64::from(config.timing.clock_ps) / 1e3;
        let standby_pj = |active: u64| {
            let active = active.min(clocks);
            let closed = clocks - active;
            (active as f64 * power.active_mw() + closed as f64 * power.precharged_mw()) * ns
        };
        let idle_refreshes = config.timing.refi.map_or(0, |refi| clocks / u64::from(refi.max(1)));
        let mut energy = Self {
            source: power.source,
            background_pj: 0.0,
            activate_pj: 0.0,
            read_pj: 0.0,
            write_pj: 0.0,
            refresh_pj: 0.0,
            idle_pj: 0.0,
        };
        let dies = f64::from(config.dies);
        for (stats, active) in channels {
            let refresh_active = |refreshes: u64| refreshes * power.refresh_active_clocks();
            energy.background_pj += dies * standby_pj(active + refresh_active(stats.refreshes));
            energy.activate_pj += dies
                * (stats.activates as f64 * power.activate_pj()
                    + stats.precharges as f64 * power.precharge_pj());
            energy.read_pj += dies * stats.read_bursts as f64 * power.read_pj();
            energy.write_pj += dies * stats.write_bursts as f64 * power.write_pj();
            energy.refresh_pj += dies * stats.refreshes as f64 * power.refresh_pj();
            energy.idle_pj += dies
                * (standby_pj(refresh_active(idle_refreshes))
                    + idle_refreshes as f64 * power.refresh_pj());
        }
        Some(energy)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Rounded as the figures are given.
    fn figures(power: &Power) -> [f64; 7] {
        [
            power.activate_pj().round(),
            power.precharge_pj().round(),
            power.read_pj().round(),
            power.write_pj().round(),
            power.refresh_pj().round(),
            (power.active_mw() * 10.0).round() / 10.0,
            (power.precharged_mw() * 10.0).round() / 10.0,
        ]
    }

    #[test]
    fn the_equations_give_drampowers_figures() {
        let at_1600 = [2943.0, 1107.0, 1317.0, 1506.0, 26832.0, 57.6, 49.2];
        assert_eq!(figures(&LPDDR3_1600_POWER), at_1600);
        let at_1333 = [3211.0, 1106.0, 1508.0, 1720.0, 27704.0, 49.2, 46.8];
        assert_eq!(figures(&LPDDR3_1333_POWER), at_1333);
    }

    #[test]
    fn a_memory_that_did_nothing_has_no_dynamic_energy() {
        let config = Config::by_name("slow").unwrap();
        let stats = ChannelStats { refreshes: 3, ..ChannelStats::default() };
        let energy = Energy::of(config, 3 * 3120, [(stats, 0)].into_iter()).unwrap();
        assert!(energy.dynamic_pj().abs() < 1.0, "{energy:?}");
        // Two dies: 9360 clocks of 1.25 ns at 49.2 mW, 8.4 mW more in 3 × 92 of them, 3 refreshes.
        let expected = 2.0 * (9360.0 * 1.25 * 49.2 + 3.0 * 92.0 * 1.25 * 8.4 + 3.0 * 26832.0);
        assert!((energy.total_pj() - expected).abs() < 1.0, "{energy:?}");
    }

    #[test]
    fn a_memory_without_currents_has_no_energy() {
        let config = Config::by_name("p1-16").unwrap();
        assert_eq!(Energy::of(config, 1000, [].into_iter()), None);
    }
}
