//! The exact transfers of the driver on an SPI bus.

use std::fmt;

use embedded_hal::spi::{ErrorKind, ErrorType, Operation, SpiDevice};
use embedded_hal_mock::eh1::delay::{CheckedDelay, Transaction as Delay};
use embedded_hal_mock::eh1::digital::{Mock as Pin, State, Transaction as Line};
use embedded_hal_mock::eh1::spi::{Mock as SpiMock, Transaction as Transfer};
use xylem_driver::{
    Completion, Counters, Micros, NoInterrupt, OffsetError, ProbeError, RegisterAccess, Spi,
    SpiError, Xylem,
};

/// One read transaction of consecutive words from `offset` on.
fn read(offset: u8, high_byte: u8, words: &[u32]) -> Vec<Transfer<u8>> {
    vec![
        Transfer::transaction_start(),
        Transfer::write_vec(vec![0x03, 0, high_byte, offset, 0]),
        Transfer::read_vec(words.iter().flat_map(|word| word.to_be_bytes()).collect()),
        Transfer::transaction_end(),
    ]
}

fn write(offset: u8, bytes: [u8; 4]) -> Vec<Transfer<u8>> {
    let [b3, b2, b1, b0] = bytes;
    vec![
        Transfer::transaction_start(),
        Transfer::write_vec(vec![0x02, 0, 0, offset, b3, b2, b1, b0]),
        Transfer::transaction_end(),
    ]
}

/// The transfers of probing a device with every capability bit set.
fn probing() -> Vec<Transfer<u8>> {
    let magic = read(0x00, 0, &[0x5859_4c4d]);
    let version = read(0x04, 0, &[0x0002_0007]);
    let capabilities = [0x10, 0x14, 0x18, 0x1c, 0x20].map(|at| read(at, 0, &[u32::MAX])).concat();
    [magic, version, capabilities].concat()
}

#[test]
fn a_register_is_read_and_written_in_one_framed_transaction() {
    let mut bus =
        SpiMock::new(&[read(0xcc, 1, &[0x0102_0304]), write(0x40, [0xa, 0xb, 0xc, 0xd])].concat());
    let mut regs = Spi::new(bus.clone());
    assert_eq!(regs.read(0x1cc).unwrap(), 0x0102_0304);
    regs.write(0x040, 0x0a0b_0c0d).unwrap();
    bus.done();
}

#[test]
fn bursts_longer_than_eight_words_are_split() {
    let words: Vec<u32> = (0..10).map(|i| 0x1000_0000 + i).collect();
    let mut bus = SpiMock::new(&[read(0x80, 1, &words[..8]), read(0xa0, 1, &words[8..])].concat());
    let mut found = [0; 10];
    Spi::new(bus.clone()).read_burst(0x180, &mut found).unwrap();
    assert_eq!(found[..], words);
    bus.done();
}

#[test]
fn offsets_outside_the_map_never_reach_the_bus() {
    let mut bus = SpiMock::<u8>::new(&[]);
    let mut regs = Spi::new(bus.clone());
    let outside = |offset, bytes| Err(SpiError::Offset(OffsetError { offset, bytes }));
    assert_eq!(regs.read(0x1d0), outside(0x1d0, 4));
    assert_eq!(regs.read_burst(0x1cc, &mut [0; 2]), outside(0x1cc, 8).map(|_: u32| ()));
    assert_eq!(regs.write(0x0100_0040, 1), outside(0x0100_0040, 4).map(|_: u32| ()));
    assert_eq!(regs.write(0x041, 1), outside(0x041, 4).map(|_: u32| ()));
    bus.done();
}

#[test]
fn probing_reads_magic_version_and_capabilities_and_writes_nothing() {
    let mut bus = SpiMock::new(&probing());
    let xylem = Xylem::probe(Spi::new(bus.clone()), CheckedDelay::new(&[]), NoInterrupt).unwrap();
    assert_eq!(xylem.capabilities().sort.scratch_records(), 0x00ff_ffff);
    let (_, mut delay, NoInterrupt) = xylem.release();
    delay.done();
    bus.done();
}

#[test]
fn waiting_leaves_the_bus_alone_until_the_line_rises_and_then_clears_it() {
    let done = [read(0x44, 0, &[0b010]), write(0x50, [0, 0, 0, 0b11])].concat();
    let mut bus = SpiMock::new(&[probing(), done].concat());
    let mut line = Pin::new(&[State::Low, State::Low, State::Low, State::High].map(Line::get));
    let mut delay = CheckedDelay::new(&[10, 10, 10].map(Delay::delay_us));

    let mut xylem = Xylem::probe(Spi::new(bus.clone()), delay.clone(), line.clone()).unwrap();
    let completion = xylem.wait(Micros(1000)).unwrap();

    assert_eq!(completion, Completion { waited: Micros(30), signalled: true });
    line.done();
    delay.done();
    bus.done();
}

#[test]
fn counters_are_read_high_low_high_and_again_when_the_high_half_moved() {
    let mut transfers = probing();
    // The low half wraps between the first high half and the burst.
    transfers.extend(read(0x84, 1, &[5]));
    transfers.extend(read(0x80, 1, &[0, 6]));
    transfers.extend(read(0x80, 1, &[3, 6]));
    for counter in 1..10 {
        transfers.extend(read(0x84 + 8 * counter, 1, &[0]));
        transfers.extend(read(0x80 + 8 * counter, 1, &[counter.into(), 0]));
    }
    let mut bus = SpiMock::new(&transfers);
    let mut xylem =
        Xylem::probe(Spi::new(bus.clone()), CheckedDelay::new(&[]), NoInterrupt).unwrap();
    let counters = xylem.counters().unwrap();
    assert_eq!(
        counters,
        Counters {
            cycles: 0x6_0000_0003,
            bytes_read: 1,
            bytes_written: 2,
            nodes: 3,
            leaves: 4,
            heap_replaces: 5,
            backtracks: 6,
            node_fetches: 7,
            box_tests: 8,
            triangle_tests: 9,
        }
    );
    let (_, mut delay, _) = xylem.release();
    delay.done();
    bus.done();
}

/// A device whose chip select fails.
#[derive(Debug)]
struct Unplugged;

#[derive(Clone, Copy, PartialEq, Debug)]
struct NoSelect;

impl embedded_hal::spi::Error for NoSelect {
    fn kind(&self) -> ErrorKind {
        ErrorKind::ChipSelectFault
    }
}

impl ErrorType for Unplugged {
    type Error = NoSelect;
}

impl SpiDevice for Unplugged {
    fn transaction(&mut self, _: &mut [Operation<'_, u8>]) -> Result<(), NoSelect> {
        Err(NoSelect)
    }
}

#[test]
fn a_failing_bus_is_reported_as_such() {
    let mut delay = CheckedDelay::new(&[]);
    let error = Xylem::probe(Spi::new(Unplugged), delay.clone(), NoInterrupt).unwrap_err();
    assert_eq!(error, ProbeError::Access(SpiError::Bus(NoSelect)));
    let message: &dyn fmt::Display = &error;
    assert_eq!(message.to_string(), "accelerator could not be probed: SPI device failed: NoSelect");
    delay.done();
}
