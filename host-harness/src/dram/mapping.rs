//! Which channel, bank, row and column an address is in.

use super::device::{Address, MAX_BANKS};

/// Bytes of a request.
pub const REQUEST_BYTES: u64 = 64;

/// The address order row:bank:column:channel, from high bits to low: neighbouring requests are in
/// neighbouring channels, and a row is filled before the next bank is begun.
///
/// A request stays in one channel even where a burst is shorter than it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Mapping {
    /// Channels.
    pub channels: u32,
    /// Banks of a channel, at most [`MAX_BANKS`].
    pub banks: u32,
    /// Rows of a bank.
    pub rows: u32,
    /// Bytes of a row of the whole channel.
    pub row_bytes: u32,
    /// Bytes of a burst.
    pub burst_bytes: u32,
}

impl Mapping {
    /// The channel of a byte address and the first burst in it. Addresses beyond the end wrap.
    #[inline]
    pub fn locate(&self, addr: u64) -> (usize, Address) {
        let mut rest = addr / REQUEST_BYTES;
        let mut take = |n: u32| {
            let n = u64::from(n.max(1));
            // Truncation is harmless: the remainder is below a u32.
            let digit = (rest % n) as u32;
            rest /= n;
            digit
        };
        let channel = take(self.channels);
        let column = take(self.row_bytes / REQUEST_BYTES as u32) * self.bursts();
        let bank = take(self.banks.min(MAX_BANKS));
        let row = take(self.rows);
        (channel as usize, Address { bank, row, column })
    }

    /// Bursts of a request.
    pub const fn bursts(&self) -> u32 {
        let burst = if self.burst_bytes == 0 { 1 } else { self.burst_bytes };
        (REQUEST_BYTES as u32).div_ceil(burst)
    }

    /// Bytes of all channels together.
    pub const fn bytes(&self) -> u64 {
        self.channels as u64 * self.banks as u64 * self.rows as u64 * self.row_bytes as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WIDE: Mapping =
        Mapping { channels: 4, banks: 8, rows: 32768, row_bytes: 8192, burst_bytes: 64 };

    #[test]
    fn digits_are_channel_column_bank_row_from_below() {
        let at = |addr| WIDE.locate(addr);
        assert_eq!(at(64), (1, Address { bank: 0, row: 0, column: 0 }));
        assert_eq!(at(4 * 64), (0, Address { bank: 0, row: 0, column: 1 }));
        assert_eq!(at(4 * 8192), (0, Address { bank: 1, row: 0, column: 0 }));
        assert_eq!(at(4 * 8192 * 8 + 127), (1, Address { bank: 0, row: 1, column: 0 }));
        assert_eq!(at(WIDE.bytes() + 64), at(64), "addresses wrap");
    }

    #[test]
    fn a_request_is_as_many_bursts_as_it_takes() {
        let narrow = Mapping { channels: 2, row_bytes: 4096, burst_bytes: 32, ..WIDE };
        assert_eq!((WIDE.bursts(), narrow.bursts()), (1, 2));
        assert_eq!(narrow.locate(2 * 64), (0, Address { bank: 0, row: 0, column: 2 }));
        assert_eq!(narrow.locate(2 * 4096), (0, Address { bank: 1, row: 0, column: 0 }));
    }
}
