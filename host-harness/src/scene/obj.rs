//! Wavefront OBJ files, plain or gzipped, through `tobj`.
//!
//! Only geometry counts. `tobj` is shown the `v` and `f` lines alone, one at a time: objects, groups
//! and materials cannot split or reorder the mesh, so triangle ids follow the file, and the line at
//! which `tobj` stops is the line to report. Its own triangulation is left off; faces are fanned here
//! from their first vertex (`a b c d` becomes `a b c`, `a c d`), and counted.
//!
//! What a `v` line has after its third number (a weight, a colour) is ignored, as is a vertex that no
//! face uses. Faces of one or two vertices are skipped and counted. `\r\n` ends a line like `\n`.

use std::io::{self, BufRead, Read};
use std::path::Path;

use super::error::{ObjProblem, SceneError};
use super::frame::SceneFrame;
use super::mesh::{LoadOptions, Mesh};

/// Loads an OBJ file, gzipped or not (told by its first bytes), named after the file.
///
/// # Errors
/// [`SceneError`] when the file cannot be read, is not an OBJ with at least one face, or does not fit
/// the grid.
pub fn load(path: &Path, options: &LoadOptions) -> Result<Mesh, SceneError> {
    parse(&read_text(path)?, path, options)
}

/// Reads a file whole and unpacks it if it starts as gzip does.
///
/// # Errors
/// [`SceneError::Read`] and [`SceneError::Gzip`].
pub fn read_text(path: &Path) -> Result<Vec<u8>, SceneError> {
    let raw =
        std::fs::read(path).map_err(|source| SceneError::Read { path: path.to_owned(), source })?;
    if !raw.starts_with(&[0x1f, 0x8b]) {
        return Ok(raw);
    }
    let mut text = Vec::with_capacity(raw.len() * 4);
    flate2::read::MultiGzDecoder::new(raw.as_slice())
        .read_to_end(&mut text)
        .map_err(|source| SceneError::Gzip { path: path.to_owned(), source })?;
    Ok(text)
}

/// Parses the text of an OBJ file; `path` is for messages and the mesh's name.
///
/// # Errors
/// As [`load`].
pub fn parse(text: &[u8], path: &Path, options: &LoadOptions) -> Result<Mesh, SceneError> {
    let at = |line, problem| SceneError::Obj { path: path.to_owned(), line, problem };
    if text.is_empty() {
        return Err(at(None, ObjProblem::Empty));
    }
    let no_faces = |skipped| {
        let vertices = lines(text).filter(|line| line.keyword == b"v").count();
        at(None, ObjProblem::NoFaces { vertices, skipped })
    };
    let mut geometry = GeometryLines::new(text);
    let loaded = tobj::load_obj_buf(&mut geometry, &tobj::LoadOptions::default(), |_| {
        Ok((Vec::new(), Default::default()))
    });
    let models = match loaded {
        Ok((models, _)) => models,
        Err(error) => {
            let (line, problem) = diagnose(error, geometry.last, text);
            return Err(at(line, problem));
        }
    };
    // No `o`, `g` or `usemtl` line reached the parser: there is one model.
    let Some(model) = models.into_iter().next() else { return Err(no_faces(0)) };
    let positions = model.mesh.positions.as_chunks::<3>().0.to_vec();
    if let Some((line, problem)) = misplaced(&positions, options.frame.as_ref(), text) {
        return Err(at(line, problem));
    }
    let fan = Fan::new(&model.mesh.indices, &model.mesh.face_arities);
    if fan.triangles.is_empty() {
        return Err(no_faces(fan.skipped));
    }
    let mesh = Mesh::new(scene_name(path), positions, fan.triangles, options)?;
    Ok(Mesh { fanned: fan.fanned, skipped: fan.skipped, ..mesh })
}

/// A file's name without `.gz` and `.obj`.
fn scene_name(path: &Path) -> String {
    let name = path.file_name().unwrap_or(path.as_os_str()).to_string_lossy().into_owned();
    let name = name.strip_suffix(".gz").unwrap_or(&name);
    name.strip_suffix(".obj").unwrap_or(name).to_owned()
}

