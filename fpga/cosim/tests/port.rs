//! The memory port in gates: what is asked for arrives, in AXI's words, and nothing outside a region is
//! touched.
//!
//! A request outside its region is taken like any other. It never reaches AXI and is never answered: it is
//! dropped at the head of its queue, a read at once, a write when all lines sent before it have been
//! answered. In every cycle in which a request outside stands at the head of its queue, and in no other, the
//! port says so in the next one, and names it: the read, if there are both.

use std::collections::{HashMap, VecDeque};

use xylem::machine::port::IdealPort;
use xylem_cosim::axi::{Fault, Slave};
use xylem_cosim::random::Random;
use xylem_cosim::rtl::{Pin, Rtl};
use xylem_cosim::tools_for;
use xylem_cosim::verilate::{self, Mutation, Unit};

const MEMORY: usize = 1 << 14;
const LINES: u64 = MEMORY as u64 / 64;
/// Regions of 32 lines each; the last two are absent and the one before ends with memory.
const REGIONS: [(u64, u64); 8] =
    [(0, 32), (32, 32), (64, 32), (96, 32), (128, 32), (224, 32), (10, 0), (0, 0)];

fn build(width: u64, mutation: Option<Mutation>) -> std::path::PathBuf {
    let parameters = [("DataWidth", width)];
    let config = format!("{width}");
    let unit = Unit { top: "xy_port", files: "port.f", config: &config, parameters: &parameters };
    verilate::unit(&unit, mutation).unwrap_or_else(|error| panic!("{error}"))
}

/// The unit, its memory, and what should be there.
struct Bench {
    rtl: Rtl,
    memory: Slave<IdealPort>,
    expected: Vec<u8>,
    random: Random,
    /// Reads under way, by tag.
    reading: HashMap<u64, u32>,
    /// Requests taken that have neither been sent nor dropped: address and region.
    queues: [VecDeque<(u64, u64)>; 2],
    /// Lines sent to be written that have not been answered.
    posted: u64,
    next_tag: u64,
    answered: u64,
    /// Requests dropped.
    violations: u64,
    rd_errors: Vec<u32>,
    wr_errors: Vec<u32>,
    /// Address of the write that was to fail.
    failed_write: Option<u32>,
}

struct Pins {
    rd_valid: Pin,
    rd_ready: Pin,
    rd_addr: Pin,
    rd_tag: Pin,
    rd_region: Pin,
    wr_valid: Pin,
    wr_ready: Pin,
    wr_addr: Pin,
    wr_data: Pin,
    wr_strb: Pin,
    wr_region: Pin,
}

impl Bench {
    fn new(library: &std::path::Path, stall: u64, latency: u32, seed: u64) -> Self {
        let mut rtl = Rtl::load(library, seed as u32).unwrap_or_else(|error| panic!("{error}"));
        let mut random = Random::new(seed);
        let bytes: Vec<u8> = (0..MEMORY).map(|_| random.bits() as u8).collect();
        let port = IdealPort::new(latency);
        let memory = Slave::new(&rtl, "", port, bytes.clone(), stall, seed);
        let (base, lines) = (rtl.input("base_i"), rtl.input("lines_i"));
        rtl.set_bytes(base, &packed(REGIONS.map(|(base, _)| base)));
        rtl.set_bytes(lines, &packed(REGIONS.map(|(_, lines)| lines)));
        // Where regions end is known in the next cycle.
        rtl.settle();
        rtl.edge().unwrap_or_else(|error| panic!("{error}"));
        Self {
            rtl,
            memory,
            expected: bytes,
            random,
            reading: HashMap::new(),
            queues: [VecDeque::new(), VecDeque::new()],
            posted: 0,
            next_tag: 0,
            answered: 0,
            violations: 0,
            rd_errors: Vec::new(),
            wr_errors: Vec::new(),
            failed_write: None,
        }
    }

