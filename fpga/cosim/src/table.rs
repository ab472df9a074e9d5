//! The generated table of cycles, `cosim.md` below the target directory: a section of each test that has
//! cycles to compare.

use std::fs;
use std::io;

use crate::verilate::target_folder;

/// Prints `rows` of Markdown and makes them the table's section `name`; those of other tests stay.
///
/// # Errors
/// Those of writing files.
pub fn write(name: &str, rows: &[String]) -> io::Result<()> {
    let text = format!("## {name}\n\n{}\n", rows.join("\n"));
    println!("{text}");
    let sections = target_folder().join("cosim-tables");
    fs::create_dir_all(&sections)?;
    fs::write(sections.join(format!("{name}.md")), text)?;
    let files = fs::read_dir(&sections)?.map(|entry| Ok(entry?.path()));
    let mut files = files.collect::<io::Result<Vec<_>>>()?;
    files.sort();
    let texts = files.iter().map(fs::read_to_string).collect::<io::Result<Vec<_>>>()?;
    // Tests may do this at the same time; each has its section in place by now.
    let whole = sections.with_file_name(format!("cosim-{}-{name}.md", std::process::id()));
    fs::write(&whole, texts.join("\n"))?;
    fs::rename(whole, sections.with_file_name("cosim.md"))
}
