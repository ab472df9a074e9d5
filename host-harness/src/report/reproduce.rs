//! Experiments as text, JSON and a page of HTML.

use std::fmt;
use std::path::PathBuf;

use image::ImageError;
use serde::Serialize;

use super::html::{Figure, Page, Source};
use super::{Table, units, wrap};
use crate::experiments::{self, Chart, Outcome, Row, Value};

/// What the experiments of a run found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ReproduceReport {
    /// Version of the program.
    pub version: &'static str,
    /// One each, in the order of the papers.
    pub experiments: Vec<Outcome>,
    /// How long the host took, in seconds: measured.
    pub host_s: f64,
    /// The page, if one was written.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub report: Option<PathBuf>,
}

impl ReproduceReport {
    /// The ids of the experiments that found no model at hand.
    pub fn without_models(&self) -> Vec<&'static str> {
        self.experiments.iter().filter(|e| e.nothing_at_hand).map(|e| e.id).collect()
    }

    /// The drawings.
    pub fn charts(&self) -> impl Iterator<Item = &Chart> {
        self.experiments.iter().flat_map(|experiment| &experiment.charts)
    }

    /// The page.
    pub fn page(&self) -> String {
        let below = format!(
            "Xylem {}: the tables and figures of the papers made again. P1 is T. Viitanen et al., \
             MergeTree: a HLBVH constructor for mobile systems, 2015; P2 is their MergeTree: A Fast \
             Hardware HLBVH Constructor for Animated Ray Tracing, 2017.",
            self.version
        );
        let mut page = Page::new("The papers' tables, reproduced", &below);
        for outcome in &self.experiments {
            page.section(&format!("{}: {}", outcome.place, outcome.title));
            for line in &outcome.configuration {
                page.paragraph(line);
            }
            for table in &outcome.tables {
                let source = strongest(table);
                page.wide(Figure::table(&text_table(table), &table.caption, source));
            }
            for chart in &outcome.charts {
                page.wide(Figure::drawing(&chart.timeline.svg(), &chart.caption, Source::Modelled));
            }
            page.list(outcome.notes.iter().cloned().chain(absences(outcome)));
        }
        page.finish()
    }

    /// The drawings as files: name and bytes.
    ///
    /// # Errors
    /// [`ImageError`].
    pub fn chart_files(&self) -> Result<Vec<(String, Vec<u8>)>, ImageError> {
        let mut files = Vec::new();
        for chart in self.charts() {
            files.push((format!("{}.svg", chart.name), chart.timeline.svg().into_bytes()));
            files.push((format!("{}.png", chart.name), chart.timeline.picture().to_png()?));
        }
        Ok(files)
    }
}

/// The models that are not at hand, those with one reason together.
fn absences(outcome: &Outcome) -> Vec<String> {
    let mut reasons: Vec<(&str, Vec<&str>)> = Vec::new();
    for missing in &outcome.missing {
        match reasons.iter_mut().find(|(why, _)| *why == missing.why) {
            Some((_, scenes)) => scenes.push(missing.scene),
            None => reasons.push((&missing.why, vec![missing.scene])),
        }
    }
    let line = |(why, scenes): (&str, Vec<&str>)| format!("Missing: {}: {why}.", scenes.join(", "));
    reasons.into_iter().map(line).collect()
}

/// How a table as a whole is marked: by what is least certain in it.
fn strongest(table: &experiments::Table) -> Source {
    let ours =
        |i: usize| table.rows.iter().any(|row| row.values.get(i).is_some_and(|v| v.ours.is_some()));
    let of = |source| {
        table.columns.iter().enumerate().any(|(i, column)| column.source == source && ours(i))
    };
    match () {
        () if of(Source::Modelled) => Source::Modelled,
        () if of(Source::Computed) => Source::Computed,
        () => Source::Counted,
    }
}

