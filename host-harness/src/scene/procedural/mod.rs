//! Scenes that are computed: no download, no licence, the same bits everywhere.
//!
//! A scene is named `generator`, `generator:value` (its first parameter) or
//! `generator:key=value,key=value`: `sphereflake`, `terrain:7`, `flag:frame=3,cells=64`. All parameters
//! are integers with a default and a range; [`GENERATORS`] lists them. Only additions,
//! multiplications, divisions and square roots in f64 go into a vertex, so that the platform's
//! mathematical library cannot change it.

mod cloth;
mod cornell;
pub mod degenerate;
mod hair;
mod soup;
mod sphereflake;
mod terrain;

pub use cloth::FLAG_BOX;
pub use soup::Soup;

/// The scene of the bare `xylem` command: about 100,000 triangles.
pub const DEFAULT_SCENE: &str = "sphereflake";

/// A scene that is computed.
#[derive(Clone, Copy, Debug)]
pub struct Generator {
    /// Its name.
    pub name: &'static str,
    /// What it shows and what it is good for.
    pub about: &'static str,
    /// Its parameters; the first may be given without its key.
    pub parameters: &'static [Parameter],
    build: fn(&[u32]) -> Soup,
}

/// A parameter of a generator.
#[derive(Clone, Copy, PartialEq, Eq, Debug)]
pub struct Parameter {
    /// Its key.
    pub name: &'static str,
    /// Its value if it is not given.
    pub default: u32,
    /// The lowest value.
    pub min: u32,
    /// The highest value.
    pub max: u32,
    /// What it does, and what it does to the number of triangles.
    pub about: &'static str,
}

/// Why a name that starts like a procedural scene is not one.
#[derive(Clone, PartialEq, Eq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ParameterError {
    /// The value is not an integer.
    #[error("'{given}' is not a whole number; write {}", usage(generator))]
    NotANumber {
        /// The generator.
        generator: &'static str,
        /// What was given.
        given: String,
    },
    /// There is no such parameter.
    #[error("there is no parameter '{given}'; write {}", usage(generator))]
    Unknown {
        /// The generator.
        generator: &'static str,
        /// What was given.
        given: String,
    },
    /// The value is out of range.
    #[error("{name} = {given} is not in {min} to {max}; write {}", usage(generator))]
    OutOfRange {
        /// The generator.
        generator: &'static str,
        /// The parameter.
        name: &'static str,
        /// What was given.
        given: u64,
        /// The lowest value.
        min: u32,
        /// The highest value.
        max: u32,
    },
}

const SEED: Parameter =
    Parameter { name: "seed", default: 1, min: 0, max: u32::MAX, about: "of the random numbers" };

/// Every generator, the default scene first.
pub const GENERATORS: &[Generator] = &[
    Generator {
        name: DEFAULT_SCENE,
        about: "spheres on spheres on a floor: detail at every scale",
        parameters: &[Parameter {
            name: "depth",
            default: 3,
            min: 0,
            max: 5,
            about: "levels of smaller spheres; 101,392 triangles at 3, about 9 times that a level",
        }],
        build: |p| sphereflake::build(p[0]),
    },
    Generator {
        name: "cornell",
        about: "the Cornell box: 32 large triangles, most of them axis-aligned",
        parameters: &[Parameter {
            name: "cells",
            default: 1,
            min: 1,
            max: 512,
            about: "cells along each side of a wall; its square multiplies the triangles",
        }],
        build: |p| cornell::build(p[0]),
    },
    Generator {
        name: "terrain",
        about: "a fractal height field by midpoint displacement: even density, flat boxes",
        parameters: &[
            Parameter {
                name: "levels",
                default: 8,
                min: 1,
                max: 11,
                about: "halvings of a side; 2 · 4^levels triangles",
            },
            SEED,
        ],
        build: |p| terrain::build(p[0], p[1]),
    },
    Generator {
        name: "cloth",
        about: "a finely woven tablecloth: exactly axis-aligned sheets and a rippled one",
        parameters: &[Parameter {
            name: "cells",
            default: 96,
            min: 1,
            max: 1024,
            about: "cells along a side of each of the four sheets; 8 · cells² triangles",
        }],
        build: |p| cloth::tablecloth(p[0]),
    },
    Generator {
        name: "flag",
        about: "a waving cloth, one frame of an animation with fixed topology",
        parameters: &[
            Parameter {
                name: "frame",
                default: 0,
                min: 0,
                max: 1_000_000,
                about: "frame number; the motion repeats after 64",
            },
            Parameter {
                name: "cells",
                default: 128,
                min: 1,
                max: 1024,
                about: "cells along a side; 2 · cells² triangles",
            },
        ],
        build: |p| cloth::flag(p[0], p[1]),
    },
    Generator {
        name: "hair",
        about: "a ball with curved hairs of thin triangles: long, slanted, overlapping boxes",
        parameters: &[
            Parameter {
                name: "hairs",
                default: 2000,
                min: 0,
                max: 200_000,
                about: "number of hairs; 2 · segments triangles each, and 1,280 of the ball",
            },
            Parameter {
                name: "segments",
                default: 16,
                min: 1,
                max: 256,
                about: "straight pieces of a hair",
            },
            SEED,
        ],
        build: |p| hair::build(p[0], p[1], p[2]),
    },
];

