//! The rules of LPDDR3 written once more, the slow and obvious way, to check recorded commands by.

use xylem::dram::Issued;
use xylem::dram::timing::Command;

/// The waits of a speed grade in clocks, turnarounds worked out.
#[derive(Debug, Clone, Copy)]
pub struct Sheet {
    read_to_read: u64,
    read_to_write: u64,
    write_to_read: u64,
    activate_to_column: u64,
    activate_to_precharge: u64,
    activate_same_bank: u64,
    activate_other_bank: u64,
    four_activates: u64,
    read_to_precharge: u64,
    write_to_precharge: u64,
    precharge: u64,
    precharge_all: u64,
    refresh: u64,
    refresh_interval: u64,
    /// From a read or write command to its first beat.
    read_data: u64,
    write_data: u64,
}

/// LPDDR3-1600.
pub const LPDDR3_1600: Sheet = Sheet {
    read_to_read: 4,
    read_to_write: 13,
    write_to_read: 17,
    activate_to_column: 15,
    activate_to_precharge: 34,
    activate_same_bank: 48,
    activate_other_bank: 8,
    four_activates: 40,
    read_to_precharge: 6,
    write_to_precharge: 22,
    precharge: 15,
    precharge_all: 17,
    refresh: 168,
    refresh_interval: 3120,
    read_data: 14,
    write_data: 6,
};

/// LPDDR3-1333.
pub const LPDDR3_1333: Sheet = Sheet {
    read_to_read: 4,
    read_to_write: 11,
    write_to_read: 16,
    activate_to_column: 12,
    activate_to_precharge: 28,
    activate_same_bank: 40,
    activate_other_bank: 7,
    four_activates: 34,
    read_to_precharge: 5,
    write_to_precharge: 20,
    precharge: 12,
    precharge_all: 14,
    refresh: 140,
    refresh_interval: 2600,
    read_data: 12,
    write_data: 6,
};

const BANKS: u32 = 8;
const BURST_CLOCKS: u64 = 4;
/// Longer than any wait but the refresh interval.
const LOOK_BACK: u64 = 200;

/// Checks the commands of a channel of eight banks: every pair of them, the state of the banks, the
/// data bus, and that refreshes keep up.
///
/// # Errors
/// What is wrong with the first bad command.
pub fn check(commands: &[Issued], sheet: &Sheet) -> Result<(), String> {
    let mut open = [None; BANKS as usize];
    let (mut bus_free, mut refreshes) = (0, 0);
    for (i, now) in commands.iter().enumerate() {
        let fail = |what: &str| Err(format!("command {i}, {now:?}: {what}"));
        let bank = now.address.bank as usize;
        if bank >= BANKS as usize {
            return fail("no such bank");
        }
        match now.command {
            Command::Activate if open[bank].is_some() => return fail("the bank is open"),
            Command::Activate => open[bank] = Some(now.address.row),
            Command::Precharge if open[bank].is_none() => return fail("the bank is closed"),
            Command::Precharge => open[bank] = None,
            Command::PrechargeAll => open = Default::default(),
            Command::Read | Command::Write if open[bank] != Some(now.address.row) => {
                return fail("its row is not open");
            }
            Command::Read | Command::Write => {
                let delay = match now.command {
                    Command::Read => sheet.read_data,
                    _ => sheet.write_data,
                };
                if now.clock + delay < bus_free {
                    return fail("the data bus is busy");
                }
                bus_free = now.clock + delay + BURST_CLOCKS;
            }
            Command::Refresh if open.iter().any(Option::is_some) => return fail("a bank is open"),
            Command::Refresh => refreshes += 1,
        }
        // Eight refreshes may be put off; this controller never comes near.
        if refreshes + 2 < now.clock / sheet.refresh_interval {
            return fail("refreshes do not keep up");
        }
        let before = &commands[..i];
        for earlier in before.iter().rev().take_while(|c| c.clock + LOOK_BACK > now.clock) {
            let wait = sheet.wait(earlier, now);
            if now.clock < earlier.clock + wait {
                return fail(&format!("{wait} clocks must pass since {earlier:?}"));
            }
        }
        let activate = |c: &&Issued| c.command == Command::Activate;
        if now.command == Command::Activate
            && let Some(fourth) = before.iter().rev().filter(activate).nth(3)
            && now.clock < fourth.clock + sheet.four_activates
        {
            return fail("a fifth activate in the window of four");
        }
    }
    Ok(())
}

impl Sheet {
    /// The clocks that must lie between two commands; at least one, as there is one command bus.
    fn wait(&self, earlier: &Issued, later: &Issued) -> u64 {
        use Command::{Activate, Precharge, PrechargeAll, Read, Refresh, Write};
        let same_bank = earlier.address.bank == later.address.bank;
        match (earlier.command, later.command) {
            (Read, Read) | (Write, Write) => self.read_to_read,
            (Read, Write) => self.read_to_write,
            (Write, Read) => self.write_to_read,
            (Activate, Read | Write) if same_bank => self.activate_to_column,
            (Activate, Activate) if same_bank => self.activate_same_bank,
            (Activate, Activate) => self.activate_other_bank,
            (Activate, Precharge) if same_bank => self.activate_to_precharge,
            (Activate, PrechargeAll) => self.activate_to_precharge,
            (Read, Precharge) if same_bank => self.read_to_precharge,
            (Read, PrechargeAll) => self.read_to_precharge,
            (Write, Precharge) if same_bank => self.write_to_precharge,
            (Write, PrechargeAll) => self.write_to_precharge,
            (Precharge, Activate) if same_bank => self.precharge,
            (Precharge, Refresh) => self.precharge,
            (PrechargeAll, Activate | Refresh) => self.precharge_all,
            (Refresh, Activate | Refresh) => self.refresh,
            _ => 1,
        }
    }
}
