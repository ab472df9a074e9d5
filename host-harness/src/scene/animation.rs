//! Animations: one mesh in many places.

use super::error::SceneError;
use super::frame::{self, SceneFrame};
use super::mesh::{LoadOptions, Mesh};

/// How a mesh moves.
#[derive(Debug, Clone, PartialEq)]
pub enum Movement {
    /// Through these meshes, each vertex along straight lines, at an even pace.
    Keys(Vec<Mesh>),
    /// Twisted about the middle axis of its longest side, further from frame to frame. In the last frame
    /// the ends have turned by a quarter turn each, in opposite directions.
    Twist,
}

/// The frames of an animation, on one grid.
#[derive(Debug, Clone, PartialEq)]
pub struct Animation {
    /// The frames in order, at least one; all have the same triangles.
    pub frames: Vec<Mesh>,
}

impl Animation {
    /// Moves `mesh` through `frames` frames, at least 1. The first one is the mesh as it is, the last
    /// one the end of the movement. One grid is fitted around all of them.
    ///
    /// # Errors
    /// [`SceneError::Topology`] for a key that has other triangles than `mesh`; otherwise as
    /// [`Mesh::new`].
    pub fn new(
        mesh: &Mesh,
        movement: &Movement,
        frames: u32,
        options: &LoadOptions,
    ) -> Result<Self, SceneError> {
        if let Movement::Keys(keys) = movement {
            let differs = |key: &&Mesh| {
                key.indices != mesh.indices || key.positions.len() != mesh.positions.len()
            };
            if let Some(key) = keys.iter().find(differs) {
                return Err(SceneError::Topology {
                    scene: mesh.name.clone(),
                    key: key.name.clone(),
                });
            }
        }
        let last = f64::from(frames.max(2) - 1);
        let all: Vec<Vec<[f32; 3]>> = (0..frames.max(1))
            .map(|frame| match movement {
                Movement::Keys(keys) => between(mesh, keys, f64::from(frame) / last),
                Movement::Twist => twisted(mesh, f64::from(frame) / last),
            })
            .collect();
        let common = match (options.frame, frame::bounds(all.iter().flatten().copied())) {
            (None, Some([low, high])) => {
                let fitted = SceneFrame::fit(low, high, options.grid);
                let scene = mesh.name.clone();
                Some(fitted.map_err(|source| SceneError::Vertex { scene, vertex: 0, source })?)
            }
            (given, _) => given,
        };
        let options = LoadOptions { frame: common, ..*options };
        let on_grid = |positions| Mesh::new(&mesh.name, positions, mesh.indices.clone(), &options);
        Ok(Self { frames: all.into_iter().map(on_grid).collect::<Result<_, _>>()? })
    }
}

/// The positions at `time`, 0 to 1, on the way through the keys.
fn between(mesh: &Mesh, keys: &[Mesh], time: f64) -> Vec<[f32; 3]> {
    let at = time * keys.len() as f64;
    let leg = (at as usize).min(keys.len().saturating_sub(1));
    let key = |i: usize| if i == 0 { Some(mesh) } else { keys.get(i - 1) };
    let (Some(from), Some(to)) = (key(leg), key(leg + 1)) else { return mesh.positions.clone() };
    let share = at - leg as f64;
    let one = |(a, b): (&[f32; 3], &[f32; 3])| {
        [0, 1, 2].map(|i| (f64::from(a[i]) * (1.0 - share) + f64::from(b[i]) * share) as f32)
    };
    from.positions.iter().zip(&to.positions).map(one).collect()
}

