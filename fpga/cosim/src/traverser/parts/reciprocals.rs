//! `xy_reciprocal` against `Reciprocal::new`.

use xylem_core::geom::Axis;
use xylem_core::num::Reciprocal;

use super::packed;
use crate::random::Random;
use crate::rtl::Rtl;
use crate::traverser::geometry;

/// Checks `count` reciprocals, those around powers of two among them, and the cycles that each takes.
///
/// # Errors
/// The first that is wrong.
pub fn check_reciprocals(rtl: &mut Rtl, seed: u64, count: u64) -> Result<(), String> {
    let (start, component) = (rtl.input("start_i"), rtl.input("component_i"));
    let (done, reciprocal) = (rtl.output("done_o"), rtl.output("reciprocal_o"));
    let mut random = Random::new(seed);
    let corners = (0..=30).flat_map(|k| [(1 << k) - 1, 1 << k, (1 << k) + 1, -(1 << k)]);
    let corners: Vec<i32> = corners.filter(|d: &i32| d.unsigned_abs() <= 1 << 30).collect();
    for i in 0..count {
        let d = match corners.get(i as usize) {
            Some(&d) => d,
            None => geometry::number(&mut random, 1 << 30),
        };
        rtl.set(component, d as u32);
        rtl.set(start, 1u32);
        rtl.tick().map_err(|error| error.to_string())?;
        rtl.set(start, 0u32);
        let mut cycles = 1;
        loop {
            rtl.settle();
            if rtl.is_set(done) {
                break;
            }
            rtl.edge().map_err(|error| error.to_string())?;
            cycles += 1;
            if cycles > 99 {
                return Err(format!("{d}: never done"));
            }
        }
        let axis =
            Axis { origin: 0, negative: d < 0, zero: d == 0, reciprocal: Reciprocal::new(d) };
        let (_, expected) = packed(&axis, d);
        let mask = if d == 0 { 3 << 30 } else { u32::MAX };
        if (rtl.get(reciprocal) as u32 & mask) != expected as u32 {
            return Err(format!("1/{d} is {:08x}, not {expected:08x}", rtl.get(reciprocal)));
        }
        if cycles != reciprocal_cycles(d) {
            return Err(format!("1/{d} took {cycles} cycles, not {}", reciprocal_cycles(d)));
        }
    }
    Ok(())
}

/// Cycles from a reciprocal's start to its end, as the header of the RTL says.
fn reciprocal_cycles(component: i32) -> u64 {
    let magnitude = component.unsigned_abs();
    if magnitude == 0 {
        return 1;
    }
    let k = u32::BITS - (magnitude - 1).leading_zeros();
    let skipped = [28i32, 20, 12, 4].into_iter().find(|s| magnitude >= 2 << s).unwrap_or(-1);
    (k as i32 + 23 - skipped) as u64 + 1
}
