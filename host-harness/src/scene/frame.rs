//! The grid frame: how scene coordinates become grid coordinates and back.

use glam::IVec3;
use xylem_core::num::Grid;

/// A cubic grid laid over a scene: a grid, the scene point of its lowest corner and the size of a
/// cell.
///
/// Scene coordinate `p` on an axis is grid coordinate `grid.min() + (p - origin) / cell`. The
/// arithmetic is f64, so that every f32 scene fits, however large, small or far from the origin: the
/// result is within 2⁻²⁷ grid units of the exact one before it is rounded.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct SceneFrame {
    origin: [f64; 3],
    cell: f64,
    grid: Grid,
}

/// Why a frame or a point in it is refused.
#[derive(Clone, Copy, PartialEq, Debug, thiserror::Error)]
#[non_exhaustive]
pub enum FrameError {
    /// The origin is not finite or the cell is not a positive finite number.
    #[error(
        "a grid frame needs a finite origin and a positive cell, but got origin {origin:?} and cell \
         {cell:e}; give the scene's lowest corner and its longest side over 2^bits - 1"
    )]
    BadFrame {
        /// The origin as given.
        origin: [f64; 3],
        /// The cell as given.
        cell: f64,
    },
    /// A coordinate is NaN or infinite.
    #[error("coordinate {axis} is {value}; repair the mesh")]
    NotFinite {
        /// `x`, `y` or `z`.
        axis: char,
        /// The coordinate.
        value: f64,
    },
    /// A coordinate snaps to no point of the grid.
    #[error(
        "{axis} = {value:e} is {excess:e} outside the grid frame, which runs from {low:e} to \
         {high:e}; give a frame that holds the whole scene (for an animation, every frame of it)"
    )]
    Outside {
        /// `x`, `y` or `z`.
        axis: char,
        /// The coordinate, in scene units.
        value: f64,
        /// How far it is beyond the nearer end of the frame, in scene units.
        excess: f64,
        /// The frame's lowest coordinate on that axis.
        low: f64,
        /// The frame's highest coordinate on that axis.
        high: f64,
    },
}

impl SceneFrame {
    /// A frame whose lowest grid corner is at `origin` and whose cells are `cell` scene units wide.
    ///
    /// # Errors
    /// [`FrameError::BadFrame`] unless `origin` is finite and `cell` is finite and positive.
    pub fn new(origin: [f64; 3], cell: f64, grid: Grid) -> Result<Self, FrameError> {
        let good = origin.iter().all(|c| c.is_finite()) && cell.is_finite() && cell > 0.0;
        if good {
            Ok(Self { origin, cell, grid })
        } else {
            Err(FrameError::BadFrame { origin, cell })
        }
    }

    /// The frame that fits `grid` to the box from `low` to `high`: `low` becomes the grid's lowest
    /// corner and the longest side spans the grid exactly.
    ///
    /// A box without extent (a point) gets a cell that a box as large as its farthest coordinate
    /// would get, or 1 / (2^bits − 1) at the origin; it lies on the grid's lowest corner.
    ///
    /// # Errors
    /// [`FrameError::BadFrame`] when a corner is not finite.
    pub fn fit(low: [f32; 3], high: [f32; 3], grid: Grid) -> Result<Self, FrameError> {
        let (low, high) = (low.map(f64::from), high.map(f64::from));
        let longest = |v: [f64; 3]| v.into_iter().map(f64::abs).fold(0.0, f64::max);
        let extent = longest([0, 1, 2].map(|i| high[i] - low[i]));
        let side = [extent, longest(low), 1.0].into_iter().find(|&s| s > 0.0).unwrap_or(1.0);
        Self::new(low, side / steps(grid), grid)
    }

    /// The frame that fits `grid` to some points; the unit box for none.
    ///
    /// # Errors
    /// [`FrameError::BadFrame`] when a point is not finite.
    pub fn fit_points(points: &[[f32; 3]], grid: Grid) -> Result<Self, FrameError> {
        let bounds = bounds(points.iter().copied()).unwrap_or([[0.0; 3], [1.0; 3]]);
        Self::fit(bounds[0], bounds[1], grid)
    }

    /// The scene point of the grid's lowest corner.
    pub const fn origin(&self) -> [f64; 3] {
        self.origin
    }

    /// The length of a grid unit, in scene units.
    pub const fn cell(&self) -> f64 {
        self.cell
    }

    /// The grid.
    pub const fn grid(&self) -> Grid {
        self.grid
    }

    /// The grid point nearest to a scene point. Halfway between two, the higher coordinate wins.
    ///
    /// # Errors
    /// [`FrameError`] when a coordinate is not finite or more than half a cell outside the frame.
    pub fn snap(&self, point: [f32; 3]) -> Result<IVec3, FrameError> {
        let mut snapped = [0; 3];
        for i in 0..3 {
            let (value, axis) = (f64::from(point[i]), ['x', 'y', 'z'][i]);
            if !value.is_finite() {
                return Err(FrameError::NotFinite { axis, value });
            }
            // Counted from the lowest corner, so `round` (half away from zero) rounds half up.
            let steps_up = ((value - self.origin[i]) / self.cell).round();
            if !(0.0..=steps(self.grid)).contains(&steps_up) {
                let (low, high) = (self.origin[i], self.origin[i] + self.cell * steps(self.grid));
                let excess = (low - value).max(value - high);
                return Err(FrameError::Outside { axis, value, excess, low, high });
            }
            snapped[i] = self.grid.min() + steps_up as i32;
        }
        Ok(IVec3::from(snapped))
    }

