//! A fractal height field by midpoint displacement: the diamond-square method of Fournier, Fussell
//! and Carpenter (1982).

use super::super::random::Random;
use super::soup::Soup;

/// The terrain over the unit square with 2^levels cells a side, at most about a third high.
pub(super) fn build(levels: u32, seed: u32) -> Soup {
    let cells = 1usize << levels;
    let heights = heights(cells, seed);
    let mut soup = Soup::default();
    soup.sheet(cells as u32, |u, v| {
        // `u` and `v` are multiples of 1 / cells, exactly.
        let at = |t: f64| (t * cells as f64) as usize;
        // Water fills the valleys, so that part of the scene is flat.
        let height = heights[at(v) * (cells + 1) + at(u)].max(-0.02);
        [u, height, 1.0 - v]
    });
    soup
}

/// Heights at the corners of the cells, row by row.
fn heights(cells: usize, seed: u32) -> Vec<f64> {
    let row = cells + 1;
    let mut heights = vec![0.0; row * row];
    let mut random = Random::new(u64::from(seed));
    for corner in [0, cells, cells * row, cells * row + cells] {
        heights[corner] = 0.1 * random.signed();
    }
    let (mut step, mut roughness) = (cells, 0.2);
    while step > 1 {
        let half = step / 2;
        // Squares: the centre of each from its four corners.
        for y in (half..cells).step_by(step) {
            for x in (half..cells).step_by(step) {
                let sum = heights[(y - half) * row + x - half]
                    + heights[(y - half) * row + x + half]
                    + heights[(y + half) * row + x - half]
                    + heights[(y + half) * row + x + half];
                heights[y * row + x] = sum / 4.0 + roughness * random.signed();
            }
        }
        // Diamonds: the middle of each side from its three or four neighbours.
        for y in (0..=cells).step_by(half) {
            let first = if (y / half).is_multiple_of(2) { half } else { 0 };
            for x in (first..=cells).step_by(step) {
                let (mut sum, mut count) = (0.0, 0.0);
                let mut add = |x: Option<usize>, y: Option<usize>| {
                    if let (Some(x), Some(y)) =
                        (x.filter(|&x| x <= cells), y.filter(|&y| y <= cells))
                    {
                        sum += heights[y * row + x];
                        count += 1.0;
                    }
                };
                add(x.checked_sub(half), Some(y));
                add(Some(x + half), Some(y));
                add(Some(x), y.checked_sub(half));
                add(Some(x), Some(y + half));
                heights[y * row + x] = sum / count + roughness * random.signed();
            }
        }
        step = half;
        roughness *= 0.44;
    }
    heights
}
