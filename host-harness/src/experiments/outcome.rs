//! What an experiment found: tables of ours beside theirs, charts, and notes.

use serde::Serialize;
use serde::ser::SerializeMap;

use super::scenes::{PaperScene, PaperTriangles};
use super::{Experiment, ExperimentError, Lab, Loaded};
use crate::report::html::Source;
use crate::report::timeline::Timeline;
use crate::scene::manifest::{Kind, Manifest};

/// What an experiment found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Outcome {
    /// The experiment.
    pub id: &'static str,
    /// Where it was published.
    pub place: &'static str,
    /// What it shows.
    pub title: &'static str,
    /// What was built, and the machine and memory that were modelled.
    pub configuration: Vec<String>,
    /// The numbers.
    pub tables: Vec<Table>,
    /// The drawings.
    pub charts: Vec<Chart>,
    /// Why numbers differ, and where ours differ on purpose.
    pub notes: Vec<String>,
    /// The models that it wanted and that are not at hand.
    pub missing: Vec<Missing>,
    /// Whether models were wanted and none was at hand, so that there are no numbers.
    pub nothing_at_hand: bool,
}

/// Ours and theirs.
#[derive(Debug, Clone, Copy, PartialEq, Default, Serialize)]
pub struct Value {
    /// Ours.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub ours: Option<f64>,
    /// The paper's.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub paper: Option<f64>,
    /// How much ours is above the paper's, in per cent of that.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub deviation_percent: Option<f64>,
}

/// A table: rows are models or methods, columns quantities.
#[derive(Debug, Clone, PartialEq)]
pub struct Table {
    /// What its numbers are.
    pub caption: String,
    /// What the rows are: `scene`, `sort`.
    pub rows_are: &'static str,
    /// The quantities.
    pub columns: Vec<Column>,
    /// The rows.
    pub rows: Vec<Row>,
}

/// A quantity.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Column {
    /// Its key in JSON, with its unit.
    pub key: &'static str,
    /// Its heading, with its unit.
    pub name: &'static str,
    /// Digits after the point.
    #[serde(skip)]
    pub places: usize,
    /// Where our numbers come from.
    pub source: Source,
}

/// A row of a table.
#[derive(Debug, Clone, PartialEq)]
pub struct Row {
    /// What it is about.
    pub name: String,
    /// How many triangles our mesh has, if it is about a mesh.
    pub triangles: Option<u64>,
    /// How many the paper's has, where it says so.
    pub paper_triangles: Option<PaperTriangles>,
    /// One a column.
    pub values: Vec<Value>,
}

/// A drawing.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Chart {
    /// The stem of its files.
    pub name: String,
    /// What it shows.
    pub caption: String,
    /// The lines.
    #[serde(skip)]
    pub timeline: Timeline,
}

/// A model that is not at hand.
#[derive(Debug, Clone, PartialEq, Eq, Serialize)]
pub struct Missing {
    /// The paper's name of it.
    pub scene: &'static str,
    /// Why, and what can be done about it.
    pub why: String,
}

impl Outcome {
    /// Nothing found yet.
    pub fn new(experiment: &Experiment) -> Self {
        Self {
            id: experiment.id,
            place: experiment.place,
            title: experiment.title,
            configuration: Vec::new(),
            tables: Vec::new(),
            charts: Vec::new(),
            notes: Vec::new(),
            missing: Vec::new(),
            nothing_at_hand: false,
        }
    }

    /// Those of `scenes` that are at hand; the others are noted as missing.
    ///
    /// # Errors
    /// [`ExperimentError::Scene`].
    pub fn scenes(
        &mut self,
        lab: &Lab<'_>,
        scenes: &[&'static PaperScene],
    ) -> Result<Vec<Loaded>, ExperimentError> {
        let (here, missing) = lab.scenes(scenes)?;
        self.missing.extend(missing);
        self.nothing_at_hand = here.is_empty();
        Ok(here)
    }

    /// The value in the first table of a row and a column, by their names.
    pub fn value(&self, row: &str, key: &str) -> Option<Value> {
        self.tables.iter().find_map(|table| {
            let column = table.columns.iter().position(|column| column.key == key)?;
            table.rows.iter().find(|r| r.name == row)?.values.get(column).copied()
        })
    }
}

impl Value {
    /// Neither.
    pub const NONE: Self = Self { ours: None, paper: None, deviation_percent: None };

    /// Ours, and the paper's where it has one.
    pub fn new(ours: Option<f64>, paper: Option<f64>) -> Self {
        let deviation_percent = match (ours, paper) {
            (Some(ours), Some(paper)) if paper != 0.0 => Some(100.0 * (ours / paper - 1.0)),
            _ => None,
        };
        Self { ours, paper, deviation_percent }
    }

    /// Both.
    pub fn both(ours: f64, paper: f64) -> Self {
        Self::new(Some(ours), Some(paper))
    }

    /// Ours, of which the paper says nothing.
    pub fn ours(ours: f64) -> Self {
        Self::new(Some(ours), None)
    }