    /// A scene point in grid units, unrounded.
    pub fn to_grid(&self, point: [f64; 3]) -> [f64; 3] {
        let min = f64::from(self.grid.min());
        [0, 1, 2].map(|i| min + (point[i] - self.origin[i]) / self.cell)
    }

    /// The scene point of a point in grid units.
    pub fn to_scene(&self, point: [f64; 3]) -> [f64; 3] {
        let min = f64::from(self.grid.min());
        [0, 1, 2].map(|i| self.origin[i] + (point[i] - min) * self.cell)
    }

    /// The scene point of a grid point.
    pub fn point(&self, point: IVec3) -> [f64; 3] {
        self.to_scene(point.to_array().map(f64::from))
    }
}

/// The lowest and the highest corner of the smallest box around some points, or `None` for none.
///
/// A NaN coordinate does not count; a mesh is checked for those when it is snapped.
pub fn bounds(points: impl IntoIterator<Item = [f32; 3]>) -> Option<[[f32; 3]; 2]> {
    points.into_iter().fold(None, |bounds, p| {
        let [low, high] = bounds.unwrap_or([p; 2]);
        Some([[0, 1, 2].map(|i| low[i].min(p[i])), [0, 1, 2].map(|i| high[i].max(p[i]))])
    })
}

/// Cells along a side of the grid, points minus one.
fn steps(grid: Grid) -> f64 {
    f64::from(grid.max()) - f64::from(grid.min())
}

#[cfg(test)]
mod tests {
    use super::*;

    const GRID: Grid = Grid::DEFAULT;

    #[test]
    fn the_longest_side_spans_the_grid_exactly() {
        for scale in [1.0f32, 1e30, 1e-30, 1e-45, 3e38, 1e-38] {
            let (low, high) = ([-scale, 0.0, 0.0], [scale, scale, 0.0]);
            let frame = SceneFrame::fit(low, high, GRID).unwrap();
            assert_eq!(frame.snap(low), Ok(IVec3::splat(GRID.min())), "{scale:e}");
            let top = frame.snap(high).unwrap();
            assert_eq!((top.x, top.z), (GRID.max(), GRID.min()), "{scale:e}");
            assert!((top.y.abs_diff(0)) <= 1, "{scale:e}: {top}");
        }
    }

    #[test]
    fn snapping_is_to_the_nearest_point_and_ties_go_up() {
        let frame = SceneFrame::new([10.0; 3], 0.5, Grid::new(4).unwrap()).unwrap();
        let snap = |x: f32| frame.snap([x, 10.0, 10.0]).map(|p| p.x);
        assert_eq!(snap(10.0), Ok(-8));
        assert_eq!(snap(10.24), Ok(-8));
        assert_eq!(snap(10.25), Ok(-7));
        assert_eq!(snap(10.74), Ok(-7));
        assert_eq!(snap(17.5), Ok(7));
        assert_eq!(snap(17.74), Ok(7));
        assert!(snap(17.75).is_err());
        assert!(snap(9.75).is_err());
        assert_eq!(snap(9.76), Ok(-8));
    }

    #[test]
    fn a_point_outside_is_an_error_that_says_by_how_much() {
        let frame = SceneFrame::fit([0.0; 3], [1.0; 3], GRID).unwrap();
        let error = frame.snap([0.5, 1.25, 0.5]).unwrap_err();
        assert_eq!(
            error,
            FrameError::Outside { axis: 'y', value: 1.25, excess: 0.25, low: 0.0, high: 1.0 }
        );
        assert!(error.to_string().starts_with("y = 1.25e0 is 2.5e-1 outside"), "{error}");
        assert!(matches!(frame.snap([f32::MAX; 3]), Err(FrameError::Outside { .. })));
        assert!(matches!(
            frame.snap([0.0, 0.0, f32::NAN]),
            Err(FrameError::NotFinite { axis: 'z', .. })
        ));
    }

    #[test]
    fn a_point_scene_has_a_positive_cell() {
        for at in [0.0f32, 7.0, -1e30, 1e-45] {
            let frame = SceneFrame::fit([at; 3], [at; 3], GRID).unwrap();
            assert!(frame.cell() > 0.0);
            assert_eq!(frame.snap([at; 3]), Ok(IVec3::splat(GRID.min())));
        }
        assert_eq!(SceneFrame::fit_points(&[], GRID).unwrap().cell() * 16_777_215.0, 1.0);
    }

    #[test]
    fn frames_that_cannot_hold_anything_are_refused() {
        for cell in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                SceneFrame::new([0.0; 3], cell, GRID),
                Err(FrameError::BadFrame { .. })
            ));
        }
        assert!(SceneFrame::fit([f32::NEG_INFINITY; 3], [0.0; 3], GRID).is_err());
    }

    #[test]
    fn grid_points_map_back_and_forth() {
        let frame = SceneFrame::fit([-3.5, 2.0, 1e6], [100.0, 2.5, 1e6], GRID).unwrap();
        for p in [IVec3::splat(GRID.min()), IVec3::splat(GRID.max()), IVec3::new(5, -77, 1234)] {
            let back = frame.to_grid(frame.point(p));
            for i in 0..3 {
                assert!((back[i] - f64::from(p[i])).abs() < 1e-4, "{p} {back:?}");
            }
        }
    }
}
