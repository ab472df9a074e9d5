//! Standard output and standard error.

use std::error::Error;
use std::io::{self, ErrorKind, Write};

use serde::Serialize;

use super::CliError;
use crate::report::wrap;

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