/// The positions of a mesh whose ends have turned, by a quarter turn at `time` 1.
fn twisted(mesh: &Mesh, time: f64) -> Vec<[f32; 3]> {
    let Some([low, high]) = mesh.bounds() else { return Vec::new() };
    let side = |i: usize| f64::from(high[i]) - f64::from(low[i]);
    let middle = |i: usize| (f64::from(high[i]) + f64::from(low[i])) / 2.0;
    let axis = (0..3).fold(0, |best, i| if side(i) > side(best) { i } else { best });
    let (u, v) = ((axis + 1) % 3, (axis + 2) % 3);
    let turn = |p: &[f32; 3]| {
        let height = 2.0 * (f64::from(p[axis]) - middle(axis)) / side(axis);
        // The tangent of half the angle, from which its sine and cosine are rational: the same on every
        // machine.
        let t = if side(axis) > 0.0 { time * height } else { 0.0 };
        let (cos, sin) = ((1.0 - t * t) / (1.0 + t * t), 2.0 * t / (1.0 + t * t));
        let (x, y) = (f64::from(p[u]) - middle(u), f64::from(p[v]) - middle(v));
        let mut turned = *p;
        turned[u] = (middle(u) + cos * x - sin * y) as f32;
        turned[v] = (middle(v) + sin * x + cos * y) as f32;
        turned
    };
    // What does not turn keeps its bits.
    if time == 0.0 { mesh.positions.clone() } else { mesh.positions.iter().map(turn).collect() }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bar() -> Mesh {
        let positions = vec![[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [1.0, 8.0, 1.0], [0.0, 8.0, 1.0]];
        Mesh::new("bar", positions, vec![[0, 1, 2], [0, 2, 3]], &LoadOptions::default()).unwrap()
    }

    #[test]
    fn keys_are_passed_through_at_an_even_pace_on_one_grid() {
        let moved = |by: f32| {
            let mut mesh = bar();
            mesh.positions.iter_mut().for_each(|p| p[0] += by);
            mesh
        };
        let keys = Movement::Keys(vec![moved(4.0), moved(6.0)]);
        let animation = Animation::new(&bar(), &keys, 5, &LoadOptions::default()).unwrap();
        let x: Vec<f32> = animation.frames.iter().map(|mesh| mesh.positions[0][0]).collect();
        assert_eq!(x, [0.0, 2.0, 4.0, 5.0, 6.0]);
        assert!(animation.frames.iter().all(|mesh| mesh.frame == animation.frames[0].frame));
        let one = Animation::new(&bar(), &keys, 1, &LoadOptions::default()).unwrap();
        assert_eq!(one.frames.len(), 1);
        assert_eq!(one.frames[0].positions, bar().positions);
    }

    #[test]
    fn a_key_with_other_triangles_is_refused_by_name() {
        let mut other = bar();
        other.indices.swap(0, 1);
        other.name = "other".into();
        let keys = Movement::Keys(vec![bar(), other]);
        let error = Animation::new(&bar(), &keys, 2, &LoadOptions::default()).unwrap_err();
        assert!(matches!(&error, SceneError::Topology { key, .. } if key == "other"), "{error}");
    }

    #[test]
    fn a_twist_turns_the_ends_by_a_quarter_each_and_keeps_lengths() {
        let animation =
            Animation::new(&bar(), &Movement::Twist, 3, &LoadOptions::default()).unwrap();
        assert_eq!(animation.frames[0].positions, bar().positions);
        let last = &animation.frames[2];
        for (p, q) in bar().positions.iter().zip(&last.positions) {
            let from_axis = |p: &[f32; 3]| (p[0] - 0.5).hypot(p[2] - 0.5);
            assert_eq!(p[1], q[1]);
            assert!((from_axis(p) - from_axis(q)).abs() < 1e-6, "{p:?} {q:?}");
            // About y, from z to x: (z, x) becomes (-x, z) above and (x, -z) below.
            let sign = if p[1] > 4.0 { 1.0 } else { -1.0 };
            let (z, x) = (0.5 - sign * (p[0] - 0.5), 0.5 + sign * (p[2] - 0.5));
            assert!((q[2] - z).abs() < 1e-6 && (q[0] - x).abs() < 1e-6, "{p:?} {q:?}");
        }
    }
}