/// Computes the scene that `name` stands for: a generator with parameters or one of
/// [`degenerate::CASES`]. `None` if it names neither.
pub fn soup(name: &str) -> Option<Result<Soup, ParameterError>> {
    if let Some(case) = name.strip_prefix("degenerate/") {
        return degenerate::CASES.iter().find(|c| c.name == case).map(|c| Ok(c.build()));
    }
    let (word, arguments) = name.split_once(':').map_or((name, None), |(w, a)| (w, Some(a)));
    let generator = GENERATORS.iter().find(|g| g.name == word)?;
    Some(generator.values(arguments).map(|values| (generator.build)(&values)))
}

/// The text of the OBJ file of a procedural scene; `None` if `name` is none.
pub fn obj_text(name: &str) -> Option<Result<String, ParameterError>> {
    Some(soup(name)?.map(|soup| soup.to_obj(&format!("xylem procedural scene {name}"))))
}

/// The names of all procedural scenes, without parameters.
pub fn names() -> impl Iterator<Item = String> {
    let degenerate = degenerate::CASES.iter().map(|c| format!("degenerate/{}", c.name));
    GENERATORS.iter().map(|g| g.name.to_owned()).chain(degenerate)
}

impl Generator {
    /// The parameters' values, defaults where `arguments` does not give one.
    fn values(&self, arguments: Option<&str>) -> Result<Vec<u32>, ParameterError> {
        let generator = self.name;
        let mut values: Vec<u32> = self.parameters.iter().map(|p| p.default).collect();
        for argument in arguments.into_iter().flat_map(|a| a.split(',')) {
            let (at, text) = match argument.split_once('=') {
                None => (0, argument),
                Some((key, text)) => {
                    let unknown = || ParameterError::Unknown { generator, given: key.into() };
                    let at = self.parameters.iter().position(|p| p.name == key);
                    (at.ok_or_else(unknown)?, text)
                }
            };
            let not_a_number = |_| ParameterError::NotANumber { generator, given: text.into() };
            let given: u64 = text.parse().map_err(not_a_number)?;
            let Parameter { name, min, max, .. } = self.parameters[at];
            values[at] = u32::try_from(given)
                .ok()
                .filter(|value| (min..=max).contains(value))
                .ok_or(ParameterError::OutOfRange { generator, name, given, min, max })?;
        }
        Ok(values)
    }
}

/// How a generator is called, with defaults and ranges.
fn usage(generator: &str) -> String {
    let parameters =
        GENERATORS.iter().find(|g| g.name == generator).map_or(&[][..], |g| g.parameters);
    let each = parameters.iter().map(|p| format!("{}={}", p.name, p.default));
    let ranges = parameters.iter().map(|p| format!("{} from {} to {}", p.name, p.min, p.max));
    format!(
        "{generator}:{} ({})",
        each.collect::<Vec<_>>().join(","),
        ranges.collect::<Vec<_>>().join(", ")
    )
}

#[cfg(test)]
mod tests {
    use super::super::mesh::LoadOptions;
    use super::*;

    fn count(name: &str) -> usize {
        soup(name).unwrap().unwrap().indices.len()
    }

    #[test]
    fn triangle_counts_are_the_documented_ones() {
        assert_eq!(count("sphereflake"), 101_392);
        assert_eq!(count("cornell"), 32);
        assert_eq!(count("cornell:3"), 32 * 9);
        assert_eq!(count("terrain:7"), 2 << 14);
        assert_eq!(count("cloth:10"), 800);
        assert_eq!(count("flag:frame=3,cells=5"), 50);
        assert_eq!(count("hair:hairs=3,segments=4"), 24 + 1280);
        assert_eq!(count("degenerate/empty"), 0);
    }

    #[test]
    fn every_generator_gives_finite_vertices_and_valid_indices_on_the_grid() {
        for name in names() {
            let soup = soup(&name).unwrap().unwrap();
            let mesh = soup.into_mesh(&name, &LoadOptions::default()).unwrap();
            assert_eq!(mesh.name, name);
            assert!(mesh.positions.iter().flatten().all(|c| c.is_finite()), "{name}");
        }
    }

    #[test]
    fn wrong_parameters_say_what_is_right() {
        let error = |name: &str| soup(name).unwrap().unwrap_err().to_string();
        assert_eq!(
            error("terrain:99"),
            "levels = 99 is not in 1 to 11; write terrain:levels=8,seed=1 (levels from 1 to 11, seed \
             from 0 to 4294967295)"
        );
        assert!(error("terrain:x").starts_with("'x' is not a whole number"));
        assert!(error("terrain:size=3").starts_with("there is no parameter 'size'"));
        assert!(soup("terrains").is_none() && soup("degenerate/none").is_none());
    }

    #[test]
    fn seeds_change_the_scene_and_nothing_else_does() {
        let scene = |name: &str| soup(name).unwrap().unwrap();
        assert_eq!(scene("terrain:4"), scene("terrain:levels=4,seed=1"));
        assert_ne!(scene("terrain:4"), scene("terrain:levels=4,seed=2"));
        assert_ne!(scene("hair:9"), scene("hair:hairs=9,seed=2"));
    }
}