/// Faces as triangles.
struct Fan {
    triangles: Vec<[u32; 3]>,
    fanned: usize,
    skipped: usize,
}

impl Fan {
    /// Fans faces of the given arities; no arities means that all are triangles.
    fn new(indices: &[u32], arities: &[u32]) -> Self {
        if arities.is_empty() {
            let triangles = indices.as_chunks::<3>().0.to_vec();
            return Self { triangles, fanned: 0, skipped: 0 };
        }
        let mut fan =
            Self { triangles: Vec::with_capacity(indices.len() / 3), fanned: 0, skipped: 0 };
        let mut rest = indices;
        for &arity in arities {
            let (face, after) = rest.split_at((arity as usize).min(rest.len()));
            rest = after;
            fan.fanned += usize::from(face.len() > 3);
            fan.skipped += usize::from(face.len() < 3);
            if let [first, others @ ..] = face {
                fan.triangles.extend(others.windows(2).map(|pair| [*first, pair[0], pair[1]]));
            }
        }
        fan
    }
}

/// A line of an OBJ file that matters here.
#[derive(Clone, Copy)]
struct Line<'a> {
    /// From 1.
    number: usize,
    /// `v` or `f`.
    keyword: &'static [u8],
    /// What the parser is shown: no comment, and of a vertex the first three numbers.
    text: &'a [u8],
}

/// The `v` and `f` lines of a text.
fn lines(text: &[u8]) -> impl Iterator<Item = Line<'_>> {
    text.split(|&b| b == b'\n').enumerate().filter_map(|(index, raw)| {
        let raw = raw.trim_ascii();
        let keyword: &[u8] = match raw {
            [b'v', b' ' | b'\t', ..] | b"v" => b"v",
            [b'f', b' ' | b'\t', ..] | b"f" => b"f",
            _ => return None,
        };
        let raw = raw.split(|&b| b == b'#').next().unwrap_or(raw).trim_ascii_end();
        let text = if keyword == b"v" { first_words(raw, 4) } else { raw };
        Some(Line { number: index + 1, keyword, text })
    })
}

/// The beginning of a line that holds its first `count` words.
fn first_words(line: &[u8], count: usize) -> &[u8] {
    let mut words = 0;
    let mut in_word = false;
    for (at, byte) in line.iter().enumerate() {
        if in_word && byte.is_ascii_whitespace() && words == count {
            return &line[..at];
        }
        words += usize::from(!in_word && !byte.is_ascii_whitespace());
        in_word = !byte.is_ascii_whitespace();
    }
    line
}

/// Feeds the parser one line at a time and remembers the last.
struct GeometryLines<'a, I> {
    lines: I,
    /// What is left of the last line.
    rest: &'a [u8],
    /// Whether its line end is still to come.
    end_due: bool,
    last: Option<Line<'a>>,
}

impl<'a> GeometryLines<'a, ()> {
    fn new(text: &'a [u8]) -> GeometryLines<'a, impl Iterator<Item = Line<'a>>> {
        GeometryLines { lines: lines(text), rest: &[], end_due: false, last: None }
    }
}

impl<'a, I: Iterator<Item = Line<'a>>> BufRead for GeometryLines<'a, I> {
    fn fill_buf(&mut self) -> io::Result<&[u8]> {
        if self.rest.is_empty() && !self.end_due {
            let Some(line) = self.lines.next() else { return Ok(&[]) };
            (self.rest, self.end_due, self.last) = (line.text, true, Some(line));
        }
        Ok(if self.rest.is_empty() { b"\n" } else { self.rest })
    }

    fn consume(&mut self, amount: usize) {
        if self.rest.is_empty() {
            self.end_due &= amount == 0;
        } else {
            self.rest = &self.rest[amount.min(self.rest.len())..];
        }
    }
}

