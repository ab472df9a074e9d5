//! Trace files: a request a line, as Ramulator 1's DRAM traces.

use std::fs::File;
use std::io::{self, BufRead, BufReader};
use std::path::{Path, PathBuf};

use flate2::bufread::MultiGzDecoder;

/// A trace file, read line by line: `0xADDRESS R` or `0xADDRESS W`, 64 bytes each, the address in
/// bytes and hexadecimal. The file may be gzipped, which is told by its first bytes. Empty lines and
/// what follows a `#` do not count.
///
/// As an iterator, gives the address and whether it is a write. A file without requests is an error.
pub struct TraceFile {
    path: PathBuf,
    reader: Box<dyn BufRead>,
    line: String,
    number: u64,
    empty: bool,
}

/// Why a trace file cannot be replayed.
#[derive(Debug, thiserror::Error)]
pub enum TraceError {
    /// The file cannot be read.
    #[error("{}: cannot read it: {source}; check the path and that the file is whole", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// What the system or the decoder said.
        source: io::Error,
    },
    /// There is no request in the file.
    #[error("{}: no request in it; write lines such as `0x1f40 R`", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// A line is not a request.
    #[error(
        "{}:{line}: '{text}' is not a request: {what}; write the byte address and R or W, such as \
         `0x1f40 R`", path.display()
    )]
    Line {
        /// The file.
        path: PathBuf,
        /// The line, from 1.
        line: u64,
        /// The line, shortened.
        text: String,
        /// What is wrong with it.
        what: &'static str,
    },
}

/// How much of a bad line is quoted.
const QUOTED: usize = 40;

impl TraceFile {
    /// Opens a trace file.
    ///
    /// # Errors
    /// [`TraceError::Io`].
    pub fn open(path: &Path) -> Result<Self, TraceError> {
        let failed = |source| TraceError::Io { path: path.to_owned(), source };
        let mut file = BufReader::new(File::open(path).map_err(failed)?);
        let packed = file.fill_buf().map_err(failed)?.starts_with(&[0x1f, 0x8b]);
        let reader: Box<dyn BufRead> = match packed {
            true => Box::new(BufReader::new(MultiGzDecoder::new(file))),
            false => Box::new(file),
        };
        Ok(Self { path: path.to_owned(), reader, line: String::new(), number: 0, empty: true })
    }

    fn next_request(&mut self) -> Result<Option<(u64, bool)>, TraceError> {
        loop {
            self.line.clear();
            self.number += 1;
            let read = self.reader.read_line(&mut self.line);
            if read.map_err(|source| TraceError::Io { path: self.path.clone(), source })? == 0 {
                return match self.empty {
                    true => Err(TraceError::Empty { path: self.path.clone() }),
                    false => Ok(None),
                };
            }
            let text = self.line.split('#').next().unwrap_or_default().trim();
            if text.is_empty() {
                continue;
            }
            self.empty = false;
            return parse(text).map(Some).map_err(|what| TraceError::Line {
                path: self.path.clone(),
                line: self.number,
                text: text.chars().take(QUOTED).collect(),
                what,
            });
        }
    }
}

impl Iterator for TraceFile {
    type Item = Result<(u64, bool), TraceError>;

    fn next(&mut self) -> Option<Self::Item> {
        self.next_request().transpose()
    }
}

impl std::fmt::Debug for TraceFile {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        f.debug_struct("TraceFile").field("path", &self.path).field("line", &self.number).finish()
    }
}

/// An address and whether it is a write.
fn parse(text: &str) -> Result<(u64, bool), &'static str> {
    let mut words = text.split_ascii_whitespace();
    let (address, kind) = (words.next().unwrap_or_default(), words.next());
    let digits = address.strip_prefix("0x").or_else(|| address.strip_prefix("0X"));
    let digits = digits.ok_or("the address does not begin with 0x")?;
    let address = u64::from_str_radix(digits, 16)
        .map_err(|_| "the address is not a hexadecimal number of up to 64 bits")?;
    let write = match kind {
        Some("R") => false,
        Some("W") => true,
        Some(_) => return Err("the second word is neither R nor W"),
        None => return Err("there is no R or W"),
    };
    match words.next() {
        None => Ok((address, write)),
        Some(_) => Err("there is a third word"),
    }
}

#[cfg(test)]
mod tests {
    use std::io::Write;

    use flate2::Compression;
    use flate2::write::GzEncoder;

    use super::*;

    const TEXT: &str = "0x40 R\n\n  # a remark\n0X1fC0 W # another\n0xffffffffffffffc0 R";

    fn read(bytes: &[u8]) -> Result<Vec<(u64, bool)>, TraceError> {
        let mut file = tempfile::NamedTempFile::new().unwrap();
        file.write_all(bytes).unwrap();
        TraceFile::open(file.path())?.collect()
    }

    #[test]
    fn traces_are_read_plain_and_gzipped() {
        let expected = vec![(0x40, false), (0x1fc0, true), (u64::MAX - 63, false)];
        assert_eq!(read(TEXT.as_bytes()).unwrap(), expected);
        let mut packer = GzEncoder::new(Vec::new(), Compression::fast());
        packer.write_all(TEXT.as_bytes()).unwrap();
        let packed = packer.finish().unwrap();
        assert_eq!(read(&packed).unwrap(), expected);
        let error = read(&packed[..packed.len() - 4]).unwrap_err().to_string();
        assert!(error.contains("cannot read it"), "{error}");
    }

    #[test]
    fn bad_lines_are_named_with_their_number_and_what_is_wrong() {
        let cases = [
            ("0x40 R\n40 R\n", "begin with 0x"),
            ("0x0 R\n0xg R\n", "hexadecimal"),
            ("\n0x10000000000000000 W\n", "64 bits"),
            ("0x0 R\n0x40\n", "no R or W"),
            ("0x0 R\n0x40 r\n", "neither R nor W"),
            ("0x0 R\n0x40 R 5\n", "third word"),
        ];
        for (text, what) in cases {
            let error = read(text.as_bytes()).unwrap_err().to_string();
            assert!(error.contains(":2: '") && error.contains(what), "{error}");
        }
    }

    #[test]
    fn a_missing_file_and_one_without_requests_are_named() {
        let error = read(b"# nothing\n\n").unwrap_err().to_string();
        assert!(error.contains("no request"), "{error}");
        let error = TraceFile::open(Path::new("no/such.trace")).unwrap_err().to_string();
        assert!(error.starts_with("no/such.trace: cannot read it"), "{error}");
    }
}
