//! A bus that fails on purpose.

use xylem_core::mem::{Bus, ByteAddr};

/// When a [`Faulty`] bus fails.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Fault {
    /// The access with this number, counted from 0, fails; later ones work.
    Access(u64),
    /// Every read that touches this byte fails.
    ReadOf(ByteAddr),
    /// Every write that touches this byte fails.
    WriteTo(ByteAddr),
}

/// Wraps a bus and makes some accesses fail; a failed write changes nothing.
#[derive(Debug)]
pub struct Faulty<B> {
    inner: B,
    fault: Fault,
    accesses: u64,
}

/// The error of a [`Faulty`] bus.
#[derive(Debug, Clone, Copy, PartialEq, Eq, thiserror::Error)]
pub enum FaultyError<E: std::fmt::Debug> {
    /// The fault that was asked for.
    #[error("injected fault at access {access}")]
    Injected {
        /// The number of the access, from 0.
        access: u64,
    },
    /// An error of the wrapped bus.
    #[error("{0:?}")]
    Inner(E),
}

impl<B: Bus> Faulty<B> {
    /// A bus that works like `inner` but for `fault`.
    pub fn new(inner: B, fault: Fault) -> Self {
        Self { inner, fault, accesses: 0 }
    }

    /// Accesses so far, failed ones included.
    pub fn accesses(&self) -> u64 {
        self.accesses
    }

    /// The wrapped bus.
    pub fn into_inner(self) -> B {
        self.inner
    }

    fn check(
        &mut self,
        write: bool,
        addr: ByteAddr,
        len: usize,
    ) -> Result<(), FaultyError<B::Error>> {
        let access = self.accesses;
        self.accesses += 1;
        let touches =
            |byte: ByteAddr| byte >= addr && u64::from(byte.0) < u64::from(addr.0) + len as u64;
        let fails = match self.fault {
            Fault::Access(number) => number == access,
            Fault::ReadOf(byte) => !write && touches(byte),
            Fault::WriteTo(byte) => write && touches(byte),
        };
        if fails { Err(FaultyError::Injected { access }) } else { Ok(()) }
    }
}

impl<B: Bus> Bus for Faulty<B> {
    type Error = FaultyError<B::Error>;

    fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), Self::Error> {
        self.check(false, addr, buf.len())?;
        self.inner.read(addr, buf).map_err(FaultyError::Inner)
    }

    fn write(&mut self, addr: ByteAddr, bytes: &[u8]) -> Result<(), Self::Error> {
        self.check(true, addr, bytes.len())?;
        self.inner.write(addr, bytes).map_err(FaultyError::Inner)
    }
}

#[cfg(test)]
mod tests {
    use super::super::FlatMemory;
    use super::*;

    #[test]
    fn the_chosen_access_fails_and_changes_nothing() {
        let mut bus = Faulty::new(FlatMemory::new(4), Fault::Access(1));
        bus.write(ByteAddr(0), &[1]).unwrap();
        let error = bus.write(ByteAddr(0), &[2]).unwrap_err();
        assert_eq!(error.to_string(), "injected fault at access 1");
        let mut byte = [0];
        bus.read(ByteAddr(0), &mut byte).unwrap();
        assert_eq!(byte, [1]);
    }

    #[test]
    fn a_bad_byte_fails_whoever_touches_it() {
        let mut bus = Faulty::new(FlatMemory::new(8), Fault::ReadOf(ByteAddr(3)));
        assert!(bus.read(ByteAddr(0), &mut [0; 3]).is_ok());
        assert!(bus.read(ByteAddr(0), &mut [0; 4]).is_err());
        assert!(bus.read(ByteAddr(4), &mut [0; 4]).is_ok());
        assert!(bus.write(ByteAddr(3), &[0]).is_ok());
    }
}