impl<'a, I: Iterator<Item = Line<'a>>> Read for GeometryLines<'a, I> {
    fn read(&mut self, into: &mut [u8]) -> io::Result<usize> {
        let amount = self.fill_buf()?.read(into)?;
        self.consume(amount);
        Ok(amount)
    }
}

/// The line and the problem behind a refusal of the parser, which stopped after `last`.
fn diagnose(
    error: tobj::LoadError,
    last: Option<Line<'_>>,
    text: &[u8],
) -> (Option<usize>, ObjProblem) {
    use tobj::LoadError::{FaceParseError, FaceVertexOutOfBounds, PositionParseError};
    let number = last.map(|line| line.number);
    let shown = last.map_or(String::new(), |line| shorten(line.text));
    match error {
        PositionParseError => (number, ObjProblem::BadVertex { text: shown }),
        FaceParseError => (number, ObjProblem::BadFace { text: shown }),
        // Indices are checked after the last line; find the one that does not resolve.
        FaceVertexOutOfBounds => out_of_range(text),
        // A line that is not UTF-8 gives a read error.
        other => match last.map(|line| line.keyword) {
            Some(b"v") => (number, ObjProblem::BadVertex { text: shown }),
            Some(b"f") if matches!(other, tobj::LoadError::ReadError) => {
                (number, ObjProblem::BadFace { text: shown })
            }
            _ => (None, ObjProblem::Other { reason: other.to_string() }),
        },
    }
}

/// The first face that refers to a vertex that is not there.
fn out_of_range(text: &[u8]) -> (Option<usize>, ObjProblem) {
    let total = lines(text).filter(|line| line.keyword == b"v").count();
    let mut before = 0;
    for line in lines(text) {
        if line.keyword == b"v" {
            before += 1;
            continue;
        }
        for word in String::from_utf8_lossy(line.text).split_ascii_whitespace().skip(1) {
            let Ok(index) = word.split('/').next().unwrap_or(word).parse::<i64>() else { continue };
            let vertices = if index < 0 { before } else { total };
            if index == 0 || index.unsigned_abs() > vertices as u64 {
                return (Some(line.number), ObjProblem::IndexOutOfRange { index, vertices });
            }
        }
    }
    (None, ObjProblem::Other { reason: "a face refers to a vertex that is not there".into() })
}

/// The first vertex that is not finite or outside the given frame, by line.
fn misplaced(
    positions: &[[f32; 3]],
    frame: Option<&SceneFrame>,
    text: &[u8],
) -> Option<(Option<usize>, ObjProblem)> {
    let finite = |p: &[f32; 3]| p.iter().all(|c| c.is_finite());
    let bad = positions
        .iter()
        .find(|p| !finite(p) || frame.is_some_and(|frame| frame.snap(**p).is_err()))?;
    let coordinates = |line: &Line<'_>| {
        let line = String::from_utf8_lossy(line.text);
        let mut words = line.split_ascii_whitespace().skip(1).map(str::parse::<f32>);
        Some([words.next()?.ok()?, words.next()?.ok()?, words.next()?.ok()?])
    };
    let line = lines(text).find(|line| {
        line.keyword == b"v"
            && coordinates(line).is_some_and(|p| p.map(f32::to_bits) == bad.map(f32::to_bits))
    });
    let problem = match frame.filter(|_| finite(bad)).map(|frame| frame.snap(*bad)) {
        Some(Err(source)) => ObjProblem::OutsideFrame { source },
        _ => ObjProblem::NotFinite {
            text: line.map_or_else(|| format!("{bad:?}"), |line| shorten(line.text)),
        },
    };
    Some((line.map(|line| line.number), problem))
}

/// A line as a message shows it.
fn shorten(line: &[u8]) -> String {
    let line = String::from_utf8_lossy(line);
    let mut shown: String =
        line.chars().take(60).map(|c| if c == '\t' { ' ' } else { c }).collect();
    if shown.len() < line.len() {
        shown.push('…');
    }
    shown
}
