//! What can be wrong with a scene or a ray file. Every message says what, where and what to do.

use std::io;
use std::path::PathBuf;

use super::frame::FrameError;
use super::procedural::ParameterError;

/// Why a scene cannot be loaded.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum SceneError {
    /// Neither a file nor a procedural scene has that name.
    #[error("no scene '{name}'; looked for {}{}", list(looked), did_you_mean(near))]
    NotFound {
        /// The name as given.
        name: String,
        /// Every file that was tried, in order.
        looked: Vec<PathBuf>,
        /// Names close to it that do exist, best first.
        near: Vec<String>,
    },
    /// A procedural scene cannot be had with those parameters.
    #[error("{name}: {source}")]
    Parameter {
        /// The name as given.
        name: String,
        /// What is wrong with it.
        source: ParameterError,
    },
    /// A file cannot be read.
    #[error("{}: cannot read it: {source}; check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// What the system said.
        source: io::Error,
    },
    /// A gzip file cannot be unpacked.
    #[error("{}: damaged gzip data: {source}; fetch or pack the file again", path.display())]
    Gzip {
        /// The file.
        path: PathBuf,
        /// What the decoder said.
        source: io::Error,
    },
    /// The OBJ text of a file is wrong.
    #[error("{}{}: {problem}", path.display(), line.map_or(String::new(), |l| format!(":{l}")))]
    Obj {
        /// The file.
        path: PathBuf,
        /// The line, from 1, where the problem has one.
        line: Option<usize>,
        /// What is wrong with it.
        problem: ObjProblem,
    },
    /// A vertex does not fit the frame.
    #[error("{scene}: vertex {vertex}: {source}")]
    Vertex {
        /// The scene.
        scene: String,
        /// The vertex, from 0 in the order of [`super::Mesh::positions`].
        vertex: usize,
        /// What is wrong with it.
        source: FrameError,
    },
    /// A triangle refers to a vertex that does not exist.
    #[error(
        "{scene}: triangle {triangle} refers to vertex {index} but there are {vertices} (counted \
         from 0); correct the index"
    )]
    NoSuchVertex {
        /// The scene.
        scene: String,
        /// The triangle, from 0.
        triangle: usize,
        /// The index, from 0.
        index: u32,
        /// How many vertices there are.
        vertices: usize,
    },
    /// A key frame is not the same mesh in another place.
    #[error(
        "{key}: it has other triangles than {scene}; an animation moves the vertices of one mesh"
    )]
    Topology {
        /// The scene.
        scene: String,
        /// The key frame.
        key: String,
    },
    /// There are more triangles than identifiers.
    #[error("{scene}: {triangles} triangles are more than 2^32 - 1; split the scene")]
    TooLarge {
        /// The scene.
        scene: String,
        /// How many triangles there are.
        triangles: usize,
    },
}

/// What is wrong with an OBJ file.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ObjProblem {
    /// The file has no bytes.
    #[error("the file is empty; give a Wavefront OBJ with 'v' and 'f' lines")]
    Empty,
    /// No face has three vertices or more.
    #[error(
        "no faces with three or more vertices ({vertices} vertices, {skipped} points and lines); \
         export the mesh with its faces"
    )]
    NoFaces {
        /// How many `v` lines there are.
        vertices: usize,
        /// How many faces have fewer than three vertices.
        skipped: usize,
    },
    /// A `v` line is not three numbers.
    #[error("'{text}' is not a vertex; write 'v X Y Z' with three decimal numbers")]
    BadVertex {
        /// The line, shortened.
        text: String,
    },
    /// A `v` line holds NaN, infinity or a number beyond f32.
    #[error("'{text}' has a coordinate that is not a finite 32-bit float; repair the mesh")]
    NotFinite {
        /// The line, shortened.
        text: String,
    },
    /// A vertex is outside the frame that the caller gave.
    #[error("vertex {source}")]
    OutsideFrame {
        /// Where it is and where the frame is.
        source: FrameError,
    },
    /// An `f` line does not hold vertex indices.
    #[error("'{text}' is not a face; write 'f A B C' with integers, or A/T/N groups")]
    BadFace {
        /// The line, shortened.
        text: String,
    },
    /// A face refers to a vertex that the file does not have.
    #[error(
        "face refers to vertex {index}, but the file has {vertices} vertices (indices run from 1, \
         or from -1 backwards); correct the index or restore the missing 'v' lines"
    )]
    IndexOutOfRange {
        /// The index as written.
        index: i64,
        /// How many `v` lines the file has; for a negative index, how many precede the face.
        vertices: usize,
    },
    /// Anything else the parser refused.
    #[error("the OBJ parser refused it: {reason}")]
    Other {
        /// The parser's own words.
        reason: String,
    },
}

fn list(paths: &[PathBuf]) -> String {
    paths.iter().map(|p| p.display().to_string()).collect::<Vec<_>>().join(", ")
}

fn did_you_mean(near: &[String]) -> String {
    match near {
        [] => "; give a path to an OBJ file, or run `xylem scene list`".into(),
        near => format!("; did you mean {}?", near.join(" or ")),
    }
}
