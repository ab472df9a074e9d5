//! Waiting for a job to end, and ending it.

use core::convert::Infallible;
use core::fmt;

use embedded_hal::delay::DelayNs;
use embedded_hal::digital::{ErrorType, InputPin};
use xylem_core::mem::ByteAddr;
use xylem_regs::{
    CTRL, Ctrl, ERROR_ADDR, ERROR_INFO, INT_STATUS, IntStatus, Register, STATUS, Status,
};

use crate::access::{RegisterAccess, TypedAccess};
use crate::device::Xylem;
use crate::error::{JobError, StopError, WaitError};

/// A time in microseconds.
#[derive(Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Debug, Hash)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Micros(pub u32);

impl fmt::Display for Micros {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{} µs", self.0)
    }
}

/// The absence of an interrupt line: always "look at the status register", so that the driver polls.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct NoInterrupt;

impl ErrorType for NoInterrupt {
    type Error = Infallible;
}

impl InputPin for NoInterrupt {
    fn is_high(&mut self) -> Result<bool, Infallible> {
        Ok(true)
    }

    fn is_low(&mut self) -> Result<bool, Infallible> {
        Ok(false)
    }
}

/// How a successful job ended.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub struct Completion {
    /// The sum of the pauses while waiting: a lower bound of the time.
    pub waited: Micros,
    /// Whether the interrupt line (or, without one, a poll) told the end. If not, the job was found
    /// done when the time was up: check the line's wiring and polarity.
    pub signalled: bool,
}

impl<R: RegisterAccess, D: DelayNs, I: InputPin> Xylem<R, D, I> {
    /// Waits until the job ends, at most `timeout`, and clears its interrupt.
    ///
    /// The status register is read only while the interrupt line is high, and once more when the
    /// time is up.
    ///
    /// # Errors
    /// [`WaitError`]: [`WaitError::Job`] with what the accelerator reports,
    /// [`WaitError::TimedOut`] while the job still runs (wait again, [`abort`](Self::abort) or
    /// [`reset`](Self::reset) it), no job at all, or a failed access.
    pub fn wait(&mut self, timeout: Micros) -> Result<Completion, WaitError<R::Error, I::Error>> {
        let mut waited = Micros(0);
        loop {
            let signalled = self.interrupt.is_high().map_err(WaitError::Interrupt)?;
            let last_look = waited >= timeout;
            if signalled || last_look {
                let status = self.regs.get(STATUS)?;
                if !status.busy() {
                    return self.finish(status).map(|()| Completion { waited, signalled });
                }
                if last_look {
                    let stage =
                        status.stage().map_err(|error| WaitError::unknown("status", error))?;
                    return Err(WaitError::TimedOut { stage, waited });
                }
            }
            waited = self.pause(waited, timeout);
        }
    }

    /// Reports how the job ended that `status`, not busy, tells of.
    fn finish(&mut self, status: Status) -> Result<(), WaitError<R::Error, I::Error>> {
        if !status.done() {
            return Err(WaitError::NotStarted);
        }
        let outcome = if status.failed() { Err(self.job_error()?) } else { Ok(()) };
        self.clear_interrupt()?;
        outcome.map_err(WaitError::Job)
    }

    fn job_error(&mut self) -> Result<JobError, WaitError<R::Error, I::Error>> {
        let info = self.regs.get(ERROR_INFO)?;
        let unknown = |error| WaitError::unknown("error_info", error);
        let region = info.region_valid().then(|| info.region()).transpose().map_err(unknown)?;
        let (code, stage) = (info.code().map_err(unknown)?, info.stage().map_err(unknown)?);
        let addr = ByteAddr(self.regs.get(ERROR_ADDR)?.addr());
        Ok(JobError { code, stage, region, addr })
    }

    /// Stops the running job, waiting at most `timeout` for its outstanding bursts; without one,
    /// does nothing. The output of the job is incomplete.
    ///
    /// # Errors
    /// [`StopError`]: still busy after `timeout` (try [`reset`](Self::reset)), or a failed access.
    pub fn abort(&mut self, timeout: Micros) -> Result<(), StopError<R::Error>> {
        if !self.regs.get(STATUS)?.busy() {
            return Ok(());
        }
        self.stop(Ctrl::RESET.with_abort_job(true), timeout)
    }

    /// Returns every unit to its state after power-up and clears the counters, waiting at most
    /// `timeout` for outstanding bursts. The next job runs as if it were the first.
    ///
    /// # Errors
    /// [`StopError`]: still busy after `timeout`, or a failed access.
    pub fn reset(&mut self, timeout: Micros) -> Result<(), StopError<R::Error>> {
        self.stop(Ctrl::RESET.with_soft_reset(true), timeout)
    }

    fn stop(&mut self, command: Ctrl, timeout: Micros) -> Result<(), StopError<R::Error>> {
        self.regs.set(CTRL, command)?;
        let mut waited = Micros(0);
        while self.regs.get(STATUS)?.busy() {
            if waited >= timeout {
                return Err(StopError::TimedOut { waited });
            }
            waited = self.pause(waited, timeout);
        }
        self.clear_interrupt()?;
        Ok(())
    }

    fn clear_interrupt(&mut self) -> Result<(), R::Error> {
        self.regs.set(INT_STATUS, IntStatus::RESET.with_done(true).with_failed(true))
    }

    /// Pauses for one poll interval, or for what is left until `timeout`.
    fn pause(&mut self, waited: Micros, timeout: Micros) -> Micros {
        let pause = self.poll_interval.0.min(timeout.0.saturating_sub(waited.0));
        self.delay.delay_us(pause);
        Micros(waited.0.saturating_add(pause))
    }
}
