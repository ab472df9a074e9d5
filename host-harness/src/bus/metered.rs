//! A bus that counts its traffic and the cycles it takes.

use std::cell::Cell;
use std::collections::BTreeMap;
use std::ops::AddAssign;

use serde::Serialize;
use xylem_core::error::RegionName;
use xylem_core::mem::{Bus, ByteAddr, Region};
use xylem_core::probe::{Probe, Stage};

/// How long a memory takes, in cycles of the accelerator's clock.
///
/// A **model**, not a memory controller: an access occupies the data bus for its bytes, and its
/// latency is shared by as many accesses as may be outstanding.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct MemoryTiming {
    /// The name that `--memory` takes.
    pub name: &'static str,
    /// What it stands for.
    pub about: &'static str,
    /// Clock of the accelerator in MHz; a cycle is one period of it.
    pub clock_mhz: u32,
    /// Peak transfer in tenths of a byte a cycle; 0 means without bound.
    pub deci_bytes_per_cycle: u32,
    /// Cycles from a request to its first byte.
    pub latency_cycles: u32,
    /// Accesses that overlap their latencies.
    pub outstanding: u32,
}

/// The memories to choose from.
///
/// Peak rates are those of P2 §6 (12.8, 25.6 and 42.7 GB/s), P3 §5.3 (12.8 GB/s) and P1 §5 (16 and
/// 32 GB/s) at 1 GHz; P1's latencies are taken to be P2's. The
/// latency is that of an unloaded, closed-row LPDDR3-1600 read of 64 bytes, 34 memory clocks or 42.5
/// ns; LPDDR3-1333 takes 29 clocks or 43.5 ns.
pub const MEMORIES: [MemoryTiming; 7] = [
    MemoryTiming {
        name: "ideal",
        about: "every access takes no time",
        clock_mhz: 1000,
        deci_bytes_per_cycle: 0,
        latency_cycles: 0,
        outstanding: 1,
    },
    MemoryTiming {
        name: "slow",
        about: "1 x 64 bit LPDDR3-1600, 12.8 GB/s",
        clock_mhz: 1000,
        deci_bytes_per_cycle: 128,
        latency_cycles: 43,
        outstanding: 8,
    },
    MemoryTiming {
        name: "medium",
        about: "2 x 64 bit LPDDR3-1600, 25.6 GB/s",
        clock_mhz: 1000,
        deci_bytes_per_cycle: 256,
        latency_cycles: 43,
        outstanding: 8,
    },
    MemoryTiming {
        name: "fast",
        about: "4 x 64 bit LPDDR3-1333, 42.7 GB/s",
        clock_mhz: 1000,
        deci_bytes_per_cycle: 427,
        latency_cycles: 44,
        outstanding: 8,
    },
    MemoryTiming {
        name: "p3",
        about: "2 x 32 bit LPDDR3-1600, 12.8 GB/s",
        clock_mhz: 1000,
        deci_bytes_per_cycle: 128,
        latency_cycles: 43,
        outstanding: 8,
    },
    MemoryTiming {
        name: "p1-16",
        about: "2 x 32 bit, 16 GB/s",
        clock_mhz: 1000,
        deci_bytes_per_cycle: 160,
        latency_cycles: 43,
        outstanding: 8,
    },
    MemoryTiming {
        name: "p1-32",
        about: "2 x 32 bit at twice the bus clock, 32 GB/s",
        clock_mhz: 1000,
        deci_bytes_per_cycle: 320,
        latency_cycles: 43,
        outstanding: 8,
    },
];

impl MemoryTiming {
    /// The memory of that name.
    pub fn by_name(name: &str) -> Option<&'static Self> {
        MEMORIES.iter().find(|memory| memory.name == name)
    }

    /// Thousandths of a cycle that an access of `bytes` bytes takes.
    fn millicycles(&self, bytes: u64) -> u64 {
        let transfer = (bytes * 10_000).checked_div(u64::from(self.deci_bytes_per_cycle));
        transfer.unwrap_or(0)
            + u64::from(self.latency_cycles) * 1000 / u64::from(self.outstanding.max(1))
    }
}

/// Accesses of one kind.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
pub struct Tally {
    /// Bytes read.
    pub read_bytes: u64,
    /// Bytes written.
    pub write_bytes: u64,
    /// Read bursts.
    pub reads: u64,
    /// Write bursts.
    pub writes: u64,
    /// Modelled time in thousandths of a cycle.
    pub millicycles: u64,
}

impl Tally {
    /// Bytes in both directions.
    pub const fn bytes(&self) -> u64 {
        self.read_bytes + self.write_bytes
    }
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        self.read_bytes += other.read_bytes;
        self.write_bytes += other.write_bytes;
        self.reads += other.reads;
        self.writes += other.writes;
        self.millicycles += other.millicycles;
    }
}

/// Traffic by stage and region. An access outside all named regions has no region.
#[derive(Debug, Clone, PartialEq, Eq, Default)]
pub struct Traffic {
    /// One tally for each stage and region that saw any.
    pub tallies: BTreeMap<(Stage, Option<&'static str>), Tally>,
}

impl AddAssign<&Self> for Traffic {
    fn add_assign(&mut self, other: &Self) {
        for (key, tally) in &other.tallies {
            *self.tallies.entry(*key).or_default() += *tally;
        }
    }
}

impl Traffic {
    /// Everything.
    pub fn total(&self) -> Tally {
        self.sum(|_, _| true)
    }

