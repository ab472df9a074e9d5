//! A mesh as the rest of the harness sees it.

use xylem_core::geom::Triangle;
use xylem_core::num::Grid;

use super::error::SceneError;
use super::frame::{self, SceneFrame};

/// A triangle mesh, snapped to a grid.
///
/// Triangle `i` of the input (in file order, polygons fanned) is `triangles[i]`, has `id` `i` and its
/// corners in scene units are `positions[indices[i][0..3]]`.
#[derive(Clone, PartialEq, Debug)]
pub struct Mesh {
    /// What the scene is called in reports.
    pub name: String,
    /// The grid over the scene.
    pub frame: SceneFrame,
    /// The triangles in grid units.
    pub triangles: Vec<Triangle>,
    /// The vertices in scene units, as they were before snapping.
    pub positions: Vec<[f32; 3]>,
    /// The vertices of each triangle.
    pub indices: Vec<[u32; 3]>,
    /// Faces with more than three vertices that were fanned from their first vertex.
    pub fanned: usize,
    /// Faces with fewer than three vertices, left out.
    pub skipped: usize,
}

/// How a scene is put on a grid.
#[derive(Clone, Copy, PartialEq, Debug, Default)]
pub struct LoadOptions {
    /// The grid that is fitted to the scene box, unless a frame is given.
    pub grid: Grid,
    /// The frame to use instead of fitting one, for example one that holds a whole animation.
    pub frame: Option<SceneFrame>,
}

impl Mesh {
    /// A mesh from its vertices and the corners of its triangles. Without triangles it is empty,
    /// which is not an error here.
    ///
    /// # Errors
    /// [`SceneError::Vertex`] when a vertex is not finite or outside the frame of `options`,
    /// [`SceneError::NoSuchVertex`] when an index has no vertex and [`SceneError::TooLarge`] when
    /// there are more triangles than a `u32` counts.
    pub fn new(
        name: impl Into<String>,
        positions: Vec<[f32; 3]>,
        indices: Vec<[u32; 3]>,
        options: &LoadOptions,
    ) -> Result<Self, SceneError> {
        let name = name.into();
        let at_vertex = |vertex| {
            let scene = name.clone();
            move |source| SceneError::Vertex { scene, vertex, source }
        };
        if u32::try_from(indices.len()).is_err() {
            return Err(SceneError::TooLarge { scene: name, triangles: indices.len() });
        }
        let frame = match options.frame {
            Some(frame) => frame,
            None => {
                // An infinite corner would make a bad frame; say which vertex is to blame.
                if let Some(bad) = positions.iter().position(|p| !p.iter().all(|c| c.is_finite())) {
                    let unit = SceneFrame::fit_points(&[], options.grid).map_err(at_vertex(bad))?;
                    unit.snap(positions[bad]).map_err(at_vertex(bad))?;
                }
                SceneFrame::fit_points(&positions, options.grid).map_err(at_vertex(0))?
            }
        };
        let mut snapped = Vec::with_capacity(positions.len());
        for (vertex, &position) in positions.iter().enumerate() {
            snapped.push(frame.snap(position).map_err(at_vertex(vertex))?);
        }
        let mut triangles = Vec::with_capacity(indices.len());
        for (id, corners) in indices.iter().enumerate() {
            let mut vertices = [glam::IVec3::ZERO; 3];
            for (corner, &index) in vertices.iter_mut().zip(corners) {
                *corner = *snapped.get(index as usize).ok_or_else(|| SceneError::NoSuchVertex {
                    scene: name.clone(),
                    triangle: id,
                    index,
                    vertices: snapped.len(),
                })?;
            }
            triangles.push(Triangle { vertices, id: id as u32 });
        }
        Ok(Self { name, frame, triangles, positions, indices, fanned: 0, skipped: 0 })
    }

    /// The corners of triangle `i` in scene units, or `None` beyond the last.
    pub fn corners(&self, i: usize) -> Option<[[f32; 3]; 3]> {
        Some(self.indices.get(i)?.map(|index| self.positions[index as usize]))
    }

    /// The lowest and highest corner of the scene box in scene units; `None` without vertices.
    pub fn bounds(&self) -> Option<[[f32; 3]; 2]> {
        frame::bounds(self.positions.iter().copied())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn triangles_keep_their_order_and_number() {
        let positions = vec![[0.0; 3], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
        let indices = vec![[0, 1, 2], [3, 1, 0]];
        let mesh = Mesh::new("two", positions, indices, &LoadOptions::default()).unwrap();
        let (low, high) = (Grid::DEFAULT.min(), Grid::DEFAULT.max());
        assert_eq!(mesh.triangles.iter().map(|t| t.id).collect::<Vec<_>>(), [0, 1]);
        assert_eq!(mesh.triangles[0].vertices[1].to_array(), [high, low, low]);
        assert_eq!(mesh.triangles[1].vertices[0].to_array(), [low, low, 0]);
        assert_eq!(mesh.corners(1).unwrap()[0], [0.0, 0.0, 0.5]);
        assert_eq!(mesh.corners(2), None);
        assert_eq!(mesh.bounds(), Some([[0.0; 3], [1.0, 1.0, 0.5]]));
    }

    #[test]
    fn errors_name_the_vertex() {
        let frame = SceneFrame::fit([0.0; 3], [1.0; 3], Grid::DEFAULT).unwrap();
        let given = LoadOptions { frame: Some(frame), ..LoadOptions::default() };
        let build = |p: [f32; 3], options: &LoadOptions| {
            Mesh::new("m", vec![[0.0; 3], [1.0; 3], p], vec![[0, 1, 2]], options)
                .map(|_| ())
                .unwrap_err()
                .to_string()
        };
        let outside = build([0.0, 0.0, -0.5], &given);
        assert!(outside.starts_with("m: vertex 2: z = -5e-1 is 5e-1 outside"), "{outside}");
        let infinite = build([0.0, f32::INFINITY, 0.0], &LoadOptions::default());
        assert!(infinite.starts_with("m: vertex 2: coordinate y is inf"), "{infinite}");
    }

    #[test]
    fn an_empty_mesh_has_a_frame_and_no_box() {
        let mesh = Mesh::new("none", vec![], vec![], &LoadOptions::default()).unwrap();
        assert!(mesh.triangles.is_empty());
        assert_eq!(mesh.bounds(), None);
    }

    #[test]
    fn an_index_without_a_vertex_is_an_error() {
        let error = Mesh::new("m", vec![[0.0; 3]], vec![[0, 0, 1]], &LoadOptions::default());
        assert!(matches!(error, Err(SceneError::NoSuchVertex { triangle: 0, index: 1, .. })));
    }
}
