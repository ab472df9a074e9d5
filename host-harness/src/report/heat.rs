//! Heat maps: what each pixel's ray cost, as in the thesis' Fig. 2.2.

use super::Picture;
use super::colour::{Rgb, heat};
use super::picture::LETTER;
use super::units;

/// A number for each pixel of an image and what it counts.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct HeatMap {
    /// What is counted, in the plural: `node visits`.
    pub what: String,
    /// Width of the image in pixels.
    pub width: u32,
    /// The counts, row by row from the top.
    pub counts: Vec<u64>,
}

const MARGIN: u32 = 8;
const BAR: u32 = 12;
const PAPER: Rgb = [16, 16, 20];
const INK: Rgb = [225, 225, 230];

impl HeatMap {
    /// The mean count.
    pub fn mean(&self) -> Option<f64> {
        units::ratio(self.counts.iter().sum(), self.counts.len() as u64)
    }

    /// The largest count.
    pub fn max(&self) -> u64 {
        self.counts.iter().copied().max().unwrap_or(0)
    }

    /// A good upper end for the scale: all but a thousandth of the counts are within it, so that a
    /// few outliers do not darken the rest; and its quarters are round numbers.
    pub fn top(&self) -> u64 {
        let mut sorted = self.counts.clone();
        sorted.sort_unstable();
        let at = (sorted.len() * 999).div_ceil(1000).max(1) - 1;
        let enough = sorted.get(at).copied().unwrap_or(0).max(1);
        // 4, 8, .. 40, 60, 80, 100, 120, 160, .. 400, 600, ..
        let tens = (10u64.pow(enough.ilog10()) / 10).max(1);
        let step = if enough < 40 * tens { 4 * tens } else { 20 * tens };
        enough.next_multiple_of(step)
    }

    /// The picture, with a legend of the scale from 0 to `top` below; counts above take its end.
    pub fn picture(&self, top: u64) -> Picture {
        let scale = |count: u64| heat(count as f64 / top.max(1) as f64);
        let width = self.width.max(1);
        let height = (self.counts.len() as u32).div_ceil(width);
        let pixels = self.counts.iter().map(|&count| scale(count)).collect();
        let rows = 2 * LETTER + BAR + 4 * MARGIN;
        let mut picture = Picture::from_pixels(width, height, pixels).extended(rows, PAPER);

        let (left, right) = (MARGIN, width.saturating_sub(MARGIN).max(MARGIN + 1));
        let mean = self.mean().map_or(String::new(), |m| format!("mean {m:.1}, "));
        let title = format!("{} per ray: {mean}max {}", self.what, units::count(self.max()));
        picture.text(left, height + MARGIN, &title, INK);
        let bar = height + MARGIN + LETTER + MARGIN;
        for x in left..right {
            let t = f64::from(x - left) / f64::from(right - left - 1).max(1.0);
            for y in bar..bar + BAR {
                picture.set(x, y, heat(t));
            }
        }
        for quarter in 0..=4u32 {
            let mut label = units::count(top * u64::from(quarter) / 4);
            if quarter == 4 && self.max() > top {
                label.insert_str(0, ">= ");
            }
            let x = left + (right - 1 - left) * quarter / 4;
            for y in bar + BAR..bar + BAR + MARGIN / 2 {
                picture.set(x, y, INK);
            }
            let extent = label.len() as u32 * LETTER;
            let start = x.saturating_sub(extent / 2).min(right.saturating_sub(extent)).max(left);
            picture.text(start, bar + BAR + MARGIN, &label, INK);
        }
        picture
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn counts_become_colours_of_a_scale_that_ignores_outliers() {
        let mut counts = vec![10; 4000];
        counts[0] = 0;
        counts[1] = 500;
        let map = HeatMap { what: "node visits".into(), width: 80, counts };
        assert_eq!((map.top(), map.max()), (12, 500));
        let picture = map.picture(map.top());
        assert_eq!(picture.width(), 80);
        assert!(picture.height() > 50);
        assert_eq!(picture.pixels()[..3], [heat(0.0), heat(1.0), heat(10.0 / 12.0)]);
    }

    #[test]
    fn an_empty_map_and_one_of_zeros_have_pictures() {
        let of = |counts: Vec<u64>| HeatMap { what: "tests".into(), width: 2, counts };
        assert_eq!(of(vec![0; 4]).picture(of(vec![0; 4]).top()).pixels()[0], heat(0.0));
        let tops = [0, 39, 41, 121, 399, 401, 1999].map(|n| of(vec![n]).top());
        assert_eq!(tops, [4, 40, 60, 160, 400, 600, 2000]);
        assert_eq!(of(vec![]).top(), 4);
        assert_eq!(of(vec![]).mean(), None);
        assert!(of(vec![]).picture(1).height() > 0);
    }
}
