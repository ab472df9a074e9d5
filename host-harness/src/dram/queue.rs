//! Requests that wait in a controller, and which of them is next.

use super::device::{Address, Device};
use super::timing::Command;

/// A request in a queue.
#[derive(Debug, Clone, Copy)]
pub(super) struct Waiting {
    pub addr: u64,
    pub write: bool,
    pub tag: u64,
    /// Where its next burst is.
    pub address: Address,
    pub bursts_left: u32,
    /// Whether a command was issued for it.
    pub started: bool,
    /// How many requests came before it.
    pub arrival: u64,
}

/// Requests that wait, the oldest first.
#[derive(Debug, Clone)]
pub(super) struct Queue {
    waiting: Vec<Waiting>,
    capacity: usize,
    /// Counts that save looks at the requests.
    banks: Vec<Bank>,
}

/// What the requests of a bank need.
#[derive(Debug, Clone, Copy, Default)]
struct Bank {
    row: Option<u32>,
    /// Requests of the open row.
    hits: u32,
    /// Requests of other rows.
    others: u32,
}

/// The row-hit cap: which open rows have used up their hits.
#[derive(Debug, Clone)]
pub(super) struct RowUses {
    uses: Vec<u32>,
    cap: u32,
}

impl RowUses {
    pub fn new(banks: u32, cap: u32) -> Self {
        Self { uses: vec![0; banks as usize], cap }
    }

    pub fn reset(&mut self, bank: u32) {
        self.uses.get_mut(bank as usize).into_iter().for_each(|uses| *uses = 0);
    }

    pub fn count(&mut self, bank: u32) {
        self.uses.get_mut(bank as usize).into_iter().for_each(|uses| *uses += 1);
    }

    #[inline]
    pub fn spent(&self, bank: u32) -> bool {
        self.uses.get(bank as usize).is_some_and(|uses| *uses > self.cap)
    }
}

impl Waiting {
    /// The command that it needs next, given the open row of its bank.
    #[inline]
    pub fn needs(&self, open: Option<u32>) -> Command {
        match open {
            None => Command::Activate,
            Some(row) if row != self.address.row => Command::Precharge,
            Some(_) if self.write => Command::Write,
            Some(_) => Command::Read,
        }
    }
}

impl Queue {
    pub fn new(capacity: usize, banks: u32) -> Self {
        let waiting = Vec::with_capacity(capacity);
        Self { waiting, capacity, banks: vec![Bank::default(); banks as usize] }
    }

    pub fn len(&self) -> usize {
        self.waiting.len()
    }

    pub fn is_empty(&self) -> bool {
        self.waiting.is_empty()
    }

    pub fn is_full(&self) -> bool {
        self.waiting.len() >= self.capacity
    }

    pub fn get(&self, index: usize) -> Option<&Waiting> {
        self.waiting.get(index)
    }

    pub fn get_mut(&mut self, index: usize) -> Option<&mut Waiting> {
        self.waiting.get_mut(index)
    }

    /// Files a request behind those that arrived before it.
    pub fn insert(&mut self, request: Waiting) {
        let younger = self.waiting.iter().rev().take_while(|other| other.arrival > request.arrival);
        let at = self.waiting.len() - younger.count();
        self.waiting.insert(at, request);
        if let Some(bank) = self.banks.get_mut(request.address.bank as usize) {
            *bank.count(request.address.row) += 1;
        }
    }

    pub fn remove(&mut self, index: usize) -> Option<Waiting> {
        let request = (index < self.waiting.len()).then(|| self.waiting.remove(index))?;
        if let Some(bank) = self.banks.get_mut(request.address.bank as usize) {
            let count = bank.count(request.address.row);
            *count = count.saturating_sub(1);
        }
        Some(request)
    }

    /// Whether a write of that address waits.
    pub fn writes_to(&self, addr: u64) -> bool {
        self.waiting.iter().any(|request| request.addr == addr && request.write)
    }

    /// Notes that a bank was closed.
    pub fn row_closed(&mut self, bank: u32) {
        if let Some(bank) = self.banks.get_mut(bank as usize) {
            *bank = Bank { row: None, hits: 0, others: bank.hits + bank.others };
        }
    }

    /// Notes that a row of a closed bank was opened.
    pub fn row_opened(&mut self, address: Address) {
        let Some(bank) = self.banks.get_mut(address.bank as usize) else { return };
        let hit = |request: &&Waiting| {
            (request.address.bank, request.address.row) == (address.bank, address.row)
        };
        let hits = match bank.others {
            0 => 0,
            _ => self.waiting.iter().filter(hit).count() as u32,
        };
        *bank = Bank { row: Some(address.row), hits, others: bank.others.saturating_sub(hits) };
    }

    /// The oldest request whose next command is legal at `now` and whose row has hits left, or else
    /// the oldest of all if its command is legal; if there is none, the next clock to ask again.
    ///
    /// `column` is the command of requests whose row is open, which must be the same for all.
    pub fn choose(
        &self,
        column: Command,
        device: &Device,
        uses: &RowUses,
        now: u64,
    ) -> Result<usize, u64> {
        let Some(oldest) = self.waiting.first() else { return Err(u64::MAX) };
        // One bit for each bank; a device has at most MAX_BANKS.
        let (mut legal_hits, mut legal_others, mut again) = (0_u64, 0_u64, u64::MAX);
        for (id, bank) in (0..).zip(&self.banks) {
            let address = Address { bank: id, ..Address::default() };
            if bank.others > 0 {
                let closed = bank.row.is_none();
                let change = if closed { Command::Activate } else { Command::Precharge };
                let earliest = device.earliest(change, address);
                legal_others |= u64::from(earliest <= now) << id;
                again = again.min(earliest);
            }
            if bank.hits > 0 && !uses.spent(id) {
                let earliest = device.earliest(column, address);
                legal_hits |= u64::from(earliest <= now) << id;
                again = again.min(earliest);
            }
        }
        if again <= now {
            let legal = |request: &Waiting| {
                let Address { bank, row, .. } = request.address;
                if (legal_hits | legal_others) >> bank & 1 == 0 {
                    return false;
                }
                let hit = self.banks.get(bank as usize).is_some_and(|bank| bank.row == Some(row));
                (if hit { legal_hits } else { legal_others }) >> bank & 1 == 1
            };
            return self.waiting.iter().position(legal).ok_or(now + 1);
        }
        let command = oldest.needs(device.open_row(oldest.address.bank));
        let earliest = device.earliest(command, oldest.address);
        if earliest <= now { Ok(0) } else { Err(again.min(earliest)) }
    }

    /// The same for few requests of both kinds.
    pub fn choose_of_few(&self, device: &Device, uses: &RowUses, now: u64) -> Result<usize, u64> {
        let mut again = u64::MAX;
        for (i, request) in self.waiting.iter().enumerate() {
            let command = request.needs(device.open_row(request.address.bank));
            let hit = matches!(command, Command::Read | Command::Write);
            let spent = hit && uses.spent(request.address.bank);
            if spent && i > 0 {
                continue;
            }
            let earliest = device.earliest(command, request.address);
            if earliest <= now && !spent {
                return Ok(i);
            }
            again = again.min(earliest);
        }
        // Only an oldest request whose row has used up its hits can be legal and passed over.
        if again <= now { Ok(0) } else { Err(again) }
    }
}

impl Bank {
    fn count(&mut self, row: u32) -> &mut u32 {
        if self.row == Some(row) { &mut self.hits } else { &mut self.others }
    }
}