/// A table with the paper's numbers and the deviation beside ours, where there are such.
fn text_table(table: &experiments::Table) -> Table {
    let rows = || table.rows.iter();
    let any = |has: &dyn Fn(&Value) -> bool, column: usize| {
        rows().any(|row| row.values.get(column).is_some_and(has))
    };
    let of = |column| {
        [
            any(&|v| v.ours.is_some(), column),
            any(&|v| v.paper.is_some(), column),
            any(&|v| v.deviation_percent.is_some(), column),
        ]
    };
    let triangles = [
        rows().any(|row| row.triangles.is_some()),
        rows().any(|row| row.paper_triangles.is_some()),
    ];

    let mut header = vec![table.rows_are.to_owned()];
    header.extend(pick(triangles, ["triangles".into(), "paper".into()]));
    for (i, column) in table.columns.iter().enumerate() {
        let shown = of(i);
        let paper = if shown[0] { "paper".to_owned() } else { format!("paper: {}", column.name) };
        let star = if column.source == Source::Modelled { "*" } else { "" };
        header.extend(pick(shown, [format!("{}{star}", column.name), paper, "dev.".into()]));
    }
    let mut text = Table::new(header);
    for row in rows() {
        let mut cells = vec![row.name.clone()];
        cells.extend(pick(triangles, triangle_cells(row)));
        for (i, (column, value)) in table.columns.iter().zip(&row.values).enumerate() {
            let number =
                |n: Option<f64>| n.map_or(String::new(), |n| format!("{n:.0$}", column.places));
            let deviation = value.deviation_percent.map_or(String::new(), percent);
            cells.extend(pick(of(i), [number(value.ours), plain(value.paper), deviation]));
        }
        text.row(cells);
    }
    text
}

fn pick<const N: usize>(shown: [bool; N], cells: [String; N]) -> impl Iterator<Item = String> {
    shown.into_iter().zip(cells).filter_map(|(shown, cell)| shown.then_some(cell))
}

fn triangle_cells(row: &Row) -> [String; 2] {
    let paper = row.paper_triangles.map(|paper| match paper.rounded {
        true => format!("{} K", paper.count / 1000),
        false => units::count(paper.count.into()),
    });
    [row.triangles.map_or(String::new(), units::count), paper.unwrap_or_default()]
}

/// The paper's number with the digits that it has; a quotient of two has none, and gets two.
fn plain(n: Option<f64>) -> String {
    n.map_or(String::new(), |n| ((100.0 * n).round() / 100.0).to_string())
}

fn percent(deviation: f64) -> String {
    // Nothing is minus nothing.
    let rounded = (10.0 * deviation).round() / 10.0 + 0.0;
    format!("{rounded:+.1} %")
}

impl fmt::Display for ReproduceReport {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, outcome) in self.experiments.iter().enumerate() {
            if i > 0 {
                writeln!(f)?;
            }
            writeln!(f, "{}: {} ({})", outcome.place, outcome.title, outcome.id)?;
            let mut modelled = false;
            for table in &outcome.tables {
                modelled |= strongest(table) == Source::Modelled;
                writeln!(f, "\n  {}\n\n{}", table.caption, text_table(table))?;
            }
            if outcome.tables.is_empty() {
                writeln!(f)?;
            }
            if modelled {
                writeln!(f, "  * modelled")?;
            }
            for line in &outcome.configuration {
                writeln!(f, "{}", wrap(&format!("  {line}"), 4))?;
            }
            for note in outcome.notes.iter().cloned().chain(absences(outcome)) {
                writeln!(f, "{}", wrap(&format!("  - {note}"), 4))?;
            }
        }
        writeln!(f, "\nDone in {:.1} s (measured)", self.host_s)?;
        if let Some(report) = &self.report {
            writeln!(f, "Page with tables and charts: {}", report.display())?;
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::experiments::{Column, scenes};

    #[test]
    fn columns_show_what_there_is() {
        let columns = [
            Column::new("a", "a", Source::Modelled),
            Column::new("b", "b", Source::Counted),
            Column::new("c", "c", Source::Counted).places(0),
        ];
        let mut table = experiments::Table::new("t", "scene", columns);
        let values = [Value::both(1.5, 1.0), Value::paper(2.25), Value::ours(3.2)];
        table.scene(&scenes::SIBENIK, Some(80_479), values);
        table.row("mean", [Value::ours(-0.0), Value::paper(7.0), Value::NONE]);
        let text = text_table(&table);
        let header = ["scene", "triangles", "paper", "a*", "paper", "dev.", "paper: b", "c"];
        assert_eq!(text.rows()[0], header);
        let sibenik = ["Sibenik", "80,479", "75 K", "1.50", "1", "+50.0 %", "2.25", "3"];
        assert_eq!(text.rows()[1], sibenik);
        assert_eq!(text.rows()[2], ["mean", "", "", "-0.00", "", "", "7", ""]);
        assert_eq!(percent(-0.01), "+0.0 %");
    }
}