    /// The paper's alone.
    pub fn paper(paper: f64) -> Self {
        Self::new(None, Some(paper))
    }
}

impl Table {
    /// A table without rows.
    pub fn new(
        caption: impl Into<String>,
        rows_are: &'static str,
        columns: impl Into<Vec<Column>>,
    ) -> Self {
        Self { caption: caption.into(), rows_are, columns: columns.into(), rows: Vec::new() }
    }

    /// Adds a row about a method or a mean.
    pub fn row(&mut self, name: impl Into<String>, values: impl Into<Vec<Value>>) {
        let (name, values) = (name.into(), values.into());
        self.rows.push(Row { name, triangles: None, paper_triangles: None, values });
    }

    /// Adds a row about a model.
    pub fn scene(
        &mut self,
        scene: &PaperScene,
        triangles: Option<u64>,
        values: impl Into<Vec<Value>>,
    ) {
        let (name, values) = (scene.name.to_owned(), values.into());
        self.rows.push(Row { name, triangles, paper_triangles: scene.triangles, values });
    }

    /// The mean of our values in a column over the rows so far.
    pub fn mean(&self, column: usize) -> Option<f64> {
        let ours = self.rows.iter().filter_map(|row| row.values.get(column)?.ours);
        let (sum, count) = ours.fold((0.0, 0u32), |(sum, count), x| (sum + x, count + 1));
        (count > 0).then(|| sum / f64::from(count))
    }
}

impl Column {
    /// A column with two digits after the point.
    pub const fn new(key: &'static str, name: &'static str, source: Source) -> Self {
        Self { key, name, places: 2, source }
    }

    /// The same with another number of digits.
    pub const fn places(self, places: usize) -> Self {
        Self { places, ..self }
    }
}

impl Missing {
    /// A model that was not found.
    pub fn new(scene: &PaperScene) -> Self {
        let fetched = |mesh: &str| {
            let manifest = Manifest::bundled().ok();
            manifest.is_some_and(|m| m.get(mesh).is_some_and(|entry| entry.kind == Kind::Fetched))
        };
        let why = match scene.mesh {
            Some(mesh) => format!(
                "no mesh '{mesh}'; {}put {mesh}.obj or {mesh}.obj.gz into a folder of $XYLEM_SCENES",
                if fetched(mesh) {
                    format!("run `scenes/fetch.sh {mesh}`, or ")
                } else {
                    String::new()
                }
            ),
            None => "no public package is known to have the paper's version".to_owned(),
        };
        Self { scene: scene.name, why }
    }

    /// A model of which there is another version.
    pub fn other(scene: &PaperScene, triangles: usize) -> Self {
        let mesh = scene.mesh.unwrap_or(scene.name);
        let why = format!("the mesh '{mesh}' has {triangles} triangles, so it is another version");
        Self { scene: scene.name, why }
    }
}

impl Serialize for Table {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry("caption", &self.caption)?;
        map.serialize_entry("columns", &self.columns)?;
        let rows: Vec<_> =
            self.rows.iter().map(|row| KeyedRow(self.rows_are, &self.columns, row)).collect();
        map.serialize_entry("rows", &rows)?;
        map.end()
    }
}

/// A row whose values have their columns' keys.
struct KeyedRow<'a>(&'static str, &'a [Column], &'a Row);

impl Serialize for KeyedRow<'_> {
    fn serialize<S: serde::Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        let Self(rows_are, columns, row) = self;
        let mut map = serializer.serialize_map(None)?;
        map.serialize_entry(rows_are, &row.name)?;
        if let Some(triangles) = row.triangles {
            map.serialize_entry("triangles", &triangles)?;
        }
        if let Some(triangles) = row.paper_triangles {
            map.serialize_entry("paper_triangles", &triangles)?;
        }
        for (column, value) in columns.iter().zip(&row.values) {
            if *value != Value::NONE {
                map.serialize_entry(column.key, value)?;
            }
        }
        map.end()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_deviation_is_ours_over_the_papers() {
        assert!((Value::both(11.0, 10.0).deviation_percent.unwrap() - 10.0).abs() < 1e-9);
        assert_eq!(Value::ours(1.0).deviation_percent, None);
        assert_eq!(Value::both(1.0, 0.0).deviation_percent, None);
        assert_eq!(Value::new(None, None), Value::NONE);
    }

    #[test]
    fn rows_are_objects_keyed_by_column_and_absent_values_are_absent() {
        let column = |key| Column::new(key, "x", Source::Counted);
        let mut table = Table::new("t", "scene", [column("a_mib"), column("b_mib")]);
        table.scene(&super::super::scenes::SIBENIK, Some(5), [Value::both(3.0, 2.0), Value::NONE]);
        table.row("mean", [Value::paper(4.0), Value::ours(1.0)]);
        let json = serde_json::to_value(&table).unwrap();
        let sibenik = &json["rows"][0];
        assert_eq!((&sibenik["scene"], &sibenik["triangles"]), (&"Sibenik".into(), &5.into()));
        assert_eq!(sibenik["paper_triangles"], 75_000);
        assert_eq!(sibenik["a_mib"]["deviation_percent"], 50.0);
        assert!(sibenik.get("b_mib").is_none());
        assert_eq!(json["rows"][1]["a_mib"], serde_json::json!({ "paper": 4.0 }));
        assert_eq!(table.mean(0), Some(3.0));
    }
}
