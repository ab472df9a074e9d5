//! Hairs on a ball: thin triangles at every angle, the hard case for boxes.

use super::super::random::Random;
use super::super::vec3::{Vec3, along, cross, normalize, tangents};
use super::soup::{Soup, UnitSphere};

/// Width of a hair at its root, in radii of the ball.
const WIDTH: f64 = 0.012;
/// Length of a hair.
const LENGTH: f64 = 0.9;

/// A ball of radius 1 with `hairs` hairs of `segments` pieces, each a ribbon that tapers to a tip
/// (whose last triangle is left a hundredth of the width, not a point).
pub(super) fn build(hairs: u32, segments: u32, seed: u32) -> Soup {
    let mut soup = Soup::default();
    soup.sphere(&UnitSphere::new(3), [0.0; 3], 1.0);
    for hair in 0..hairs {
        let mut random = Random::stream(u64::from(seed), u64::from(hair));
        grow(&mut soup, segments, &mut random);
    }
    soup
}

/// Adds one hair: it leaves the ball upright, is blown towards +x, sinks and curls.
fn grow(soup: &mut Soup, segments: u32, random: &mut Random) {
    let root = on_sphere(random);
    let [side, front] = tangents(root);
    let curl = along(side.map(|c| c * random.signed()), random.signed(), front);
    let length = LENGTH * (0.7 + 0.3 * random.unit());
    let step = length / f64::from(segments);
    let (mut at, mut heading) = (root, root);
    // The ribbon faces a direction of its own, or all hairs would vanish from one side.
    let facing = normalize([random.signed(), random.signed(), random.signed() + 1.5]);
    let mut before: Option<[u32; 2]> = None;
    for piece in 0..=segments {
        let t = f64::from(piece) / f64::from(segments);
        let across = normalize(cross(heading, facing));
        let half = WIDTH / 2.0 * (1.0 - 0.99 * t);
        let edge = [soup.vertex(along(at, -half, across)), soup.vertex(along(at, half, across))];
        if let Some([left, right]) = before {
            soup.quad([left, right, edge[1], edge[0]]);
        }
        before = Some(edge);
        at = along(at, step, heading);
        let force = along([0.7, -1.1, 0.0], 0.8, curl);
        heading = normalize(along(heading, step * 1.6, force));
    }
}

/// A point on the unit sphere, evenly distributed (Marsaglia, 1972).
fn on_sphere(random: &mut Random) -> Vec3 {
    let [x, y] = random.in_disc();
    let s = x * x + y * y;
    let f = 2.0 * (1.0 - s).sqrt();
    normalize([x * f, 1.0 - 2.0 * s, y * f])
}
