//! The record of long runs, `tests/RESULTS.md`.

use std::fs;
use std::path::Path;
use std::sync::Mutex;
use std::time::SystemTime;

use crate::places;

const HEADER: &str = "# Results of the long runs

Written by the tests themselves: run `XYLEM_FULL=1 XYLEM_RECORD=1 cargo test -p xylem-tests` with
`XYLEM_SCENES` and `XYLEM_ORACLE` set. The counts are the same on every machine.
";

static FILE: Mutex<()> = Mutex::new(());

/// Prints `body`, and puts it into `tests/RESULTS.md` under `title`, in place of what was there, if
/// the run is to be recorded.
///
/// # Panics
/// If the file cannot be written.
pub fn report(title: &str, body: &str) {
    println!("{title}\n\n{body}");
    if !places::record() {
        return;
    }
    let _guard = FILE.lock().unwrap_or_else(|poisoned| poisoned.into_inner());
    let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("RESULTS.md");
    let old = fs::read_to_string(&path).unwrap_or_else(|_| HEADER.to_owned());
    let mut sections: Vec<String> = old.split("\n## ").skip(1).map(str::to_owned).collect();
    let section = format!("{title}\n\n{}\n", body.trim_end());
    match sections.iter_mut().find(|s| s.lines().next() == Some(title)) {
        Some(found) => *found = section,
        None => sections.push(section),
    }
    sections.sort();
    let text = sections.iter().fold(HEADER.trim_end().to_owned() + "\n", |text, section| {
        text + "\n## " + section.trim_end() + "\n"
    });
    fs::write(&path, text).unwrap_or_else(|e| panic!("{}: {e}", path.display()));
}

/// Today's date in UTC, as `2025-01-31`.
pub fn today() -> String {
    let seconds =
        SystemTime::now().duration_since(SystemTime::UNIX_EPOCH).map_or(0, |d| d.as_secs());
    // Days to a civil date, counting years from March (H. Hinnant, "chrono-compatible algorithms").
    let days = seconds / 86_400 + 719_468;
    let (era, day) = (days / 146_097, days % 146_097);
    let year = (day - day / 1460 + day / 36_524 - day / 146_096) / 365;
    let of_year = day - (365 * year + year / 4 - year / 100);
    let march = (5 * of_year + 2) / 153;
    let month = if march < 10 { march + 3 } else { march - 9 };
    let day = of_year - (153 * march + 2) / 5 + 1;
    let year = era * 400 + year + u64::from(month <= 2);
    format!("{year}-{month:02}-{day:02}")
}
