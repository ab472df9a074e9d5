//! A channel's DRAM: banks, rows and legality. It holds no clock; `now` is always an argument.

use super::timing::{Command, RULES, Rule, Scope, Timing};

/// Where a command goes; commands to all banks ignore it, precharges use the bank alone.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default)]
pub struct Address {
    /// The bank.
    pub bank: u32,
    /// The row in the bank.
    pub row: u32,
    /// The burst in the row.
    pub column: u32,
}

/// Why a command is illegal.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum Illegal {
    /// A timing rule forbids it.
    #[error("{command:?} at clock {now}: not before clock {earliest}")]
    TooEarly {
        /// The command.
        command: Command,
        /// When it was to be issued.
        now: u64,
        /// When the rules allow it.
        earliest: u64,
    },
    /// The device does not have that bank.
    #[error("{command:?}: there is no bank {bank}")]
    NoBank {
        /// The command.
        command: Command,
        /// The bank.
        bank: u32,
    },
    /// The row that it needs is not open, or one is that must not be.
    #[error("{command:?}: bank {bank} has row {open:?} open")]
    WrongRow {
        /// The command.
        command: Command,
        /// The bank.
        bank: u32,
        /// Its open row.
        open: Option<u32>,
    },
}

/// The DRAM of one channel.
#[derive(Debug, Clone)]
pub struct Device {
    waits: [Vec<Wait>; COMMANDS],
    banks: Vec<Bank>,
    /// For each command, when the rules of the channel allow it.
    next: [u64; COMMANDS],
    /// For each command, whether a rule counts back further than the last.
    windowed: [bool; COMMANDS],
    /// For each of these, when the last ones were issued, the latest first.
    history: [[Option<u64>; DEEPEST_WINDOW - 1]; COMMANDS],
    open_banks: u32,
    /// When the first bank was opened after all were closed.
    active_since: u64,
    /// Clocks in which at least one bank was open, up to `active_since`.
    active_clocks: u64,
}

/// The most banks that a device has.
pub const MAX_BANKS: u32 = 64;

const COMMANDS: usize = Command::ALL.len();
const DEEPEST_WINDOW: usize = 4;

/// A rule for one timing set, filed under its previous command.
#[derive(Debug, Clone, Copy)]
struct Wait {
    next: Command,
    scope: Scope,
    window: usize,
    clocks: u64,
}

#[derive(Debug, Clone, Copy, Default)]
struct Bank {
    open: Option<u32>,
    next: [u64; COMMANDS],
}

impl Device {
    /// A device with all banks closed and nothing to wait for, of at most [`MAX_BANKS`] banks.
    pub fn new(timing: &Timing, banks: u32) -> Self {
        Self::with_rules(timing, banks, &RULES)
    }

    fn with_rules(timing: &Timing, banks: u32, rules: &[Rule]) -> Self {
        let mut waits: [Vec<Wait>; COMMANDS] = Default::default();
        let mut windowed = [false; COMMANDS];
        for rule in rules {
            let clocks = u64::from((rule.clocks)(timing));
            let window = rule.window.clamp(1, DEEPEST_WINDOW);
            windowed[rule.previous as usize] |= window > 1;
            waits[rule.previous as usize].push(Wait {
                next: rule.next,
                scope: rule.scope,
                window,
                clocks,
            });
        }
        Self {
            waits,
            banks: vec![Bank::default(); banks.clamp(1, MAX_BANKS) as usize],
            next: [0; COMMANDS],
            windowed,
            history: Default::default(),
            open_banks: 0,
            active_since: 0,
            active_clocks: 0,
        }
    }

    /// The first clock at which the timing rules allow a command, whatever rows are open.
    #[inline]
    pub fn earliest(&self, command: Command, address: Address) -> u64 {
        let channel = self.next[command as usize];
        match command {
            Command::PrechargeAll | Command::Refresh => channel,
            _ => match self.banks.get(address.bank as usize) {
                Some(bank) => channel.max(bank.next[command as usize]),
                None => u64::MAX,
            },
        }
    }

    /// The open row of a bank.
    #[inline]
    pub fn open_row(&self, bank: u32) -> Option<u32> {
        self.banks.get(bank as usize)?.open
    }

    /// How many banks have an open row.
    #[inline]
    pub fn open_banks(&self) -> u32 {
        self.open_banks
    }

    /// Clocks before `now` in which at least one bank was open.
    pub fn active_clocks(&self, now: u64) -> u64 {
        let running = if self.open_banks > 0 { now.saturating_sub(self.active_since) } else { 0 };
        self.active_clocks + running
    }

