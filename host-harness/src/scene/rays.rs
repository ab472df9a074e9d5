//! Rays and hits in scene units, and their files.
//!
//! A ray file is little-endian f32 `ox oy oz dx dy dz tmin tmax` per ray, 32 bytes; a hit file is
//! little-endian `u32 prim` and f32 `t u v` per ray, 16 bytes. Either may be gzipped. A ray is the
//! half-open interval `tmin < t <= tmax` of `origin + t · direction`; directions need not have unit
//! length.

use std::fs;
use std::io::{self, Read, Write};
use std::path::{Path, PathBuf};

/// A ray in scene units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SceneRay {
    /// Where `t` is zero.
    pub origin: [f32; 3],
    /// How far the ray moves while `t` grows by one; of any length.
    pub direction: [f32; 3],
    /// The exclusive start of the interval; may be negative or infinite.
    pub t_min: f32,
    /// The inclusive end of the interval; may be infinite.
    pub t_max: f32,
}

/// A ray's answer in scene units.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct Hit {
    /// The triangle, from 0 in file order, or [`Hit::NONE`].
    pub prim: u32,
    /// The time of the hit, 0 for a miss.
    pub t: f32,
    /// The weight of the triangle's second vertex, 0 for a miss.
    pub u: f32,
    /// The weight of the triangle's third vertex, 0 for a miss.
    pub v: f32,
}

/// Why a ray or a ray file cannot be used.
#[derive(Debug, thiserror::Error)]
#[non_exhaustive]
pub enum RayFileError {
    /// The file cannot be read or written.
    #[error("{}: cannot {doing} it: {source}; check the path and its permissions", path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// `read`, `unpack` or `write`.
        doing: &'static str,
        /// What the system said.
        source: io::Error,
    },
    /// The file is not a whole number of records.
    #[error(
        "{}: {length} bytes are {whole} {what} of {record} bytes and {remainder} left over; the file \
         is cut off or of another kind", path.display(), whole = length / record
    )]
    Length {
        /// The file.
        path: PathBuf,
        /// `rays` or `hits`.
        what: &'static str,
        /// Bytes of the file, unpacked.
        length: usize,
        /// Bytes of a record.
        record: usize,
        /// Bytes beyond the last whole record.
        remainder: usize,
    },
    /// A ray has a component that is not a number that a ray can have.
    #[error("{}: {source}", path.display())]
    BadRay {
        /// The file.
        path: PathBuf,
        /// The ray and its component.
        source: BadRay,
    },
}

/// A component of a ray that is NaN, or infinite where it must not be.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[error(
    "ray {index}: {component} is {value}; origin and direction must be finite and the interval not \
     NaN, so correct or leave out that ray"
)]
pub struct BadRay {
    /// The ray, from 0.
    pub index: usize,
    /// `ox`, `oy`, `oz`, `dx`, `dy`, `dz`, `tmin` or `tmax`.
    pub component: &'static str,
    /// Its value.
    pub value: f32,
}

impl SceneRay {
    /// Bytes of a ray in a file.
    pub const BYTES: usize = 32;

    /// Checks that origin and direction are finite and the interval is not NaN. `index` is for the
    /// message.
    ///
    /// # Errors
    /// [`BadRay`] names the first component that is not.
    pub fn check(&self, index: usize) -> Result<(), BadRay> {
        const NAMES: [&str; 8] = ["ox", "oy", "oz", "dx", "dy", "dz", "tmin", "tmax"];
        for (i, (component, value)) in NAMES.into_iter().zip(self.components()).enumerate() {
            if value.is_nan() || (i < 6 && value.is_infinite()) {
                return Err(BadRay { index, component, value });
            }
        }
        Ok(())
    }

    /// The point at time `t`.
    pub fn at(&self, t: f32) -> [f32; 3] {
        [0, 1, 2].map(|i| self.origin[i] + t * self.direction[i])
    }

    fn components(&self) -> [f32; 8] {
        let ([ox, oy, oz], [dx, dy, dz]) = (self.origin, self.direction);
        [ox, oy, oz, dx, dy, dz, self.t_min, self.t_max]
    }
}

impl Hit {
    /// The `prim` of a miss.
    pub const NONE: u32 = 0xffff_ffff;

    /// A ray that hits nothing.
    pub const MISS: Self = Self { prim: Self::NONE, t: 0.0, u: 0.0, v: 0.0 };

    /// Bytes of a hit in a file.
    pub const BYTES: usize = 16;

    /// Whether something was hit.
    pub const fn is_hit(&self) -> bool {
        self.prim != Self::NONE
    }
}

