//! `xylem reproduce`.

use std::path::{Path, PathBuf};
use std::time::Instant;

use clap::builder::PossibleValuesParser;
use serde::Serialize;

use super::{CliError, Console, output, progress};
use crate::experiments::{EXPERIMENTS, Experiment, ExperimentError, Lab};
use crate::report::ReproduceReport;

/// Make the papers' tables and figures again, ours beside theirs
///
/// Each experiment is one published table or figure. It builds the papers' models with the papers'
/// parameters and prints our numbers, the paper's, and the deviation in per cent, with notes on why
/// they differ. Modelled numbers are marked.
///
/// Models are looked for by name in scenes/ and in $XYLEM_SCENES; `scenes/fetch.sh` brings some. One
/// that is not at hand is named and left out. Experiments that need no model always run; one that
/// finds none of its models says which are missing, and the exit code is then 1.
#[derive(Debug, clap::Args)]
#[command(after_help = "Examples:\n  \
    xylem reproduce --list\n  \
    xylem reproduce p2-table6\n  \
    xylem reproduce p1-table1 p2-table1 --json\n  \
    XYLEM_SCENES=~/meshes xylem reproduce --all --out report")]
pub(super) struct Args {
    /// Experiments, see --list
    #[arg(value_name = "ID", value_parser = PossibleValuesParser::new(EXPERIMENTS.iter().map(|e| e.id)),
          hide_possible_values = true)]
    ids: Vec<String>,
    /// List the experiments; so does no option at all
    #[arg(long, conflicts_with_all = ["ids", "all"])]
    list: bool,
    /// Make all of them
    #[arg(long, conflicts_with = "ids")]
    all: bool,
    /// Folder for the page with every table and chart, and for the charts alone as SVG and PNG; made
    /// if it is not there. With --all and for figures it is xylem-reproduce if not given; tables
    /// alone leave no files without it
    #[arg(long, value_name = "DIR", conflicts_with = "list")]
    out: Option<PathBuf>,
}

/// Runs the command.
pub(super) fn run(args: &Args, console: Console) -> Result<(), CliError> {
    let wanted: Vec<&Experiment> = match args.all {
        true => EXPERIMENTS.iter().collect(),
        false => EXPERIMENTS.iter().filter(|e| args.ids.iter().any(|id| id == e.id)).collect(),
    };
    if wanted.is_empty() {
        let list = List::new();
        return console.result(&list, || list.text());
    }
    let figures = wanted.iter().any(|experiment| experiment.place.contains("Fig."));
    let default = (args.all || figures).then(|| PathBuf::from("xylem-reproduce"));
    let out = args.out.clone().or(default);
    if let Some(out) = &out {
        output::folder(out)?;
    }

    let start = Instant::now();
    let spinner = progress::spinner("reproducing");
    let say = |what: &str| spinner.set_message(what.to_owned());
    let lab = Lab::new(&say);
    let mut experiments = Vec::new();
    for experiment in wanted {
        experiments.push(experiment.run(&lab)?);
    }
    spinner.finish_and_clear();

    let page = out.as_ref().map(|out| out.join("index.html"));
    let report = ReproduceReport {
        version: env!("CARGO_PKG_VERSION"),
        experiments,
        host_s: start.elapsed().as_secs_f64(),
        report: page.clone(),
    };
    if let (Some(out), Some(page)) = (&out, &page) {
        write(&report, out, page)?;
    }
    console.result(&report, || report.to_string())?;
    match report.without_models().as_slice() {
        [] => Ok(()),
        ids => Err(CliError::NoModels { ids: ids.join(", ") }),
    }
}

fn write(report: &ReproduceReport, out: &Path, page: &Path) -> Result<(), CliError> {
    let failed = |source| CliError::Image { path: page.to_owned(), source };
    for (name, bytes) in report.chart_files().map_err(failed)? {
        output::write(&out.join(name), &bytes)?;
    }
    output::write(page, report.page().as_bytes())
}

impl From<ExperimentError> for CliError {
    fn from(error: ExperimentError) -> Self {
        match error {
            ExperimentError::Scene(error) => error.into(),
            ExperimentError::Build { scene, source } => Self::Build { scene, source },
            ExperimentError::Trace { scene, source } => Self::Trace { scene, source },
            ExperimentError::Refit { scene, source } => Self::Refit { scene, source },
        }
    }
}

/// The list of experiments.
#[derive(Debug, Serialize)]
struct List {
    experiments: Vec<Entry>,
}

#[derive(Debug, Serialize)]
struct Entry {
    id: &'static str,
    place: &'static str,
    title: &'static str,
    needs_models: bool,
}

impl List {
    fn new() -> Self {
        let entry = |e: &Experiment| Entry {
            id: e.id,
            place: e.place,
            title: e.title,
            needs_models: e.needs_scenes,
        };
        Self { experiments: EXPERIMENTS.iter().map(entry).collect() }
    }

    fn text(&self) -> String {
        let width = |of: fn(&Entry) -> &str| self.experiments.iter().map(|e| of(e).len()).max();
        let (ids, places) = (width(|e| e.id).unwrap_or(0), width(|e| e.place).unwrap_or(0));
        let mut text = String::new();
        for Entry { id, place, title, needs_models } in &self.experiments {
            let models = if *needs_models { "" } else { " (needs no model)" };
            text += &format!("  {id:<ids$}  {place:<places$}  {title}{models}\n");
        }
        text
    }
}