    fn pins(&self) -> Pins {
        let rtl = &self.rtl;
        Pins {
            rd_valid: rtl.input("rd_valid_i"),
            rd_ready: rtl.output("rd_ready_o"),
            rd_addr: rtl.input("rd_addr_i"),
            rd_tag: rtl.input("rd_tag_i"),
            rd_region: rtl.input("rd_region_i"),
            wr_valid: rtl.input("wr_valid_i"),
            wr_ready: rtl.output("wr_ready_o"),
            wr_addr: rtl.input("wr_addr_i"),
            wr_data: rtl.input("wr_data_i"),
            wr_strb: rtl.input("wr_strb_i"),
            wr_region: rtl.input("wr_region_i"),
        }
    }

    /// A line of memory, in its region or, one time in eight, wherever.
    fn place(&mut self, region: u64) -> (u64, u64) {
        let (base, lines) = REGIONS[region as usize];
        let wild = lines == 0 || self.random.below(8) == 0;
        let line = if wild { self.random.below(LINES) } else { base + self.random.below(lines) };
        (line * 64, region)
    }

    fn step(&mut self, rd: Option<(u64, u64)>, wr: Option<(u64, u64, Vec<u8>, u64)>) -> [bool; 2] {
        let pins = self.pins();
        let rtl = &mut self.rtl;
        rtl.set(pins.rd_valid, u64::from(rd.is_some()));
        if let Some((addr, region)) = rd {
            rtl.set(pins.rd_addr, addr);
            rtl.set(pins.rd_region, region);
            rtl.set(pins.rd_tag, self.next_tag);
        }
        rtl.set(pins.wr_valid, u64::from(wr.is_some()));
        if let Some((addr, region, data, strobe)) = &wr {
            rtl.set(pins.wr_addr, *addr);
            rtl.set(pins.wr_region, *region);
            rtl.set_bytes(pins.wr_data, data);
            rtl.set(pins.wr_strb, *strobe);
        }
        self.memory.drive(rtl);
        rtl.settle();
        let before = self.memory.lines();
        self.memory.respond(rtl);
        let after = self.memory.lines();
        let taken =
            [rd.is_some() && rtl.is_set(pins.rd_ready), wr.is_some() && rtl.is_set(pins.wr_ready)];
        let rd_fails =
            rtl.is_set(rtl.output("rsp_valid_o")) && rtl.is_set(rtl.output("rsp_error_o"));
        if rtl.is_set(rtl.output("rsp_valid_o")) {
            let tag = rtl.get(rtl.output("rsp_tag_o"));
            let addr = self.reading.remove(&tag).expect("an answer to what was asked");
            assert_eq!(rtl.get(rtl.output("rsp_addr_o")) as u32, addr);
            if rd_fails {
                self.rd_errors.push(addr);
            } else {
                let at = addr as usize;
                assert_eq!(rtl.bytes(rtl.output("rsp_data_o")), self.memory.bytes[at..at + 64]);
            }
            self.answered += 1;
        }

        // What leaves the queues: to AXI, or dropped.
        let mut outside = [None; 2];
        for (i, sent, addr) in [
            (0, after.0 > before.0, rtl.get(rtl.output("araddr_o"))),
            (1, after.1 > before.1, rtl.get(rtl.output("awaddr_o"))),
        ] {
            let queue = &mut self.queues[i];
            outside[i] = queue.front().copied().filter(|&(addr, region)| !is_inside(addr, region));
            if sent {
                let (asked, region) = queue.pop_front().expect("a line that was asked for");
                assert!(outside[i].is_none(), "{asked:#x} is outside of region {region}");
                assert_eq!(addr, asked);
            } else if outside[i].is_some() && (i == 0 || self.posted == 0) {
                queue.pop_front();
                self.violations += 1;
            }
        }
        self.posted += after.1 - before.1;
        self.posted -= rtl.get_input(rtl.input("bvalid_i"));

        rtl.edge().unwrap_or_else(|error| panic!("{error}"));
        rtl.settle();
        let told = rtl.is_set(rtl.output("violation_o")).then(|| {
            let addr = rtl.get(rtl.output("violation_addr_o"));
            (addr, rtl.get(rtl.output("violation_region_o")))
        });
        assert_eq!(told, outside[0].or(outside[1]), "what is outside");
        assert_eq!(rtl.is_set(rtl.output("read_error_o")), rd_fails);
        if rd_fails {
            let addr = rtl.get(rtl.output("read_addr_o")) as u32;
            assert_eq!(Some(&addr), self.rd_errors.last());
        }
        if rtl.is_set(rtl.output("write_error_o")) {
            self.wr_errors.push(rtl.get(rtl.output("write_addr_o")) as u32);
        }
        if taken[0]
            && let Some((addr, region)) = rd
        {
            self.queues[0].push_back((addr, region));
            if is_inside(addr, region) {
                self.reading.insert(self.next_tag, addr as u32);
            }
            // What is outside has its tag too, so that an answer to it is one to nothing.
            self.next_tag = (self.next_tag + 1) % (1 << 16);
        }
        if taken[1]
            && let Some((addr, region, ..)) = wr
        {
            self.queues[1].push_back((addr, region));
        }
        taken
    }

