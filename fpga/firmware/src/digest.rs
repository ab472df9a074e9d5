//! Digests of what lies in memory.

use crc::{CRC_32_ISO_HDLC, Crc, Digest};
use xylem_core::mem::{Bus, Region};

/// The CRC-32 of zip, PNG and Ethernet (`CRC-32/ISO-HDLC`): every toolbox can recompute it.
static CRC: Crc<u32> = Crc::<u32>::new(&CRC_32_ISO_HDLC);

/// Bytes that a digest reads in one burst.
const BURST: usize = 64;

/// A running digest over several pieces.
pub struct Running(Digest<'static, u32>);

impl core::fmt::Debug for Running {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.debug_tuple("Running").field(&self.value()).finish()
    }
}

impl Default for Running {
    fn default() -> Self {
        Self(CRC.digest())
    }
}

impl Running {
    /// Continues with `bytes`.
    pub fn update(&mut self, bytes: &[u8]) {
        self.0.update(bytes);
    }

    /// The digest of all bytes so far.
    pub fn value(&self) -> u32 {
        self.0.clone().finalize()
    }
}

/// The digest of a region's bytes, read back through the bus.
///
/// # Errors
/// The bus' own.
pub fn of_region<B: Bus>(bus: &mut B, region: Region) -> Result<u32, B::Error> {
    let mut running = Running::default();
    let mut buffer = [0; BURST];
    let mut offset = 0;
    while offset < region.size {
        let len = (region.size - offset).min(BURST as u32);
        let Some(addr) = region.at(offset, len) else { break };
        let burst = &mut buffer[..len as usize];
        bus.read(addr, burst)?;
        running.update(burst);
        offset += len;
    }
    Ok(running.value())
}

#[cfg(test)]
mod tests {
    use super::*;
    use xylem_core::mem::ByteAddr;

    struct Bytes<'a>(&'a [u8]);

    impl Bus for Bytes<'_> {
        type Error = ByteAddr;
        fn read(&mut self, addr: ByteAddr, buf: &mut [u8]) -> Result<(), ByteAddr> {
            let from = self.0.get(addr.0 as usize..addr.0 as usize + buf.len()).ok_or(addr)?;
            buf.copy_from_slice(from);
            Ok(())
        }
        fn write(&mut self, addr: ByteAddr, _: &[u8]) -> Result<(), ByteAddr> {
            Err(addr)
        }
    }

    #[test]
    fn the_digest_is_the_crc_of_zip() {
        // The check value that the CRC catalogue gives for this polynomial.
        let mut bus = Bytes(b"__123456789__");
        assert_eq!(of_region(&mut bus, Region::new(2, 9)), Ok(0xcbf4_3926));
        assert_eq!(of_region(&mut bus, Region::new(0, 0)), Ok(0));
    }

    #[test]
    fn a_region_longer_than_a_burst_digests_as_one_string() {
        let bytes: [u8; 200] = core::array::from_fn(|i| (i * 7) as u8);
        let mut whole = Running::default();
        whole.update(&bytes);
        assert_eq!(of_region(&mut Bytes(&bytes), Region::new(0, 200)), Ok(whole.value()));
        assert_eq!(of_region(&mut Bytes(&bytes), Region::new(0, 201)), Err(ByteAddr(192)));
    }
}