    /// Issues a command; returns how many rows it closed.
    ///
    /// # Errors
    /// [`Illegal`], and the device is as before.
    #[inline]
    pub fn issue(&mut self, command: Command, address: Address, now: u64) -> Result<u32, Illegal> {
        self.check(command, address, now)?;
        let was_open = self.open_banks;
        match command {
            Command::Activate => self.set_row(address.bank, Some(address.row)),
            Command::Precharge => self.set_row(address.bank, None),
            Command::PrechargeAll => self.banks.iter_mut().for_each(|bank| bank.open = None),
            Command::Read | Command::Write | Command::Refresh => {}
        }
        self.open_banks = match command {
            Command::Activate => was_open + 1,
            Command::Precharge => was_open.saturating_sub(1),
            Command::PrechargeAll => 0,
            _ => was_open,
        };
        if was_open == 0 && self.open_banks > 0 {
            self.active_since = now;
        } else if was_open > 0 && self.open_banks == 0 {
            self.active_clocks += now.saturating_sub(self.active_since);
        }
        self.start_waits(command, address, now);
        Ok(was_open.saturating_sub(self.open_banks))
    }

    fn set_row(&mut self, bank: u32, row: Option<u32>) {
        if let Some(bank) = self.banks.get_mut(bank as usize) {
            bank.open = row;
        }
    }

    #[inline]
    fn check(&self, command: Command, address: Address, now: u64) -> Result<(), Illegal> {
        let bank = address.bank;
        let open = match self.banks.get(bank as usize) {
            Some(bank) => bank.open,
            None => return Err(Illegal::NoBank { command, bank }),
        };
        let fits = match command {
            Command::Activate => open.is_none(),
            Command::Read | Command::Write => open == Some(address.row),
            Command::Refresh => self.open_banks == 0,
            Command::Precharge => open.is_some(),
            Command::PrechargeAll => true,
        };
        if !fits {
            return Err(Illegal::WrongRow { command, bank, open });
        }
        let earliest = self.earliest(command, address);
        if now < earliest {
            return Err(Illegal::TooEarly { command, now, earliest });
        }
        Ok(())
    }

