//! The memory at the other end of a unit's AXI4 master port.
//!
//! [`Slave`] keeps the bytes; a [`Port`] of `xylem::machine` says when lines move, so that the RTL sees
//! the very memory that the cycle models see. Above the port, accesses can be held up at random, and one
//! fault can be put in.

use std::collections::VecDeque;

use xylem::machine::port::{Access, LINE_BYTES, Port};

use crate::random::Random;
use crate::rtl::{Pin, Rtl};

/// Bytes of a line, as an index.
const LINE: usize = LINE_BYTES as usize;

/// Cycles for which memory is held in reset.
const RESET_CYCLES: u32 = 1000;

/// What goes wrong. Lines are counted from 0, reads and writes apart.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub enum Fault {
    /// This line is answered with an error when it is read.
    FailRead(u64),
    /// This line is answered with an error when it is written; the bytes stay as they were.
    FailWrite(u64),
    /// This read is not answered until the memory is told to [recover](Slave::recover).
    LoseRead(u64),
    /// From this write on, nothing is taken any more, until the memory recovers.
    Refuse(u64),
}

/// The pins of an AXI4 master with names as in `xy_port.sv`, after a prefix.
#[derive(Clone, Copy, Debug)]
struct Pins {
    ar_valid: Pin,
    ar_ready: Pin,
    ar_id: Pin,
    ar_addr: Pin,
    ar_len: Pin,
    ar_size: Pin,
    ar_burst: Pin,
    r_valid: Pin,
    r_ready: Pin,
    r_id: Pin,
    r_data: Pin,
    r_resp: Pin,
    r_last: Pin,
    aw_valid: Pin,
    aw_ready: Pin,
    aw_addr: Pin,
    aw_len: Pin,
    aw_burst: Pin,
    w_valid: Pin,
    w_ready: Pin,
    w_data: Pin,
    w_strb: Pin,
    w_last: Pin,
    b_valid: Pin,
    b_ready: Pin,
    b_resp: Pin,
}

/// A line on its way back.
#[derive(Clone, Copy, Debug)]
struct Answer {
    addr: u32,
    id: u32,
    error: bool,
    /// Beats sent.
    sent: usize,
}

/// Memory behind AXI4.
#[derive(Debug)]
pub struct Slave<P> {
    /// What it holds.
    pub bytes: Vec<u8>,
    port: P,
    pins: Pins,
    beat: usize,
    random: Random,
    /// In 1 of so many cycles each channel is held up; 0 for never.
    stall: u64,
    fault: Option<Fault>,
    reads: u64,
    writes: u64,
    lost: Option<Answer>,
    /// The number of the read that fails, until it has.
    failing: Vec<(u32, u32)>,
    answers: VecDeque<Answer>,
    /// Address of the line being written, and the beats of it that have come.
    writing: Option<u32>,
    beats: Vec<(Vec<u8>, Vec<u8>)>,
    written: VecDeque<bool>,
    /// Which channels are held up in this cycle: AR, R, AW and W, B.
    held: [bool; 4],
}

