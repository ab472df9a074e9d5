//! The box test of 64-byte nodes.

use xylem_core::geom::{Aabb, Ray};
use xylem_core::traverse::BoxTest;

use crate::cfu::{Cfu, Unit, boxes};

/// The box test by the custom function unit, which holds the ray.
#[derive(Debug)]
pub struct CustomBoxTest<'a, C>(&'a C);

const BOXES: u32 = Unit::BOXES;

impl<'a, C: Cfu> CustomBoxTest<'a, C> {
    /// A test of `ray`, and of no other until the next call.
    #[inline]
    pub fn new(cfu: &'a C, ray: &Ray) -> Self {
        let axes = ray.axes().each_ref().map(|axis| {
            let reciprocal = axis.reciprocal;
            let flags = u32::from(axis.negative) << 31
                | u32::from(axis.zero) << 30
                | u32::from(!reciprocal.is_exact()) << 29
                | (reciprocal.shift() & 31) << 24;
            // The mantissa of a component of zero does not count; it would not fit.
            (axis.origin as u32, flags | reciprocal.leading(24) & 0xff_ffff)
        });
        cfu.call::<BOXES, { boxes::RAY_X }>(axes[0].0, axes[0].1);
        cfu.call::<BOXES, { boxes::RAY_Y }>(axes[1].0, axes[1].1);
        cfu.call::<BOXES, { boxes::RAY_Z }>(axes[2].0, axes[2].1);
        cfu.call_wide::<BOXES, { boxes::TIME_MIN }>(ray.t_min().to_bits() as u64);
        Self(cfu)
    }
}

impl<C: Cfu> BoxTest for CustomBoxTest<'_, C> {
    #[inline(always)]
    fn entry(&self, _: &Ray, bounds: &Aabb, t_max: i64) -> Option<Option<i64>> {
        let (min, max) = (bounds.min, bounds.max);
        let cfu = self.0;
        cfu.call_wide::<BOXES, { boxes::TIME_MAX }>(t_max as u64);
        cfu.call::<BOXES, { boxes::BOX_X }>(min.x as u32, max.x as u32);
        cfu.call::<BOXES, { boxes::BOX_Y }>(min.y as u32, max.y as u32);
        cfu.call::<BOXES, { boxes::BOX_Z }>(min.z as u32, max.z as u32);
        let verdict = cfu.call::<BOXES, { boxes::VERDICT }>(0, 0);
        if verdict & 2 != 0 {
            return None;
        }
        if verdict & 1 == 0 {
            return Some(None);
        }
        let low = cfu.call::<BOXES, { boxes::ENTRY_LOW }>(0, 0);
        let high = cfu.call::<BOXES, { boxes::ENTRY_HIGH }>(0, 0);
        Some(Some(i64::from(high as i32) << 32 | i64::from(low)))
    }
}