    #[inline]
    fn start_waits(&mut self, command: Command, address: Address, now: u64) {
        let history = &mut self.history[command as usize];
        for wait in &self.waits[command as usize] {
            let start = match wait.window {
                1 => now,
                // The window of 2 begins with the one before this.
                n => match history[n - 2] {
                    Some(start) => start,
                    None => continue,
                },
            };
            let until = start + wait.clocks;
            let next = match wait.scope {
                Scope::Channel => &mut self.next,
                Scope::Bank => match self.banks.get_mut(address.bank as usize) {
                    Some(bank) => &mut bank.next,
                    None => continue,
                },
            };
            let next = &mut next[wait.next as usize];
            *next = until.max(*next);
        }
        if self.windowed[command as usize] {
            history.rotate_right(1);
            history[0] = Some(now);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::timing::{GDDR3_1GHZ, LPDDR3_1333, LPDDR3_1600};
    use super::Command::{Activate, Precharge, PrechargeAll, Read, Refresh, Write};
    use super::Scope::{Bank, Channel};
    use super::*;

    /// Every rule with its clocks at LPDDR3-1600 and -1333 and for GDDR3, worked out by hand from the
    /// data sheets' figures.
    #[rustfmt::skip]
    const EXPECTED: [(Command, Command, Scope, usize, [u64; 3]); 21] = [
        (Read, Read, Channel, 1, [4, 4, 2]),
        (Write, Write, Channel, 1, [4, 4, 2]),
        (Read, Write, Channel, 1, [13, 11, 7]),
        (Write, Read, Channel, 1, [17, 16, 15]),
        (Activate, Read, Bank, 1, [15, 12, 12]),
        (Activate, Write, Bank, 1, [15, 12, 4]),
        (Activate, Activate, Bank, 1, [48, 40, 35]),
        (Activate, Activate, Channel, 1, [8, 7, 8]),
        (Activate, Activate, Channel, 4, [40, 34, 0]),
        (Activate, Precharge, Bank, 1, [34, 28, 25]),
        (Read, Precharge, Bank, 1, [6, 5, 2]),
        (Write, Precharge, Bank, 1, [22, 20, 20]),
        (Precharge, Activate, Bank, 1, [15, 12, 10]),
        (Activate, PrechargeAll, Channel, 1, [34, 28, 25]),
        (Read, PrechargeAll, Channel, 1, [6, 5, 2]),
        (Write, PrechargeAll, Channel, 1, [22, 20, 20]),
        (PrechargeAll, Activate, Channel, 1, [17, 14, 10]),
        (Precharge, Refresh, Channel, 1, [15, 12, 10]),
        (PrechargeAll, Refresh, Channel, 1, [17, 14, 10]),
        (Refresh, Activate, Channel, 1, [168, 140, 0]),
        (Refresh, Refresh, Channel, 1, [168, 140, 0]),
    ];

    /// Issues what must come first, all at one clock, so that only timing can forbid the command.
    fn prepare(device: &mut Device, command: Command, address: Address, now: u64) {
        let open = device.open_row(address.bank).is_some();
        let first = match command {
            Activate if open => Precharge,
            Precharge | Read | Write if !open => Activate,
            Refresh if device.open_banks() > 0 => PrechargeAll,
            _ => return,
        };
        device.issue(first, address, now).unwrap();
    }

    fn at(bank: u32) -> Address {
        Address { bank, row: 3, column: 0 }
    }

    /// A device that knows that rule alone, after the commands that start it, the first at 1000.
    fn after_previous(rule: &Rule, timing: &Timing) -> Device {
        let mut device = Device::with_rules(timing, 8, std::slice::from_ref(rule));
        for i in 0..rule.window as u32 {
            prepare(&mut device, rule.previous, at(i), 0);
            device.issue(rule.previous, at(i), 1000 + u64::from(i)).unwrap();
        }
        device
    }

    /// When that device allows the next command on a bank, and whether not a clock earlier.
    fn first_legal(rule: &Rule, timing: &Timing, bank: u32) -> (u64, bool) {
        let mut device = after_previous(rule, timing);
        prepare(&mut device, rule.next, at(bank), 1000);
        let earliest = device.earliest(rule.next, at(bank));
        let early = device.clone().issue(rule.next, at(bank), earliest.saturating_sub(1));
        device.issue(rule.next, at(bank), earliest).unwrap();
        (earliest, matches!(early, Err(Illegal::TooEarly { .. })))
    }

    #[test]
    fn every_rule_forbids_the_clock_before_and_allows_the_clock() {
        assert_eq!(RULES.len(), EXPECTED.len());
        let timings = [LPDDR3_1600, LPDDR3_1333, GDDR3_1GHZ];
        for (rule, (previous, next, scope, window, clocks)) in RULES.iter().zip(EXPECTED) {
            let found = (rule.previous, rule.next, rule.scope, rule.window);
            assert_eq!(found, (previous, next, scope, window), "{}", rule.name);
            for (timing, clocks) in timings.iter().zip(clocks) {
                let case = format!("{} {previous:?} to {next:?}, {}", rule.name, timing.name);
                let (earliest, refused) =
                    first_legal(rule, timing, if scope == Bank { 0 } else { 7 });
                assert_eq!(earliest, 1000 + clocks, "{case}");
                assert!(refused, "{case}");
            }
        }
    }

    #[test]
    fn rules_of_a_bank_leave_other_banks_alone() {
        for rule in RULES.iter().filter(|rule| rule.scope == Bank) {
            let device = after_previous(rule, &LPDDR3_1600);
            assert_eq!(
                device.earliest(rule.next, at(7)),
                0,
                "{} {:?} to {:?}",
                rule.name,
                rule.previous,
                rule.next
            );
        }
    }

    #[test]
    fn rules_of_the_channel_hold_in_the_same_bank_too() {
        let one_bank = |rule: &&Rule| rule.scope == Channel && rule.window == 1;
        for rule in RULES.iter().filter(one_bank) {
            let (same, _) = first_legal(rule, &LPDDR3_1600, 0);
            let (other, _) = first_legal(rule, &LPDDR3_1600, 7);
            assert_eq!(same, other, "{} {:?} to {:?}", rule.name, rule.previous, rule.next);
        }
    }

    #[test]
    fn a_refused_command_changes_nothing() {
        let mut device = Device::new(&LPDDR3_1600, 8);
        let address = Address { bank: 1, row: 5, column: 0 };
        device.issue(Activate, address, 10).unwrap();
        let before = format!("{device:?}");
        let other = Address { row: 6, ..address };
        let refused = [
            (Read, address, 24),
            (Read, other, 25),
            (Activate, other, 1000),
            (Precharge, Address { bank: 2, ..address }, 1000),
            (Refresh, address, 1000),
            (Activate, Address { bank: 8, ..address }, 1000),
        ];
        for (command, address, now) in refused {
            device.issue(command, address, now).unwrap_err();
            assert_eq!(format!("{device:?}"), before, "{command:?}");
        }
        device.issue(Read, address, 25).unwrap();
    }

    #[test]
    fn clocks_with_an_open_bank_are_counted() {
        let mut device = Device::new(&LPDDR3_1600, 8);
        device.issue(Activate, at(0), 100).unwrap();
        device.issue(Activate, at(1), 108).unwrap();
        assert_eq!(device.active_clocks(110), 10);
        assert_eq!(device.issue(Precharge, at(0), 150), Ok(1));
        assert_eq!(device.issue(PrechargeAll, at(0), 200), Ok(1));
        assert_eq!(device.active_clocks(1000), 100);
    }
}