impl<P: Port> Slave<P> {
    /// Memory of `bytes` at the port of `rtl` whose pins start with `prefix`, such as `""` or
    /// `"m_axi_"`. Each channel is held up in one of `stall` cycles, or never if that is 0.
    ///
    /// # Panics
    /// If the unit lacks one of the port's pins.
    pub fn new(rtl: &Rtl, prefix: &str, port: P, bytes: Vec<u8>, stall: u64, seed: u64) -> Self {
        let input = |name: &str| rtl.input(&format!("{prefix}{name}_i"));
        let output = |name: &str| rtl.output(&format!("{prefix}{name}_o"));
        let pins = Pins {
            ar_valid: output("arvalid"),
            ar_ready: input("arready"),
            ar_id: output("arid"),
            ar_addr: output("araddr"),
            ar_len: output("arlen"),
            ar_size: output("arsize"),
            ar_burst: output("arburst"),
            r_valid: input("rvalid"),
            r_ready: output("rready"),
            r_id: input("rid"),
            r_data: input("rdata"),
            r_resp: input("rresp"),
            r_last: input("rlast"),
            aw_valid: output("awvalid"),
            aw_ready: input("awready"),
            aw_addr: output("awaddr"),
            aw_len: output("awlen"),
            aw_burst: output("awburst"),
            w_valid: output("wvalid"),
            w_ready: input("wready"),
            w_data: output("wdata"),
            w_strb: output("wstrb"),
            w_last: output("wlast"),
            b_valid: input("bvalid"),
            b_ready: output("bready"),
            b_resp: input("bresp"),
        };
        Self {
            bytes,
            port,
            beat: pins.r_data.bits() as usize / 8,
            pins,
            random: Random::new(seed),
            stall,
            fault: None,
            reads: 0,
            writes: 0,
            lost: None,
            failing: Vec::new(),
            answers: VecDeque::new(),
            writing: None,
            beats: Vec::new(),
            written: VecDeque::new(),
            held: [false; 4],
        }
    }

    /// Puts `fault` in; lines are counted from now on.
    pub fn put_in(&mut self, fault: Fault) {
        (self.fault, self.reads, self.writes) = (Some(fault), 0, 0);
    }

    /// Takes the fault out and answers what was lost.
    pub fn recover(&mut self) {
        self.fault = None;
        self.answers.extend(self.lost.take());
    }

    /// Forgets all that is under way, as memory does that is reset together with the unit.
    pub fn reset(&mut self) {
        // Longer than any of them is on its way.
        for _ in 0..RESET_CYCLES {
            self.port.tick();
            while self.port.take().is_some() {}
        }
        self.lost = None;
        self.failing.clear();
        self.answers.clear();
        self.writing = None;
        self.beats.clear();
        self.written.clear();
    }

    /// Lines taken since the start or the last fault: reads, writes.
    pub fn lines(&self) -> (u64, u64) {
        (self.reads, self.writes)
    }

    /// Sets the inputs of a cycle that do not depend on its outputs. Call before the unit settles.
    pub fn drive(&mut self, rtl: &mut Rtl) {
        for held in &mut self.held {
            *held = self.stall > 0 && self.random.below(self.stall) == 0;
        }
        while let Some(response) = self.port.take() {
            let Access { addr, tag, .. } = response.access;
            let at = self.failing.iter().position(|&failing| failing == (addr, tag));
            let error = at.map(|at| self.failing.swap_remove(at)).is_some();
            let answer = Answer { addr, id: tag, error, sent: 0 };
            match self.fault {
                Some(Fault::LoseRead(_)) if error => {
                    self.lost = Some(Answer { error: false, ..answer });
                }
                _ => self.answers.push_back(answer),
            }
        }
        let Self { pins, beat, .. } = *self;
        for ready in [pins.ar_ready, pins.aw_ready, pins.w_ready] {
            rtl.set(ready, 0u64);
        }
        let answer = self.answers.front().filter(|_| !self.held[1]);
        rtl.set(pins.r_valid, u64::from(answer.is_some()));
        if let Some(&Answer { addr, id, error, sent }) = answer {
            let at = addr as usize + sent * beat;
            rtl.set_bytes(pins.r_data, self.bytes.get(at..at + beat).unwrap_or_default());
            rtl.set(pins.r_id, u64::from(id));
            // In the first beat: AXI leaves open which ones say so.
            rtl.set(pins.r_resp, if error && sent == 0 { 2u64 } else { 0 });
            rtl.set(pins.r_last, u64::from((sent + 1) * beat == LINE));
        }
        let response = self.written.front().filter(|_| !self.held[3]);
        rtl.set(pins.b_valid, u64::from(response.is_some()));
        rtl.set(pins.b_resp, if response == Some(&true) { 2u64 } else { 0 });
    }