    /// Everything.in one stage.
    pub fn stage(&self, stage: Stage) -> Tally {
        self.sum(|s, _| s == stage)
    }

    /// Everything.in one region.
    pub fn region(&self, region: RegionName) -> Tally {
        self.sum(|_, name| name == Some(region.as_str()))
    }

    fn sum(&self, pick: impl Fn(Stage, Option<&'static str>) -> bool) -> Tally {
        let mut sum = Tally::default();
        for ((stage, region), tally) in &self.tallies {
            if pick(*stage, *region) {
                sum += *tally;
            }
        }
        sum
    }
}

/// The stage under way, shared between a probe that is told of it and buses that file by it.
#[derive(Debug)]
pub struct StageClock(Cell<Stage>);

impl Default for StageClock {
    fn default() -> Self {
        Self(Cell::new(Stage::PartialSort))
    }
}

impl StageClock {
    /// The stage last announced.
    pub fn now(&self) -> Stage {
        self.0.get()
    }
}

impl Probe for &StageClock {
    #[inline]
    fn stage(&mut self, stage: Stage) {
        self.0.set(stage);
    }
}

/// Wraps a bus and files each access under its stage and region.
#[derive(Debug)]
pub struct Metered<'a, B> {
    inner: B,
    stage: &'a StageClock,
    regions: Vec<(RegionName, Region)>,
    timing: MemoryTiming,
    /// Tallies by stage and region index, the last for accesses outside all regions.
    tallies: Vec<Tally>,
}

const STAGES: [Stage; 7] = [
    Stage::PartialSort,
    Stage::Merge,
    Stage::Emit,
    Stage::TopLevel,
    Stage::Compress,
    Stage::Refit,
    Stage::Trace,
];

impl<'a, B: Bus> Metered<'a, B> {
    /// A bus on `inner`; `regions` must not overlap.
    pub fn new(
        inner: B,
        stage: &'a StageClock,
        regions: &[(RegionName, Region)],
        timing: MemoryTiming,
    ) -> Self {
        let tallies = vec![Tally::default(); STAGES.len() * (regions.len() + 1)];
        Self { inner, stage, regions: regions.to_vec(), timing, tallies }
    }

    /// The wrapped bus.
    pub fn into_inner(self) -> B {
        self.inner
    }

    /// What was counted.
    pub fn traffic(&self) -> Traffic {
        let mut traffic = Traffic::default();
        let columns = self.regions.len() + 1;
        for (i, tally) in self.tallies.iter().enumerate() {
            if tally.reads + tally.writes > 0 {
                let region = self.regions.get(i % columns).map(|(name, _)| name.as_str());
                *traffic.tallies.entry((STAGES[i / columns], region)).or_default() += *tally;
            }
        }
        traffic
    }

    #[inline]
    fn tally(&mut self, addr: ByteAddr) -> &mut Tally {
        let column = self
            .regions
            .iter()
            .position(|(_, region)| addr >= region.base && addr.0 - region.base.0 < region.size);
        let stage = self.stage.now();
        let row = STAGES.iter().position(|s| *s == stage).unwrap_or(0);
        let columns = self.regions.len() + 1;
        &mut self.tallies[row * columns + column.unwrap_or(columns - 1)]
    }
}

impl<B: Bus> Bus for Metered<'_, B> {
    type Error = B::Error;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), B::Error> {
        self.inner.read(addr, buf)?;
        let millicycles = self.timing.millicycles(buf.len() as u64);
        let tally = self.tally(addr);
        tally.reads += 1;
        tally.read_bytes += buf.len() as u64;
        tally.millicycles += millicycles;
        Ok(())
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), B::Error> {
        self.inner.write(addr, bytes)?;
        let millicycles = self.timing.millicycles(bytes.len() as u64);
        let tally = self.tally(addr);
        tally.writes += 1;
        tally.write_bytes += bytes.len() as u64;
        tally.millicycles += millicycles;
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::super::FlatMemory;
    use super::*;

    #[test]
    fn accesses_are_filed_by_stage_and_region_and_add_up() {
        let stage = StageClock::default();
        let regions =
            [(RegionName::RunsA, Region::new(0, 64)), (RegionName::Nodes, Region::new(64, 64))];
        let slow = *MemoryTiming::by_name("slow").unwrap();
        let mut bus = Metered::new(FlatMemory::new(256), &stage, &regions, slow);
        bus.write(ByteAddr(0), &[0; 32]).unwrap();
        (&stage).stage(Stage::Emit);
        bus.write(ByteAddr(64), &[0; 64]).unwrap();
        bus.read(ByteAddr(128), &mut [0; 16]).unwrap();
        assert!(bus.read(ByteAddr(250), &mut [0; 16]).is_err());
        let traffic = bus.traffic();
        assert_eq!(traffic.stage(Stage::PartialSort).write_bytes, 32);
        assert_eq!(traffic.region(RegionName::Nodes).write_bytes, 64);
        assert_eq!(traffic.stage(Stage::Emit).bytes(), 80);
        assert_eq!(traffic.total().bytes(), 112);
        assert_eq!(traffic.tallies[&(Stage::Emit, None)].reads, 1);
    }

    #[test]
    fn an_access_takes_its_bytes_and_its_share_of_the_latency() {
        let slow = MemoryTiming::by_name("slow").unwrap();
        assert_eq!(slow.millicycles(128), 10_000 + 43_000 / 8);
        assert_eq!(MemoryTiming::by_name("ideal").unwrap().millicycles(1 << 20), 0);
        assert!(MemoryTiming::by_name("none").is_none());
    }
}
