//! The partial sort: one scratchpad of primitives in, one sorted run out.

use super::insertion::{MAX_BLOCK, insertion_sort};
use super::{Item, MultiMerge, PrimitiveReader, SortConfig, Workspace};
use crate::error::{BuildError, RegionName};
use crate::mem::{BurstWriter, Bus, Region};
use crate::probe::{Probe, Stage};

/// Turns the input into sorted runs of [`SortConfig::capacity`] records, one after the other in
/// `runs`.
///
/// As in P1 §4.4 and P2 §5.5: while a block of the input is read, insertion sorters put each piece
/// of two bursts in order; the merge heap then merges the pieces from the scratchpad.
///
/// # Errors
/// A bus error, an invalid primitive, or a run region that is too small.
pub(crate) fn partial_sort<B: Bus, P: Probe>(
    bus: &mut B,
    config: &SortConfig,
    workspace: &mut Workspace<'_>,
    reader: &PrimitiveReader,
    runs: Region,
    probe: &mut P,
) -> Result<(), BuildError<B::Error>> {
    probe.stage(Stage::PartialSort);
    let burst = (config.burst * config.record.bytes()) as usize;
    let mut writer = BurstWriter::new(runs, RegionName::RunsA, Stage::PartialSort, burst);
    let block = config.piece();
    let mut unsorted = [Item::ZERO; MAX_BLOCK];
    let mut item = Item::ZERO;
    let mut first = 0;
    while first < reader.count {
        let len = config.capacity.min(reader.count - first);
        for piece in (0..len).step_by(block as usize) {
            let end = len.min(piece + block);
            for start in (piece..end).step_by(config.burst as usize) {
                let stop = end.min(start + config.burst);
                let items = &mut unsorted[(start - piece) as usize..(stop - piece) as usize];
                reader.read(bus, Stage::PartialSort, first + start, items)?;
            }
            let sorted = &mut workspace.items[piece as usize..end as usize];
            insertion_sort(&unsorted[..sorted.len()], sorted, probe);
        }
        let mut merge =
            MultiMerge::over_blocks(config, workspace, reader.decoder.coder, len, probe)?;
        while merge.next(bus, &mut item, probe)? {
            config.record.push(&item, bus, &mut writer)?;
        }
        first += len;
    }
    writer.flush(bus)
}
