//! Runs an engine that is a process of its own, with a time limit.

use std::io::Read;
use std::path::PathBuf;
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::atomic::{AtomicU32, Ordering};
use std::thread::{self, JoinHandle};
use std::time::{Duration, Instant};

use super::SocError;

/// What a process did.
#[derive(Debug)]
pub(super) struct Finished {
    pub stdout: Vec<u8>,
    pub stderr: String,
    /// `None` if it was stopped at the limit.
    pub status: Option<ExitStatus>,
    pub time: Duration,
}

/// Kills the process when the run is over, however it ends.
struct Running(Child);

impl Drop for Running {
    fn drop(&mut self) {
        // Both fail only if the process is gone already.
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// Runs a command to its end or to the limit, with an empty standard input.
pub(super) fn run(command: &mut Command, limit: Duration) -> Result<Finished, SocError> {
    let name = command.get_program().to_string_lossy().into_owned();
    let failed = |what: &str| SocError::io(format!("{what} {name}"));
    let start = Instant::now();
    command.stdin(Stdio::null()).stdout(Stdio::piped()).stderr(Stdio::piped());
    let mut running = Running(command.spawn().map_err(failed("starting"))?);
    let stdout = collect(running.0.stdout.take());
    let stderr = collect(running.0.stderr.take());
    let status = loop {
        match running.0.try_wait().map_err(failed("waiting for"))? {
            Some(status) => break Some(status),
            None if start.elapsed() > limit => break None,
            None => thread::sleep(Duration::from_millis(5)),
        }
    };
    let time = start.elapsed();
    drop(running);
    let bytes = |reader: JoinHandle<Vec<u8>>| reader.join().unwrap_or_default();
    let (stdout, stderr) = (bytes(stdout), bytes(stderr));
    Ok(Finished { stdout, stderr: String::from_utf8_lossy(&stderr).into_owned(), status, time })
}

/// Reads a pipe to its end beside the process, so that a full pipe never stalls it.
fn collect(pipe: Option<impl Read + Send + 'static>) -> JoinHandle<Vec<u8>> {
    thread::spawn(move || {
        let mut bytes = Vec::new();
        if let Some(mut pipe) = pipe {
            // What was read before an error stays in `bytes`, and that is all there is.
            let _ = pipe.read_to_end(&mut bytes);
        }
        bytes
    })
}

/// A folder for one run's files, removed with its value.
#[derive(Debug)]
pub(super) struct Folder(PathBuf);

impl Folder {
    /// A new folder below the system's temporary one.
    pub fn new(name: &str) -> Result<Self, SocError> {
        static NEXT: AtomicU32 = AtomicU32::new(0);
        let number = NEXT.fetch_add(1, Ordering::Relaxed);
        let path =
            std::env::temp_dir().join(format!("xylem-{name}-{}-{number}", std::process::id()));
        std::fs::create_dir_all(&path)
            .map_err(SocError::io(format!("creating {}", path.display())))?;
        Ok(Self(path))
    }

    /// Writes a file into the folder and returns its path.
    pub fn write(&self, name: &str, bytes: &[u8]) -> Result<PathBuf, SocError> {
        let path = self.0.join(name);
        std::fs::write(&path, bytes)
            .map_err(SocError::io(format!("writing {}", path.display())))?;
        Ok(path)
    }
}

impl Drop for Folder {
    fn drop(&mut self) {
        // A leftover in the temporary folder is no reason to fail.
        let _ = std::fs::remove_dir_all(&self.0);
    }
}
