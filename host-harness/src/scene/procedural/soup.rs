//! Vertices and triangles on their way to a mesh, and the shapes that several scenes are made of.

use std::collections::HashMap;
use std::fmt::Write as _;

use super::super::error::SceneError;
use super::super::mesh::{LoadOptions, Mesh};
use super::super::vec3::{Vec3, along, narrow, normalize};

/// Indexed triangles in scene units.
#[derive(Clone, PartialEq, Debug, Default)]
pub struct Soup {
    /// The vertices.
    pub positions: Vec<[f32; 3]>,
    /// The corners of each triangle, from 0.
    pub indices: Vec<[u32; 3]>,
}

impl Soup {
    /// The mesh of these triangles on a grid.
    ///
    /// # Errors
    /// As [`Mesh::new`].
    pub fn into_mesh(self, name: &str, options: &LoadOptions) -> Result<Mesh, SceneError> {
        Mesh::new(name, self.positions, self.indices, options)
    }

    /// The text of an OBJ file. Reading it back gives the same bits.
    pub fn to_obj(&self, comment: &str) -> String {
        let mut text = String::with_capacity(32 * (self.positions.len() + self.indices.len()));
        let _ = writeln!(text, "# {comment}");
        // Writing to a string cannot fail. `{:?}` is the shortest decimal that reads back as the same
        // float, with an exponent where that is shorter.
        for [x, y, z] in &self.positions {
            let _ = writeln!(text, "v {x:?} {y:?} {z:?}");
        }
        for corners in &self.indices {
            let [a, b, c] = corners.map(|index| u64::from(index) + 1);
            let _ = writeln!(text, "f {a} {b} {c}");
        }
        text
    }

    /// Adds a vertex and returns its index.
    pub(super) fn vertex(&mut self, at: Vec3) -> u32 {
        self.positions.push(narrow(at));
        self.positions.len() as u32 - 1
    }

    /// Adds a quadrilateral as two triangles that share the diagonal from `a` to `c`.
    pub(super) fn quad(&mut self, [a, b, c, d]: [u32; 4]) {
        self.indices.extend([[a, b, c], [a, c, d]]);
    }

    /// Adds a sheet of `cells` × `cells` quadrilaterals whose vertex at `(u, v)`, both from 0 to 1,
    /// is `point(u, v)`. The ends are exactly 0 and 1.
    pub(super) fn sheet(&mut self, cells: u32, point: impl Fn(f64, f64) -> Vec3) {
        let first = self.positions.len() as u32;
        let at = |i: u32| f64::from(i) / f64::from(cells);
        for j in 0..=cells {
            for i in 0..=cells {
                self.vertex(point(at(i), at(j)));
            }
        }
        let row = cells + 1;
        for j in 0..cells {
            for i in 0..cells {
                let corner = first + j * row + i;
                self.quad([corner, corner + 1, corner + row + 1, corner + row]);
            }
        }
    }

    /// Adds the parallelogram at `corner` with sides `a` and `b` as a sheet.
    pub(super) fn parallelogram(&mut self, cells: u32, corner: Vec3, a: Vec3, b: Vec3) {
        self.sheet(cells, |u, v| along(along(corner, u, a), v, b));
    }

    /// Adds a sphere.
    pub(super) fn sphere(&mut self, unit: &UnitSphere, centre: Vec3, radius: f64) {
        let first = self.positions.len() as u32;
        for &direction in &unit.directions {
            self.vertex(along(centre, radius, direction));
        }
        self.indices.extend(unit.triangles.iter().map(|corners| corners.map(|c| first + c)));
    }
}

/// A sphere of radius 1: an icosahedron whose triangles are quartered, 20 · 4^level triangles.
#[derive(Clone, PartialEq, Debug)]
pub(super) struct UnitSphere {
    directions: Vec<Vec3>,
    triangles: Vec<[u32; 3]>,
}

impl UnitSphere {
    /// The sphere of a level.
    pub(super) fn new(level: u32) -> Self {
        let golden = (1.0 + 5f64.sqrt()) / 2.0;
        let mut directions = Vec::new();
        for (a, b) in [(1.0, golden), (-1.0, golden), (1.0, -golden), (-1.0, -golden)] {
            directions.extend([[0.0, a, b], [a, b, 0.0], [b, 0.0, a]].map(normalize));
        }
        let triangles = faces_of_icosahedron(&directions);
        let mut sphere = Self { directions, triangles };
        for _ in 0..level {
            sphere.quarter();
        }
        sphere
    }

    fn quarter(&mut self) {
        let mut middles = HashMap::new();
        let coarse = std::mem::take(&mut self.triangles);
        for [a, b, c] in coarse {
            let mut middle = |i: u32, j: u32| {
                *middles.entry((i.min(j), i.max(j))).or_insert_with(|| {
                    let sum = along(self.directions[i as usize], 1.0, self.directions[j as usize]);
                    self.directions.push(normalize(sum));
                    self.directions.len() as u32 - 1
                })
            };
            let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
            self.triangles.extend([[a, ab, ca], [ab, b, bc], [ca, bc, c], [ab, bc, ca]]);
        }
    }
}

/// The twenty triples of neighbouring corners, wound outwards.
fn faces_of_icosahedron(corners: &[Vec3]) -> Vec<[u32; 3]> {
    use super::super::vec3::{cross, dot, sub};
    let near = |i: usize, j: usize| dot(corners[i], corners[j]) > 0.4;
    let mut faces = Vec::with_capacity(20);
    for i in 0..12 {
        for j in i + 1..12 {
            for k in j + 1..12 {
                if near(i, j) && near(j, k) && near(k, i) {
                    let (ij, ik) = (sub(corners[j], corners[i]), sub(corners[k], corners[i]));
                    let outwards = dot(cross(ij, ik), corners[i]) > 0.0;
                    let (j, k) = if outwards { (j, k) } else { (k, j) };
                    faces.push([i as u32, j as u32, k as u32]);
                }
            }
        }
    }
    faces
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn spheres_are_closed_and_round() {
        for level in 0..3 {
            let sphere = UnitSphere::new(level);
            let faces = 20 * 4usize.pow(level);
            assert_eq!(sphere.triangles.len(), faces);
            assert_eq!(sphere.directions.len(), faces / 2 + 2, "Euler's formula");
        }
    }

    #[test]
    fn sheets_meet_their_corners_exactly() {
        let mut soup = Soup::default();
        soup.parallelogram(3, [0.1, 0.2, 0.3], [1.0, 0.0, 0.0], [0.0, 0.0, 2.0]);
        assert_eq!(soup.indices.len(), 18);
        assert_eq!(soup.positions[0], [0.1, 0.2, 0.3]);
        assert_eq!(soup.positions[15], [1.1, 0.2, 2.3]);
        assert!(soup.positions.iter().all(|p| p[1] == 0.2));
    }
}
