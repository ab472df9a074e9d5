//! A scene ray as the core's fixed-point ray, and its times back.
//!
//! The core's ray is exact in itself; this is the only place where a ray is rounded. With `c` the
//! frame's cell in scene units:
//!
//! - **Origin**: to grid units in f64, then to the nearest 1/64 grid unit (halves away from zero). A
//!   component is off by at most 1/128 grid unit, plus 2⁻²⁶ for the f64 arithmetic before it.
//! - **Direction**: scaled by the power of two that brings the largest component into (2²⁹, 2³⁰],
//!   then each component rounded to nearest. The grid is cubic, so no division is needed; the largest
//!   component is exact and the others are off by at most half a unit, less than 2⁻³⁰ of the largest.
//!   +0 and −0 stay exactly zero. A component smaller than 2⁻³⁰ of the largest may round to zero and
//!   then counts as zero: within the reach of a ray in the grid it would move by less than a
//!   thirtieth of a grid unit.
//! - **Times**: scene time = `offset + factor ·` grid time, where `factor` is `c` times a power of
//!   two. The interval's ends go the other way in f64 and are rounded *down* to the core's 1/64.
//!
//! Rounding both ends down is exact with respect to reported times. The core reports a hit at the
//! exact time rounded *up*, `T`, a multiple of 1/64. For such a `T` and any real bound `m`, `T <= m`
//! if and only if `T <= floor(m)` and `T > m` if and only if `T > floor(m)`. So the core's test on
//! the rounded bounds decides `tmin < T <= tmax` for the unrounded ones.
//!
//! **Far origins.** An origin beyond [`Ray::ORIGIN_LIMIT`] is moved along the ray to where its line is
//! closest to the grid's centre, and `offset` is the time of that point. The move is made with the
//! unrounded direction, so the distance travelled does not multiply the direction's rounding; from an
//! origin `D` grid units away it adds an error of at most `D · 2⁻⁵⁰`. If even the closest point is
//! beyond the limit, the line passes the grid by: the limit is 3 half-widths from the centre and a
//! corner √3, so the ray is a certain miss.

use xylem_core::geom::Ray;
use xylem_core::num::{SubGrid, Time};
use xylem_core::traverse;

use super::frame::SceneFrame;
use super::rays::{BadRay, Hit, SceneRay};

/// What a scene ray is on the grid.
#[derive(Clone, Copy, PartialEq, Debug)]
pub enum GridRay {
    /// A ray for the core, and the way back for its times.
    Core {
        /// The ray.
        ray: Ray,
        /// From its times to scene times.
        times: TimeMap,
    },
    /// All direction components are zero: it hits nothing.
    ZeroDirection,
    /// The interval holds no time (`tmin >= tmax`): it hits nothing.
    EmptyInterval,
    /// The ray's line passes the grid by, or its interval ends before it or begins behind it (or
    /// lies between two representable times): it hits nothing.
    Misses,
}

/// The linear map from a core ray's times to the scene ray's.
#[derive(Clone, Copy, PartialEq, Debug)]
pub struct TimeMap {
    /// The scene time at which the core ray's time is zero.
    pub offset: f64,
    /// Scene time per unit of core time, positive.
    pub factor: f64,
}

/// How many rays never reached the core, and why.
#[derive(Clone, Copy, PartialEq, Eq, Debug, Default)]
pub struct ConversionCounts {
    /// Rays for the core.
    pub core: usize,
    /// [`GridRay::ZeroDirection`].
    pub zero_direction: usize,
    /// [`GridRay::EmptyInterval`].
    pub empty_interval: usize,
    /// [`GridRay::Misses`].
    pub misses: usize,
}

