//! The program's log: defmt frames, decoded with the tables in its ELF file.

use std::fmt;

use defmt_decoder::{DecodeError, Table};
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
    let at = log.iter().rposition(|line| line.text.starts_with(REPORT))?;
    let report = parse_report(&log[at].text)?;
    log.remove(at);
    Some(report)
}

/// How the report line starts.
const REPORT: &str = "report [";

/// Parses `report [0a, 0b, …]`.
fn parse_report(text: &str) -> Option<Report> {
    let list = text.strip_prefix(REPORT)?.strip_suffix(']')?;
    let bytes: Option<Vec<u8>> =
        list.split(", ").map(|byte| u8::from_str_radix(byte, 16).ok()).collect();
    Report::from_bytes(&bytes?)
}

#[cfg(test)]
mod tests {
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
        assert_eq!(parse_report("report [00, 01]"), None);
        assert_eq!(parse_report("report [0g]"), None);
    }
}
