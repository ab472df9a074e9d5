//! `xy_triangle_test` against `Triangle::intersect` and `Hit::new`.

use xylem_core::geom::{PrimIndex, Ray, Triangle};
use xylem_core::num::{Grid, Time};
use xylem_core::traverse::Hit;

use super::Multipliers;
use crate::random::Random;
use crate::rtl::Rtl;
use crate::traverser::geometry;

/// Checks `count` triangles and the cycles that each takes; returns how many were hit, met outside of the
/// interval, missed, and off the grid.
///
/// # Errors
/// The first that is wrong.
pub fn check_triangles(rtl: &mut Rtl, seed: u64, count: u64) -> Result<[u64; 4], String> {
    let mut multipliers =
        Multipliers::new(rtl, ["factors_a_o", "factors_b_o"], ["product_a_i", "product_b_i"]);
    let input = |name: &str| rtl.input(name);
    let (word_valid, word_index, word) =
        (input("word_valid_i"), input("word_index_i"), input("word_i"));
    let (start, tie_wins) = (input("start_i"), input("tie_wins_i"));
    let (origin, direction) = (input("origin_i"), input("direction_i"));
    let (t_min, t_max) = (input("t_min_i"), input("t_max_i"));
    let output = |name: &str| rtl.output(name);
    let (done, hit, off_grid) = (output("done_o"), output("hit_o"), output("off_grid_o"));
    let (t, u, v) = (output("t_o"), output("u_o"), output("v_o"));

    let mut random = Random::new(seed);
    let mut counts = [0; 4];
    for _ in 0..count {
        let (triangle, ray) = geometry::aimed(&mut random);
        let mut record = triangle.to_bytes();
        let spoilt = random.below(32) == 0;
        if spoilt {
            record[4 * random.below(9) as usize + 3] ^= 1 << random.below(8);
        }
        let ray_record = ray.to_bytes();
        rtl.set_bytes(origin, &ray_record[..12]);
        rtl.set_bytes(direction, &ray_record[12..24]);
        rtl.set(t_min, ray.t_min().to_bits() as u64);
        // The best time so far: the ray's end, or one at, before or after the hit.
        let line = triangle.intersect(&ray, Ray::TIME_LIMIT).map(|at| at.t.to_bits());
        let best = match (line, random.below(3)) {
            (Some(at), 0) => at + random.below(3) as i64 - 1,
            _ => ray.t_max().to_bits(),
        };
        rtl.set(t_max, best as u64);
        let tie = random.below(2) == 0;
        rtl.set(tie_wins, u32::from(tie));
        for (index, chunk) in record.chunks(8).enumerate() {
            rtl.set(word_valid, 1u32);
            rtl.set(word_index, index as u32);
            rtl.set_bytes(word, chunk);
            multipliers.tick(rtl)?;
            rtl.set(word_valid, 0u32);
            rtl.set(word, random.bits());
            if random.below(4) == 0 {
                multipliers.tick(rtl)?;
            }
        }
        let on_grid = Triangle::from_bytes(&record);
        let on_grid = on_grid.vertices.iter().all(|&v| Grid::DEFAULT.contains(v));
        rtl.settle();
        if rtl.is_set(off_grid) == on_grid {
            return Err(format!(
                "{triangle:?} is {}",
                if on_grid { "on the grid" } else { "off it" }
            ));
        }
        if !on_grid {
            counts[3] += 1;
            continue;
        }
        let triangle = Triangle::from_bytes(&record);
        rtl.set(start, 1u32);
        multipliers.tick(rtl)?;
        rtl.set(start, 0u32);
        let mut cycles = 1;
        loop {
            multipliers.tick(rtl)?;
            if rtl.is_set(done) {
                break;
            }
            cycles += 1;
            if cycles > 999 {
                return Err(format!("{triangle:?}: never done"));
            }
        }
        let at = triangle.intersect(&ray, Time::from_bits(best));
        let at = at.filter(|at| at.t.to_bits() < best || tie);
        let wanted = at.map(|at| Hit::new(PrimIndex(0), &at));
        let got = rtl.is_set(hit).then(|| {
            let t = (rtl.get(t) << 29) as i64 >> 29;
            (t, rtl.get(u) as u32, rtl.get(v) as u32)
        });
        let wanted = wanted.map(|hit| (hit.t.to_bits(), hit.u.to_bits(), hit.v.to_bits()));
        if got != wanted {
            return Err(format!("{triangle:?} {ray:?}: {got:?}, not {wanted:?}"));
        }
        let crossed = triangle.crossing(&ray).is_some();
        if cycles != triangle_cycles(crossed, wanted.is_some()) {
            return Err(format!("{triangle:?}: {cycles} cycles, {crossed}, {wanted:?}"));
        }
        counts[if wanted.is_some() { 0 } else { 2 - usize::from(crossed) }] += 1;
    }
    Ok(counts)
}

/// Cycles of a triangle test from its start to its end, as the header of the RTL says.
fn triangle_cycles(crossed: bool, hit: bool) -> u64 {
    match (crossed, hit) {
        (_, true) => 129,
        (true, false) => 63,
        (false, false) => 20,
    }
}
