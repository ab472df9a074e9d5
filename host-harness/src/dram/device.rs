//! A channel's DRAM: banks, rows and legality. It holds no clock; `now` is always an argument.

use super::timing::{Command, RULES, Scope, Timing};

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
    /// For each command, when it was last issued, the latest first.
    history: [[Option<u64>; DEEPEST_WINDOW]; COMMANDS],
    open_banks: u32,
    /// When the first bank was opened after all were closed.
    active_since: u64,
    /// Clocks in which at least one bank was open, up to `active_since`.
    active_clocks: u64,
}

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
    /// A device with all banks closed and nothing to wait for.
    pub fn new(timing: &Timing, banks: u32) -> Self {
        let mut waits: [Vec<Wait>; COMMANDS] = Default::default();
        for rule in &RULES {
            let clocks = u64::from((rule.clocks)(timing));
            let window = rule.window.clamp(1, DEEPEST_WINDOW);
            waits[rule.previous as usize].push(Wait {
                next: rule.next,
                scope: rule.scope,
                window,
                clocks,
            });
        }
        Self {
            waits,
            banks: vec![Bank::default(); banks as usize],
            next: [0; COMMANDS],
            history: [[None; DEEPEST_WINDOW]; COMMANDS],
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
        history.rotate_right(1);
        history[0] = Some(now);
        for wait in &self.waits[command as usize] {
            let Some(start) = history[wait.window - 1] else { continue };
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
    }
}