/// Reads a ray file, gzipped or not, and checks every ray.
///
/// # Errors
/// [`RayFileError`] when the file cannot be read, has a wrong length or holds a ray that
/// [`SceneRay::check`] refuses.
pub fn read_rays(path: &Path) -> Result<Vec<SceneRay>, RayFileError> {
    let bytes = read_records(path, "rays", SceneRay::BYTES)?;
    let mut rays = Vec::with_capacity(bytes.len() / SceneRay::BYTES);
    for (index, record) in bytes.as_chunks::<{ SceneRay::BYTES }>().0.iter().enumerate() {
        let [ox, oy, oz, dx, dy, dz, t_min, t_max] = floats(record);
        let ray = SceneRay { origin: [ox, oy, oz], direction: [dx, dy, dz], t_min, t_max };
        ray.check(index)
            .map_err(|source| RayFileError::BadRay { path: path.to_owned(), source })?;
        rays.push(ray);
    }
    Ok(rays)
}

/// Writes a ray file, gzipped if its name ends in `.gz`.
///
/// # Errors
/// [`RayFileError::Io`]; no half-written file stays behind.
pub fn write_rays(path: &Path, rays: &[SceneRay]) -> Result<(), RayFileError> {
    let bytes: Vec<u8> =
        rays.iter().flat_map(|ray| ray.components()).flat_map(f32::to_le_bytes).collect();
    write_file(path, &bytes)
}

/// Reads a hit file, gzipped or not.
///
/// # Errors
/// [`RayFileError`] when the file cannot be read or has a wrong length.
pub fn read_hits(path: &Path) -> Result<Vec<Hit>, RayFileError> {
    let bytes = read_records(path, "hits", Hit::BYTES)?;
    let hit = |record: &[u8; Hit::BYTES]| {
        let [prim, t, u, v] = floats(record);
        Hit { prim: prim.to_bits(), t, u, v }
    };
    Ok(bytes.as_chunks().0.iter().map(hit).collect())
}

/// Writes a hit file, gzipped if its name ends in `.gz`.
///
/// # Errors
/// [`RayFileError::Io`]; no half-written file stays behind.
pub fn write_hits(path: &Path, hits: &[Hit]) -> Result<(), RayFileError> {
    let words = hits.iter().flat_map(|h| [h.prim, h.t.to_bits(), h.u.to_bits(), h.v.to_bits()]);
    write_file(path, &words.flat_map(u32::to_le_bytes).collect::<Vec<u8>>())
}

/// The little-endian words of a record, as floats bit by bit.
fn floats<const BYTES: usize, const WORDS: usize>(record: &[u8; BYTES]) -> [f32; WORDS] {
    let mut words = [0.0; WORDS];
    for (word, bytes) in words.iter_mut().zip(record.as_chunks::<4>().0) {
        *word = f32::from_le_bytes(*bytes);
    }
    words
}

fn read_records(path: &Path, what: &'static str, record: usize) -> Result<Vec<u8>, RayFileError> {
    let failed = |doing| move |source| RayFileError::Io { path: path.to_owned(), doing, source };
    let mut bytes = fs::read(path).map_err(failed("read"))?;
    if bytes.starts_with(&[0x1f, 0x8b]) {
        let mut unpacked = Vec::new();
        flate2::read::MultiGzDecoder::new(bytes.as_slice())
            .read_to_end(&mut unpacked)
            .map_err(failed("unpack"))?;
        bytes = unpacked;
    }
    let (length, remainder) = (bytes.len(), bytes.len() % record);
    if remainder != 0 {
        return Err(RayFileError::Length {
            path: path.to_owned(),
            what,
            length,
            record,
            remainder,
        });
    }
    Ok(bytes)
}

fn write_file(path: &Path, bytes: &[u8]) -> Result<(), RayFileError> {
    let failed = |source| RayFileError::Io { path: path.to_owned(), doing: "write", source };
    let packed = path.extension().is_some_and(|e| e == "gz");
    // Written beside the target and renamed, so that a reader never sees half a file.
    let mut partial = path.as_os_str().to_owned();
    partial.push(".partial");
    let partial = PathBuf::from(partial);
    let write = || -> io::Result<()> {
        if packed {
            let file = fs::File::create(&partial)?;
            let mut encoder = flate2::write::GzEncoder::new(file, flate2::Compression::default());
            encoder.write_all(bytes)?;
            encoder.finish()?;
        } else {
            fs::write(&partial, bytes)?;
        }
        fs::rename(&partial, path)
    };
    write().map_err(|source| {
        // It may not exist; the write's own error is the one to report.
        let _ = fs::remove_file(&partial);
        failed(source)
    })
}