    /// Takes what the settled unit offers and settles it again. Call before the edge.
    ///
    /// # Panics
    /// If the unit asks for something that is not one whole line of this memory.
    pub fn respond(&mut self, rtl: &mut Rtl) {
        let Self { pins, beat, .. } = *self;
        let beats = (LINE / beat) as u64;
        if rtl.is_set(pins.ar_valid) && !self.held[0] && !self.refuses() {
            let addr = rtl.get(pins.ar_addr) as u32;
            let shape =
                [rtl.get(pins.ar_len) + 1, 1 << rtl.get(pins.ar_size), rtl.get(pins.ar_burst)];
            assert_eq!(shape, [beats, beat as u64, 1], "AR at {addr:#x}");
            self.check(addr);
            let access = Access { addr, write: false, tag: rtl.get(pins.ar_id) as u32 };
            if self.port.offer(access) {
                rtl.set(pins.ar_ready, 1u64);
                if let Some(Fault::FailRead(at) | Fault::LoseRead(at)) = self.fault
                    && at == self.reads
                {
                    self.failing.push((access.addr, access.tag));
                }
                self.reads += 1;
            }
        }
        // Before a new one joins: what was not shown in this cycle cannot have been seen.
        if rtl.is_set(pins.b_ready) && !self.held[3] {
            self.written.pop_front();
        }
        self.take_write(rtl);
        let answered = self.answers.front().is_some() && !self.held[1];
        if answered && rtl.is_set(pins.r_ready) {
            let done = self.answers.front_mut().is_some_and(|answer| {
                answer.sent += 1;
                answer.sent * beat == LINE
            });
            if done {
                self.answers.pop_front();
            }
        }
        self.port.tick();
        rtl.settle();
    }

    fn take_write(&mut self, rtl: &mut Rtl) {
        let Self { pins, beat, .. } = *self;
        if self.held[2] || self.refuses() {
            return;
        }
        let addressed = rtl.is_set(pins.aw_valid) && self.writing.is_none();
        let Some(addr) = self.writing.or(addressed.then(|| rtl.get(pins.aw_addr) as u32)) else {
            return;
        };
        if addressed {
            let shape = [rtl.get(pins.aw_len) + 1, rtl.get(pins.aw_burst)];
            assert_eq!(shape, [(LINE / beat) as u64, 1], "AW at {addr:#x}");
            self.check(addr);
        }
        let last = (self.beats.len() + 1) * beat == LINE;
        let has_beat = rtl.is_set(pins.w_valid);
        // The port takes a line with its last beat, and nothing of it else.
        let access = Access { addr, write: true, tag: 0 };
        if has_beat && last && !self.port.offer(access) {
            return;
        }
        if addressed {
            self.writing = Some(addr);
            rtl.set(pins.aw_ready, 1u64);
        }
        if !has_beat {
            return;
        }
        rtl.set(pins.w_ready, 1u64);
        assert_eq!(rtl.is_set(pins.w_last), last, "W at {addr:#x}, beat {}", self.beats.len());
        self.beats.push((rtl.bytes(pins.w_data), rtl.bytes(pins.w_strb)));
        if last {
            self.writing = None;
            let fails = self.fault == Some(Fault::FailWrite(self.writes));
            let beats = std::mem::take(&mut self.beats);
            for (i, (data, strobe)) in beats.iter().enumerate().filter(|_| !fails) {
                let at = addr as usize + i * beat;
                let enabled = |byte: usize| strobe[byte / 8] >> (byte % 8) & 1 == 1;
                for byte in (0..beat).filter(|&byte| enabled(byte)) {
                    self.bytes[at + byte] = data[byte];
                }
            }
            self.writes += 1;
            self.written.push_back(fails);
        }
    }

    fn refuses(&self) -> bool {
        matches!(self.fault, Some(Fault::Refuse(from)) if self.writes >= from)
    }

    fn check(&self, addr: u32) {
        let end = addr as usize + LINE;
        assert!(addr.is_multiple_of(LINE_BYTES) && end <= self.bytes.len(), "no line at {addr:#x}");
    }
}