impl GridRay {
    /// Puts a scene ray on the grid. A ray that [`SceneRay::check`] refuses is [`Self::Misses`].
    pub fn new(frame: &SceneFrame, scene: &SceneRay) -> Self {
        if scene.check(0).is_err() {
            return Self::Misses;
        }
        if scene.t_min >= scene.t_max {
            return Self::EmptyInterval;
        }
        let Some((direction, scale)) = unit(scene.direction) else { return Self::ZeroDirection };
        // One unit of core time moves `direction` grid units, that is `direction · cell` in scene
        // units; the scene ray's own direction is `direction / scale`, so it takes `cell · scale`.
        let factor = frame.cell() * scale;
        let start = frame.to_grid(scene.origin.map(f64::from));
        let (origin, steps) = match sub_grid(start) {
            Some(origin) => (origin, 0.0),
            None => {
                let steps = closest_to_centre(start, direction);
                let moved = [0, 1, 2].map(|i| start[i] + steps * direction[i]);
                let Some(origin) = sub_grid(moved) else { return Self::Misses };
                (origin, steps)
            }
        };
        let times = TimeMap { offset: steps * factor, factor };
        let (t_min, t_max) = (times.to_core(scene.t_min), times.to_core(scene.t_max));
        if t_min >= t_max {
            return Self::Misses;
        }
        let fixed = direction.map(|d| (d * f64::from(1u32 << 30)).round() as i32);
        match Ray::new(origin, fixed.into(), t_min, t_max) {
            Ok(ray) => Self::Core { ray, times },
            // Every part is in its range by construction; were it not, no hit would be claimed.
            Err(_) => Self::Misses,
        }
    }

    /// The core's ray, if there is one.
    pub const fn core(&self) -> Option<&Ray> {
        match self {
            Self::Core { ray, .. } => Some(ray),
            _ => None,
        }
    }

    /// The hit in scene units of what the core found, `None` for nothing.
    pub fn hit(&self, found: Option<&traverse::Hit>) -> Hit {
        match (self, found) {
            (Self::Core { times, .. }, Some(found)) => Hit {
                prim: found.primitive.0,
                t: times.to_scene(found.t) as f32,
                u: found.u.to_num(),
                v: found.v.to_num(),
            },
            _ => Hit::MISS,
        }
    }
}

impl TimeMap {
    /// The scene time of a core time.
    pub fn to_scene(&self, time: Time) -> f64 {
        self.offset + self.factor * (time.to_bits() as f64 / 64.0)
    }

    /// The core time of a scene time, rounded down and clamped to ±[`Ray::TIME_LIMIT`].
    ///
    /// No hit in the grid is beyond the limit, so clamping loses none.
    pub fn to_core(&self, time: f32) -> Time {
        let limit = Ray::TIME_LIMIT.to_bits() as f64;
        let bits = ((f64::from(time) - self.offset) / self.factor * 64.0).floor();
        Time::from_bits(bits.clamp(-limit, limit) as i64)
    }
}

impl ConversionCounts {
    /// Counts some rays.
    pub fn of(rays: &[GridRay]) -> Self {
        let mut counts = Self::default();
        for ray in rays {
            match ray {
                GridRay::Core { .. } => counts.core += 1,
                GridRay::ZeroDirection => counts.zero_direction += 1,
                GridRay::EmptyInterval => counts.empty_interval += 1,
                GridRay::Misses => counts.misses += 1,
            }
        }
        counts
    }
}

/// Puts rays on the grid.
///
/// # Errors
/// [`BadRay`] names the first ray that has a NaN, or an infinite origin or direction.
pub fn convert(frame: &SceneFrame, rays: &[SceneRay]) -> Result<Vec<GridRay>, BadRay> {
    let one =
        |(index, ray): (usize, &SceneRay)| ray.check(index).map(|()| GridRay::new(frame, ray));
    rays.iter().enumerate().map(one).collect()
}

/// A direction times the power of two that brings its largest component into (1/2, 1], exactly, and
/// that power; `None` for zero.
fn unit(direction: [f32; 3]) -> Option<([f64; 3], f64)> {
    let direction = direction.map(f64::from);
    let largest = direction.into_iter().map(f64::abs).fold(0.0, f64::max);
    if largest == 0.0 {
        return None;
    }
    // The f64 exponent e with 2^e <= largest < 2^(e+1); f32 values are never subnormal in f64.
    let exponent = (largest.to_bits() >> 52) as i32 - 1023;
    let power_of_two = largest.to_bits() << 12 == 0;
    let scale = 2f64.powi(if power_of_two { -exponent } else { -exponent - 1 });
    Some((direction.map(|d| d * scale), scale))
}

