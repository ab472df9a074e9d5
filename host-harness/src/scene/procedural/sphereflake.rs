//! A sphereflake (after Haines' Standard Procedural Databases, 1987): on each sphere sit nine of a
//! third of its size, six around it and three above.

use super::super::vec3::{Vec3, along, tangents};
use super::soup::{Soup, UnitSphere};

/// The sphereflake with `depth` levels of smaller spheres, on a floor of 512 triangles.
///
/// A sphere is the finer the larger it is: level `l` of `depth` has 20 · 4^(depth + 1 − l) triangles.
pub(super) fn build(depth: u32) -> Soup {
    let spheres: Vec<UnitSphere> = (1..=depth + 1).map(UnitSphere::new).collect();
    let mut soup = Soup::default();
    flake(&mut soup, &spheres, [0.0; 3], 1.0, [0.0, 1.0, 0.0]);
    // The floor touches the large sphere from below.
    soup.parallelogram(16, [-2.0, -1.0, -2.0], [0.0, 0.0, 4.0], [4.0, 0.0, 0.0]);
    soup
}

/// Adds a sphere and what sits on it; `spheres` is the finest last.
fn flake(soup: &mut Soup, spheres: &[UnitSphere], centre: Vec3, radius: f64, up: Vec3) {
    let Some((unit, finer)) = spheres.split_last() else { return };
    soup.sphere(unit, centre, radius);
    let [side, front] = tangents(up);
    // Six at the equator, sixty degrees apart; three above, a rotation of thirty degrees between.
    let (half, tall) = (0.5, 3f64.sqrt() / 2.0);
    let ring =
        [(1.0, 0.0), (half, tall), (-half, tall), (-1.0, 0.0), (-half, -tall), (half, -tall)];
    let above = [(tall, half), (-tall, half), (0.0, -1.0)];
    let equator = ring.map(|(x, y)| [x, y, 0.0]);
    let upper = above.map(|(x, y)| [0.6 * x, 0.6 * y, 0.8]);
    for [x, y, z] in equator.into_iter().chain(upper) {
        let outwards = along(along(side.map(|c| x * c), y, front), z, up);
        flake(soup, finer, along(centre, radius * 4.0 / 3.0, outwards), radius / 3.0, outwards);
    }
}