    /// Runs random traffic for some cycles, then until all is answered.
    fn run(&mut self, cycles: u64, write_fails: Option<u64>) {
        let (mut rd, mut wr) = (None, None);
        let mut writes = 0;
        for cycle in 0.. {
            let busy = cycle < cycles;
            if busy && rd.is_none() && self.random.below(3) > 0 {
                // Never what is written: when a read sees a write is for units to know.
                let region = 2 * self.random.below(4);
                rd = Some(self.place(region));
            }
            if busy && wr.is_none() && self.random.below(3) > 0 {
                let region = 2 * self.random.below(4) + 1;
                let (addr, region) = self.place(region);
                let data = (0..64).map(|_| self.random.bits() as u8).collect();
                wr = Some((addr, region, data, self.random.bits()));
            }
            let [read, written] = self.step(rd, wr.clone());
            if read {
                rd = None;
            }
            if written
                && let Some((addr, region, data, strobe)) = wr.take()
                && is_inside(addr, region)
            {
                if write_fails == Some(writes) {
                    self.failed_write = Some(addr as u32);
                } else {
                    for byte in (0..64).filter(|byte| strobe >> byte & 1 == 1) {
                        self.expected[addr as usize + byte] = data[byte];
                    }
                }
                writes += 1;
            }
            let idle = self.rtl.is_set(self.rtl.output("idle_o"));
            let held = self.queues.iter().any(|queue| !queue.is_empty());
            let waits = held || self.posted > 0 || !self.reading.is_empty();
            assert!(idle != waits, "cycle {cycle}: idle is {idle}");
            if !busy && idle && rd.is_none() && wr.is_none() {
                return;
            }
            assert!(cycle < cycles + 10_000, "not quiet: {:?}", self.reading);
        }
    }
}

fn is_inside(addr: u64, region: u64) -> bool {
    let (base, lines) = REGIONS[region as usize];
    (base..base + lines).contains(&(addr / 64))
}

/// Eight values of 26 bits, the first lowest.
fn packed(values: [u64; 8]) -> Vec<u8> {
    let mut bits = [0u128; 2];
    for (i, value) in values.into_iter().enumerate() {
        let at = 26 * (i % 4);
        bits[i / 4] |= u128::from(value) << at;
    }
    let low = bits[0] | bits[1] << 104;
    let high = bits[1] >> 24;
    let bytes = low.to_le_bytes().into_iter().chain(high.to_le_bytes());
    bytes.take(26).collect()
}