/// A point in grid units rounded to 1/64, or `None` beyond [`Ray::ORIGIN_LIMIT`].
fn sub_grid(point: [f64; 3]) -> Option<[SubGrid; 3]> {
    let bits = point.map(|p| (p * 64.0).round());
    let limit = f64::from(Ray::ORIGIN_LIMIT) * 64.0;
    let inside = bits.iter().all(|b| b.abs() <= limit);
    inside.then(|| bits.map(|b| SubGrid::from_bits(b as i32)))
}

/// How many times `direction` it is from `start` to the point of the line closest to zero, the grid's
/// centre.
fn closest_to_centre(start: [f64; 3], direction: [f64; 3]) -> f64 {
    let dot = |a: [f64; 3], b: [f64; 3]| a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
    -dot(start, direction) / dot(direction, direction)
}

#[cfg(test)]
mod tests {
    use super::*;
    use xylem_core::geom::{PrimIndex, Triangle};
    use xylem_core::num::Grid;

    /// A unit cube whose grid cell is a power of two, so that expectations are exact.
    fn frame() -> SceneFrame {
        SceneFrame::new([0.0; 3], 2f64.powi(-24), Grid::DEFAULT).unwrap()
    }

    fn ray(origin: [f32; 3], direction: [f32; 3]) -> SceneRay {
        SceneRay { origin, direction, t_min: 0.0, t_max: f32::INFINITY }
    }

    fn core(scene: &SceneRay) -> (Ray, TimeMap) {
        match GridRay::new(&frame(), scene) {
            GridRay::Core { ray, times } => (ray, times),
            other => panic!("{other:?}"),
        }
    }

    /// A deterministic number in -1..1.
    fn noise(seed: &mut u64) -> f32 {
        *seed = seed.wrapping_mul(6364136223846793005).wrapping_add(1442695040888963407);
        ((*seed >> 40) as i32 - (1 << 23)) as f32 / (1 << 23) as f32
    }

    #[test]
    fn times_map_back_whatever_the_length_of_the_direction() {
        let frame = frame();
        let wall = [[0.5f32, 0.0, 0.0], [0.5, 0.99, 0.0], [0.5, 0.0, 0.99]];
        let vertices = wall.map(|p| frame.snap(p).unwrap());
        let wall = Triangle { vertices, id: 0 };
        for length in [1e-37f32, 1e-30, 1e-3, 0.75, 1.0, 5.0, 1e3, 1e30] {
            let scene = ray([-0.25, 0.25, 0.25], [length, 0.0, -0.0]);
            let grid = GridRay::new(&frame, &scene);
            let hit = wall.intersect(grid.core().unwrap(), grid.core().unwrap().t_max());
            let hit = traverse::Hit::new(PrimIndex(3), &hit.unwrap());
            let hit = grid.hit(Some(&hit));
            assert_eq!(hit.prim, 3);
            assert!((hit.t / (0.75 / length) - 1.0).abs() < 1e-6, "{length:e}: {hit:?}");
        }
    }

    #[test]
    fn the_core_ray_stays_within_the_stated_error_of_the_scene_ray() {
        let frame = frame();
        let mut seed = 1;
        for _ in 0..2000 {
            let scene = ray(
                [0; 3].map(|_| 0.5 + 1.4 * noise(&mut seed)),
                [0; 3].map(|_| 3.0 * noise(&mut seed)),
            );
            let (ray, times) = core(&scene);
            for i in 0..3 {
                let exact = frame.to_grid(scene.origin.map(f64::from))[i];
                assert!((ray.origin()[i].to_num::<f64>() - exact).abs() <= 1.0 / 128.0 + 1e-8);
                let fixed = f64::from(ray.direction()[i]) / (1u32 << 30) as f64;
                let exact = f64::from(scene.direction[i]) * times.factor / frame.cell();
                assert!((fixed - exact).abs() <= 2f64.powi(-31), "{scene:?}");
            }
        }
    }

