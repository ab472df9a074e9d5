//! The named memories, every parameter of each in one place.

use super::energy::{LPDDR3_1333_POWER, LPDDR3_1600_POWER, Power};
use super::mapping::Mapping;
use super::timing::{GDDR3_1GHZ, GDDR3_2GHZ, LPDDR3_1333, LPDDR3_1600, Timing};

/// A memory and its controllers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Config {
    /// The name that `--memory` takes.
    pub name: &'static str,
    /// What it stands for.
    pub about: &'static str,
    /// Clocks of the DRAM.
    pub timing: Timing,
    /// Channels, banks, rows and columns.
    pub mapping: Mapping,
    /// Dies of a channel, each with its own currents.
    pub dies: u32,
    /// Currents of a die; `None` where no source has them.
    pub power: Option<Power>,
    /// What the controller of each channel does.
    pub controller: ControllerConfig,
}

/// What the controller of a channel does.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ControllerConfig {
    /// Reads that may wait.
    pub read_queue: usize,
    /// Writes that may wait.
    pub write_queue: usize,
    /// More waiting writes than this begin a drain; one also begins when no read waits.
    pub drain_above: usize,
    /// Fewer waiting writes than this end a drain if a read waits.
    pub drain_below: usize,
    /// Once more than this many bursts have used an open row, its hits lose their precedence.
    pub row_hit_cap: u32,
}

/// Ramulator 1's controller: drains begin above int(0.8 · 32) and end below int(0.2 · 32).
pub const CONTROLLER: ControllerConfig = ControllerConfig {
    read_queue: 32,
    write_queue: 32,
    drain_above: 25,
    drain_below: 6,
    row_hit_cap: 16,
};

/// The memories to choose from.
///
/// `slow`, `medium` and `fast` are P2 §6's, `p3` is P3 §5.3's, `p1-16` and `p1-32` are P1 §5's. All
/// have the controller of Ramulator 1; P1's GPGPU-Sim had one queue of 16 requests a channel.
pub const CONFIGS: [Config; 6] = [SLOW, MEDIUM, FAST, P3, P1_16, P1_32];

const SLOW: Config = Config {
    name: "slow",
    about: "1 x 64 bit LPDDR3-1600, 12.8 GB/s",
    timing: LPDDR3_1600,
    mapping: Mapping { channels: 1, banks: 8, rows: 32768, row_bytes: 8192, burst_bytes: 64 },
    dies: 2,
    power: Some(LPDDR3_1600_POWER),
    controller: CONTROLLER,
};

const MEDIUM: Config = Config {
    name: "medium",
    about: "2 x 64 bit LPDDR3-1600, 25.6 GB/s",
    mapping: Mapping { channels: 2, ..SLOW.mapping },
    ..SLOW
};

const FAST: Config = Config {
    name: "fast",
    about: "4 x 64 bit LPDDR3-1333, 42.7 GB/s",
    timing: LPDDR3_1333,
    mapping: Mapping { channels: 4, ..SLOW.mapping },
    power: Some(LPDDR3_1333_POWER),
    ..SLOW
};

const P3: Config = Config {
    name: "p3",
    about: "2 x 32 bit LPDDR3-1600, 12.8 GB/s",
    mapping: Mapping { channels: 2, row_bytes: 4096, burst_bytes: 32, ..SLOW.mapping },
    dies: 1,
    ..SLOW
};

/// 512 Mb dies: eight banks of 4096 rows of 2 KiB, after GPGPU-Sim's address mapping.
const P1_16: Config = Config {
    name: "p1-16",
    about: "2 x 32 bit GDDR3 at 1 GHz, 16 GB/s",
    timing: GDDR3_1GHZ,
    mapping: Mapping { channels: 2, banks: 8, rows: 4096, row_bytes: 2048, burst_bytes: 16 },
    dies: 1,
    power: None,
    controller: CONTROLLER,
};

const P1_32: Config = Config {
    name: "p1-32",
    about: "2 x 32 bit GDDR3 at 2 GHz, 32 GB/s",
    timing: GDDR3_2GHZ,
    ..P1_16
};

impl Config {
    /// The memory of that name.
    pub fn by_name(name: &str) -> Option<&'static Self> {
        // A static, so that a reference into it lives on.
        static ALL: [Config; 6] = CONFIGS;
        ALL.iter().find(|config| config.name == name)
    }

    /// Frequency of the memory clock in MHz; data moves on both of its edges.
    pub fn clock_mhz(&self) -> f64 {
        1e6 / f64::from(self.timing.clock_ps)
    }

    /// How long so many memory clocks take, in nanoseconds.
    pub fn nanoseconds(&self, clocks: u64) -> f64 {
        clocks as f64 * f64::from(self.timing.clock_ps) / 1e3
    }

    /// What all data buses together could move, in GB/s (10⁹ bytes a second).
    pub fn peak_gb_per_s(&self) -> f64 {
        let bytes = f64::from(self.mapping.channels * self.mapping.burst_bytes);
        bytes / f64::from(self.timing.burst) / f64::from(self.timing.clock_ps) * 1e3
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn peak_rates_are_the_papers() {
        let peaks = CONFIGS.map(|config| (config.name, (config.peak_gb_per_s() * 10.0).round()));
        let expected = [128.0, 256.0, 427.0, 128.0, 160.0, 320.0];
        assert_eq!(peaks.map(|(_, peak)| peak), expected, "{peaks:?}");
        let clocks = CONFIGS.map(|config| config.clock_mhz().round());
        assert_eq!(clocks, [800.0, 800.0, 667.0, 800.0, 1000.0, 2000.0]);
    }

    #[test]
    fn names_find_their_memories() {
        for config in CONFIGS {
            assert_eq!(Config::by_name(config.name), Some(&config));
        }
        assert_eq!(Config::by_name("none"), None);
    }
}