#[test]
fn lines_arrive_whole_at_every_width_and_nothing_outside_is_touched() {
    if !tools_for("lines_arrive_whole_at_every_width_and_nothing_outside_is_touched") {
        return;
    }
    for width in [512, 128, 32] {
        let library = build(width, None);
        for (seed, stall, latency) in [(1, 0, 1), (2, 3, 7), (3, 2, 40)] {
            println!("{width} bits, seed {seed}");
            let mut bench = Bench::new(&library, stall, latency, seed);
            bench.run(20_000, None);
            assert!(bench.memory.bytes == bench.expected, "seed {seed}: memory differs");
            assert!(bench.answered > 200 && bench.violations > 100, "too little was asked");
            assert_eq!((bench.rd_errors.len(), bench.wr_errors.len()), (0, 0));
        }
    }
}

#[test]
fn an_error_response_names_its_line() {
    if !tools_for("an_error_response_names_its_line") {
        return;
    }
    for width in [512, 32] {
        let library = build(width, None);
        for seed in 4..12 {
            let mut bench = Bench::new(&library, 4, 5, seed);
            bench.memory.put_in(Fault::FailRead(3 * seed));
            bench.run(2_000, None);
            assert_eq!((bench.rd_errors.len(), bench.wr_errors.len()), (1, 0), "seed {seed}");

            let mut bench = Bench::new(&library, 4, 5, seed);
            bench.memory.put_in(Fault::FailWrite(3 * seed));
            bench.run(2_000, Some(3 * seed));
            let failed = bench.failed_write.expect("so many writes");
            assert_eq!(
                (bench.rd_errors.len(), &bench.wr_errors),
                (0, &vec![failed]),
                "seed {seed}"
            );
            assert!(bench.memory.bytes == bench.expected, "seed {seed}: memory differs");
        }
    }
}

#[test]
fn faults_put_into_the_port_are_seen() {
    if !tools_for("faults_put_into_the_port_are_seen") {
        return;
    }
    let faults = [
        Mutation { file: "xy_guard.sv", from: "line_i} < end_i", to: "line_i} <= end_i" },
        Mutation {
            file: "xy_axi_read.sv",
            from: "rsp_error_o = rresp_i[1] || error_q",
            to: "rsp_error_o = rresp_i[1] && error_q",
        },
        Mutation {
            file: "xy_axi_read.sv",
            from: "row_free  = !busy_q[next_q]",
            to: "row_free  = 1'b1",
        },
        Mutation { file: "xy_axi_write.sv", from: "queue_ready && !count_q", to: "!count_q" },
        Mutation { file: "xy_axi_write.sv", from: "strb[beat_q]", to: "strb[0]" },
        // A read outside goes to AXI.
        Mutation {
            file: "xy_axi_read.sv",
            from: "(allowed_i && !pending_i));",
            to: "!pending_i);",
        },
        // A write outside does.
        Mutation {
            file: "xy_axi_write.sv",
            from: "head_valid && (begun_q || allowed_i)",
            to: "head_valid",
        },
        // A write outside is dropped in the place of one that has not been answered.
        Mutation {
            file: "xy_axi_write.sv",
            from: "forbidden_o && (count_q <= (LogLines+1)'(queued_q))",
            to: "forbidden_o",
        },
        // A request outside is told of by the other one's name.
        Mutation {
            file: "xy_port.sv",
            from: "rd_violation ? rd_region : wr_region",
            to: "wr_violation ? wr_region : rd_region",
        },
    ];
    for fault in faults {
        let library = build(32, Some(fault));
        let seen = std::panic::catch_unwind(|| {
            let mut bench = Bench::new(&library, 3, 20, 1);
            bench.run(20_000, None);
            assert!(bench.memory.bytes == bench.expected);
            let mut bench = Bench::new(&library, 3, 5, 1);
            bench.memory.put_in(Fault::FailRead(20));
            bench.run(2_000, None);
            assert_eq!(bench.rd_errors.len(), 1);
        });
        assert!(seen.is_err(), "not seen: {} -> {}", fault.from, fault.to);
    }
}