    #[test]
    fn zeros_of_either_sign_stay_zero_and_dust_becomes_zero() {
        let (positive, _) = core(&ray([0.5; 3], [0.0, 0.0, 1.0]));
        let (negative, _) = core(&ray([0.5; 3], [-0.0, -0.0, 1.0]));
        assert_eq!(positive, negative);
        assert!(positive.axes()[0].zero && !positive.axes()[2].zero);
        let (dust, _) = core(&ray([0.5; 3], [2f32.powi(-32), -2f32.powi(-31), 1.0]));
        assert_eq!(dust.direction().to_array(), [0, -1, 1 << 30]);
    }

    #[test]
    fn powers_of_two_scale_to_the_top_of_the_range() {
        for (largest, fixed) in [(1.0f32, 1 << 30), (0.125, 1 << 30), (0.75, 3 << 28)] {
            assert_eq!(core(&ray([0.5; 3], [0.0, -largest, 0.0])).0.direction().y, -fixed);
        }
        let below = f32::from_bits(1.0f32.to_bits() - 1);
        assert_eq!(core(&ray([0.5; 3], [below, 0.0, 0.0])).0.direction().x, (1 << 30) - (1 << 6));
    }

    #[test]
    fn far_origins_move_along_the_ray_and_keep_their_times() {
        let far = ray([-1000.0, 0.25, 0.75], [2.0, 0.0, 0.0]);
        let (moved, times) = core(&far);
        assert!(moved.origin()[0].unsigned_abs() <= Ray::ORIGIN_LIMIT as u32);
        // x = 0.25 is reached at t = 500.125.
        let quarter = frame().snap([0.25; 3]).unwrap().x;
        let steps = f64::from(quarter) - moved.origin()[0].to_num::<f64>();
        assert!((times.to_scene(Time::from_num(steps)) - 500.125).abs() < 1e-9);
        assert_eq!(
            GridRay::new(&frame(), &ray([-1000.0, 0.5, 0.5], [1.0, 1.0, 0.0])),
            GridRay::Misses
        );
        // Looking away from the grid: the interval ends before the line reaches it.
        let away = SceneRay { direction: [-2.0, 0.0, 0.0], ..far };
        assert_eq!(GridRay::new(&frame(), &away), GridRay::Misses);
        let extreme = ray([3e38, 3e38, 3e38], [-1.0, -1.0, -1.0]);
        assert!(matches!(GridRay::new(&frame(), &extreme), GridRay::Core { .. } | GridRay::Misses));
    }

    #[test]
    fn bounds_are_rounded_down_so_that_reported_times_decide() {
        let (_, times) = core(&ray([0.0; 3], [0.7, 0.1, 0.0]));
        let mut seed = 9;
        for _ in 0..1000 {
            let bound = noise(&mut seed);
            let fixed = times.to_core(bound);
            assert!(times.to_scene(fixed) <= f64::from(bound));
            assert!(times.to_scene(fixed + Time::DELTA) > f64::from(bound));
        }
        assert_eq!(times.to_core(f32::INFINITY), Ray::TIME_LIMIT);
        assert_eq!(times.to_core(f32::NEG_INFINITY), -Ray::TIME_LIMIT);
    }

    #[test]
    fn rays_that_cannot_hit_are_counted_by_reason() {
        let good = ray([0.5; 3], [0.0, 1.0, 0.0]);
        let rays = [
            good,
            SceneRay { direction: [0.0, -0.0, 0.0], ..good },
            SceneRay { t_min: 2.0, t_max: 1.0, ..good },
            SceneRay { t_min: 1.0, t_max: 1.0, ..good },
            SceneRay { t_min: 100.0, ..good },
        ];
        let grid = convert(&frame(), &rays).unwrap();
        let expect = ConversionCounts { core: 1, zero_direction: 1, empty_interval: 2, misses: 1 };
        assert_eq!(ConversionCounts::of(&grid), expect);
        assert_eq!(grid[1].hit(None), Hit::MISS);
        let bad = [good, SceneRay { t_max: f32::NAN, ..good }];
        let error = convert(&frame(), &bad).unwrap_err();
        assert!(error.to_string().starts_with("ray 1: tmax is NaN"), "{error}");
    }
}
