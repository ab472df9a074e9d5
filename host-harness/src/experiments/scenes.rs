//! The models that the papers measured with, by the names that the papers give them.

use serde::{Serialize, Serializer};

/// A model of the papers.
#[derive(Debug, PartialEq, Eq)]
pub struct PaperScene {
    /// The papers' name.
    pub name: &'static str,
    /// The mesh of that model, as [`scene::load`](crate::scene::load) takes it; none where no public
    /// package is known to have it.
    pub mesh: Option<&'static str>,
    /// How many triangles the papers give it.
    pub triangles: Option<PaperTriangles>,
}

/// A count of triangles as the papers print it.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct PaperTriangles {
    /// The number.
    pub count: u32,
    /// Whether it is rounded to thousands.
    pub rounded: bool,
}

impl Serialize for PaperTriangles {
    fn serialize<S: Serializer>(&self, serializer: S) -> Result<S::Ok, S::Error> {
        serializer.serialize_u32(self.count)
    }
}

const fn exactly(count: u32) -> Option<PaperTriangles> {
    Some(PaperTriangles { count, rounded: false })
}

const fn thousands(thousands: u32) -> Option<PaperTriangles> {
    Some(PaperTriangles { count: 1000 * thousands, rounded: true })
}

const fn scene(
    name: &'static str,
    mesh: Option<&'static str>,
    triangles: Option<PaperTriangles>,
) -> PaperScene {
    PaperScene { name, mesh, triangles }
}

/// The Sibenik cathedral (P1; P2 Fig. 6).
pub static SIBENIK: PaperScene = scene("Sibenik", Some("sibenik"), thousands(75));
/// The Stanford bunny.
pub static BUNNY: PaperScene = scene("Bunny", Some("bunny"), exactly(69_451));
/// A cloth falling on a ball, UNC Dynamic Scene Benchmarks.
pub static CLOTH: PaperScene = scene("Cloth", Some("anim_cloth_ball_f0"), thousands(92));
/// The Sponza palace of Crytek.
pub static CRYTEK: PaperScene = scene("Crytek", Some("sponza_crytek"), exactly(262_267));
/// The Stanford dragon.
pub static DRAGON: PaperScene = scene("Dragon", Some("dragon"), exactly(871_414));
/// The toy robots of the Utah 3D Animation Repository.
pub static TOASTERS: PaperScene = scene("Toasters", None, None);
/// The fairy forest of the Utah 3D Animation Repository.
pub static FAIRY: PaperScene = scene("Fairy", None, thousands(174));
/// A conference room.
pub static CONFERENCE: PaperScene = scene("Conference", None, thousands(331));
/// A sports car.
pub static SPORTSCAR: PaperScene = scene("Sportscar", None, None);
/// An Italian city.
pub static ITALIAN: PaperScene = scene("Italian", None, None);
/// A Babylonian city.
pub static BABYLONIAN: PaperScene = scene("Babylonian", None, None);
/// A kitchen; not the one of other packages.
pub static KITCHEN: PaperScene = scene("Kitchen", None, None);
/// The Happy Buddha in full; packages have decimated ones.
pub static BUDDHA: PaperScene = scene("Buddha", None, None);
/// A living room.
pub static LIVINGROOM: PaperScene = scene("Livingroom", None, None);
/// A lion.
pub static LION: PaperScene = scene("Lion", None, None);

/// An elephant of the Dynamic Scene Benchmarks, which frame is not said.
pub static ELEPHANT: PaperScene = scene("Elephant", None, thousands(85));
/// The Stanford armadillo in full; packages have decimated ones.
pub static ARMADILLO: PaperScene = scene("Armadillo", None, thousands(213));
/// A scanned hand.
pub static HAND: PaperScene = scene("Hand", None, thousands(655));
/// A ball of hair.
pub static HAIRBALL: PaperScene = scene("Hairball", None, None);

impl PaperScene {
    /// Whether a mesh of so many triangles can be this model: versions differ by some per cent.
    pub fn can_have(&self, triangles: usize) -> bool {
        self.triangles.is_none_or(|paper| {
            let paper = f64::from(paper.count);
            (triangles as f64 - paper).abs() <= 0.1 * paper
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn another_version_is_the_model_and_a_decimated_one_is_not() {
        assert!(SIBENIK.can_have(80_479));
        assert!(!DRAGON.can_have(202_520));
        assert!(LION.can_have(1));
    }
}
