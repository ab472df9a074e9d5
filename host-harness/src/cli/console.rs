//! Standard output and standard error.

use std::error::Error;
use std::io::{self, ErrorKind, Write};

use serde::Serialize;

use super::CliError;

/// The widest line that is printed, in columns.
const COLUMNS: usize = 100;

/// How results and errors are printed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Console {
    /// Whether results are one JSON object instead of text.
    pub json: bool,
}

impl Console {
    /// Prints a result: as JSON if that was asked for, else as text, with a line end.
    pub fn result<R: Serialize>(
        self,
        report: &R,
        text: impl FnOnce() -> String,
    ) -> Result<(), CliError> {
        let mut text = match self.json {
            true => serde_json::to_string_pretty(report).map_err(io::Error::from)?,
            false => text(),
        };
        if !text.ends_with('\n') {
            text.push('\n');
        }
        let mut out = io::stdout().lock();
        match out.write_all(text.as_bytes()).and_then(|()| out.flush()) {
            // Whoever read our output has seen enough.
            Err(error) if error.kind() == ErrorKind::BrokenPipe => Ok(()),
            written => Ok(written?),
        }
    }

    /// Prints an error and what caused it.
    pub fn error(self, error: &CliError) {
        let mut message = format!("error: {error}");
        let mut source = error.source();
        while let Some(cause) = source {
            let cause_text = cause.to_string();
            // Most messages quote their cause already.
            if !message.contains(&cause_text) {
                message.push_str(": ");
                message.push_str(&cause_text);
            }
            source = cause.source();
        }
        self.note(&message);
    }

    /// Prints a line on standard error, wrapped.
    pub fn note(self, message: &str) {
        // Nobody is left to tell if standard error is closed.
        let _ = writeln!(io::stderr().lock(), "{}", wrap(message, 2));
    }
}

/// Breaks lines at spaces so that none exceeds [`COLUMNS`]; what follows is indented by `hanging`.
pub(super) fn wrap(text: &str, hanging: usize) -> String {
    let mut wrapped = String::with_capacity(text.len() + 16);
    for line in text.lines() {
        if !wrapped.is_empty() {
            wrapped.push('\n');
        }
        if line.chars().count() <= COLUMNS {
            wrapped.push_str(line);
            continue;
        }
        let text = line.trim_start();
        let mut column = line.len() - text.len();
        wrapped.push_str(&line[..column]);
        let mut first = true;
        for word in text.split(' ') {
            let width = word.chars().count();
            if !first && column + 1 + width > COLUMNS {
                wrapped.push('\n');
                wrapped.push_str(&" ".repeat(hanging));
                column = hanging;
            } else if !first {
                wrapped.push(' ');
                column += 1;
            }
            wrapped.push_str(word);
            column += width;
            first = false;
        }
    }
    wrapped
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn long_messages_are_broken_at_spaces_and_lose_nothing() {
        let long = "word ".repeat(60) + &"x".repeat(120);
        let wrapped = wrap(&long, 2);
        assert!(wrapped.lines().filter(|l| !l.contains('x')).all(|l| l.len() <= COLUMNS));
        let words = |text: &str| text.split_whitespace().map(str::to_owned).collect::<Vec<_>>();
        assert_eq!(words(&wrapped), words(&long));
        let item = format!("  item  {}", "word ".repeat(30));
        let lines: Vec<String> = wrap(&item, 8).lines().map(str::to_owned).collect();
        assert!(lines[0].starts_with("  item  word") && lines[1].starts_with("        word"));
        assert_eq!(wrap("error: short\n  list", 2), "error: short\n  list");
    }
}
