//! Files that are written whole or not at all.

use std::ffi::OsString;
use std::fs;
use std::io;
use std::path::{Path, PathBuf};

use super::CliError;

/// Finds out, before long work, whether a file can be written; leaves nothing behind.
///
/// # Errors
/// [`CliError::Write`].
pub(super) fn check_writable(path: &Path) -> Result<(), CliError> {
    let partial = partial(path);
    let tried = match path.is_dir() {
        true => Err(io::Error::from(io::ErrorKind::IsADirectory)),
        false => fs::File::create(&partial).and_then(|_| fs::remove_file(&partial)),
    };
    tried.map_err(failed(path))
}

/// Writes a file beside its place and moves it there, so that nobody sees half of it.
///
/// # Errors
/// [`CliError::Write`].
pub(super) fn write(path: &Path, bytes: &[u8]) -> Result<(), CliError> {
    let partial = partial(path);
    let written = fs::write(&partial, bytes).and_then(|()| fs::rename(&partial, path));
    written.map_err(|source| {
        // It may not exist; the write's own error is the one to report.
        let _ = fs::remove_file(&partial);
        failed(path)(source)
    })
}

/// Makes a folder, if it is not there, and checks that files can be written into it.
///
/// # Errors
/// [`CliError::Write`].
pub(super) fn folder(path: &Path) -> Result<(), CliError> {
    fs::create_dir_all(path).map_err(failed(path))?;
    check_writable(&path.join("index.html"))
}

fn failed(path: &Path) -> impl FnOnce(io::Error) -> CliError {
    move |source| CliError::Write { path: path.to_owned(), source }
}

fn partial(path: &Path) -> PathBuf {
    let mut name = OsString::from(path);
    name.push(".partial");
    PathBuf::from(name)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn files_appear_whole_and_checks_leave_nothing() {
        let dir = tempfile::tempdir().unwrap();
        let path = dir.path().join("a.bin");
        check_writable(&path).unwrap();
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 0);
        write(&path, b"abc").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"abc");
        assert_eq!(fs::read_dir(dir.path()).unwrap().count(), 1);
        check_writable(dir.path()).unwrap_err();
        write(&dir.path().join("none/a.bin"), b"abc").unwrap_err();
    }
}
