//! The program's log: defmt frames, decoded with the tables in its ELF file.

use std::fmt;

use defmt_decoder::{DecodeError, Table};
use xylem_firmware::accelerated::Accelerated;
use xylem_firmware::animation::FrameReport;
use xylem_firmware::report::Report;

use super::{Image, SocError};

/// One decoded line of a log.
#[derive(Clone, PartialEq, Eq, Debug)]
pub struct Line {
    /// The core's cycle counter when the line was logged.
    pub cycles: Option<u64>,
    /// The level, as `INFO`; empty for a line without one.
    pub level: String,
    /// The text.
    pub text: String,
}

impl fmt::Display for Line {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self.cycles {
            Some(cycles) => write!(f, "{cycles:>12} ")?,
            None => write!(f, "{:12} ", "")?,
        }
        write!(f, "{:5} {}", self.level, self.text)
    }
}

/// Decodes what left the UART. A frame that is cut off at the end is left out; a broken one in
/// between becomes a line that says so.
pub(super) fn decode(image: &Image, uart: &[u8]) -> Result<Vec<Line>, SocError> {
    let broken = |what: String| SocError::Log { what };
    let table = Table::parse(&image.elf)
        .map_err(|error| broken(error.to_string()))?
        .ok_or_else(|| broken(format!("{} has no .defmt section", image.path.display())))?;
    let mut decoder = table.new_stream_decoder();
    decoder.received(uart);
    let mut lines = Vec::new();
    loop {
        match decoder.decode() {
            Ok(frame) => lines.push(Line {
                cycles: frame.display_timestamp().and_then(|t| t.to_string().parse().ok()),
                level: frame.level().map_or(String::new(), |l| l.as_str().to_uppercase()),
                text: frame.display_message().to_string(),
            }),
            Err(DecodeError::UnexpectedEof) => return Ok(lines),
            Err(DecodeError::Malformed) => lines.push(Line {
                cycles: None,
                level: String::new(),
                text: "(a broken frame)".into(),
            }),
        }
    }
}

/// Takes the report line out of a log.
pub(super) fn take_report(log: &mut Vec<Line>) -> Option<Report> {
    let at = log.iter().rposition(|line| line.text.starts_with("report ["))?;
    let report = Report::from_bytes(&bytes_of(&log[at].text, "report")?)?;
    log.remove(at);
    Some(report)
}

/// Takes what the accelerator did out of a log.
pub(super) fn take_accelerated(log: &mut Vec<Line>) -> Option<Accelerated> {
    let at = log.iter().rposition(|line| line.text.starts_with("accelerated ["))?;
    let report = Accelerated::from_bytes(&bytes_of(&log[at].text, "accelerated")?)?;
    log.remove(at);
    Some(report)
}

/// Takes the lines of the frames of an animation out of a log; one that is broken stays.
pub(super) fn take_frames(log: &mut Vec<Line>) -> Vec<FrameReport> {
    let mut frames = Vec::new();
    log.retain(|line| {
        let frame = bytes_of(&line.text, "frame").and_then(|b| FrameReport::from_bytes(&b));
        frames.extend(frame);
        frame.is_none()
    });
    frames
}

/// The bytes of `word [0a, 0b, …]`.
fn bytes_of(text: &str, word: &str) -> Option<Vec<u8>> {
    let list = text.strip_prefix(word)?.strip_prefix(" [")?.strip_suffix(']')?;
    list.split(", ").map(|byte| u8::from_str_radix(byte, 16).ok()).collect()
}

#[cfg(test)]
mod tests {
    use xylem_core::quality::SahCost;
    use xylem_core::refit::Update;
    use xylem_firmware::report::STAGES;

    use super::*;

    #[test]
    fn a_report_line_parses_and_leaves_the_log() {
        let report = Report { primitives: 0x1234, rays: 7, hits: 1, ..Report::default() };
        let bytes: Vec<String> = report.to_bytes().iter().map(|b| format!("{b:02x}")).collect();
        let line = |text: String| Line { cycles: None, level: String::new(), text };
        let mut log = vec![line("hello".into()), line(format!("report [{}]", bytes.join(", ")))];
        assert_eq!(take_report(&mut log), Some(report));
        assert_eq!(log.len(), 1);
        assert_eq!(take_report(&mut log), None);
        let accelerated = Accelerated { same_counts: true, ..Accelerated::default() };
        let bytes = accelerated.to_bytes().map(|b| format!("{b:02x}")).join(", ");
        log.push(line(format!("accelerated [{bytes}]")));
        assert_eq!(take_accelerated(&mut log), Some(accelerated));
        assert_eq!((log.len(), take_accelerated(&mut log)), (1, None));
        assert_eq!(bytes_of("report [00, 01]", "report"), Some(vec![0, 1]));
        assert_eq!(bytes_of("report [0g]", "report"), None);
    }

    #[test]
    fn frame_lines_leave_the_log_in_order_and_broken_ones_stay() {
        let frame = |frame| FrameReport {
            frame,
            update: Update::Rebuild,
            refitted: SahCost::ZERO,
            cost: SahCost::from_num(3),
            hits: 1,
            hits_crc: 2,
            cycles: [4; STAGES.len()],
        };
        let text = |frame: &FrameReport| {
            let bytes: Vec<String> = frame.to_bytes().iter().map(|b| format!("{b:02x}")).collect();
            format!("frame [{}]", bytes.join(", "))
        };
        let line = |text: String| Line { cycles: None, level: String::new(), text };
        let broken = line("frame [00]".into());
        let mut log = vec![line(text(&frame(0))), broken.clone(), line(text(&frame(1)))];
        assert_eq!(take_frames(&mut log), [frame(0), frame(1)]);
        assert_eq!(log, [broken]);
    }
}
