//! The Cornell box, from the measurements that Cornell University's Program of Computer Graphics
//! published, in millimetres, mirrored so that the open side faces +z.

use super::super::vec3::{Vec3, sub};
use super::soup::Soup;

/// The box: five walls, a lamp, a short and a tall block without undersides.
pub(super) fn build(cells: u32) -> Soup {
    let mut soup = Soup::default();
    let (w, h, d) = (556.0, 548.8, 559.2);
    let mut wall = |corner: Vec3, a: Vec3, b: Vec3| soup.parallelogram(cells, corner, a, b);
    wall([0.0, 0.0, -d], [0.0, 0.0, d], [w, 0.0, 0.0]); // floor
    wall([0.0, h, -d], [w, 0.0, 0.0], [0.0, 0.0, d]); // ceiling
    wall([0.0, 0.0, -d], [w, 0.0, 0.0], [0.0, h, 0.0]); // back
    wall([0.0, 0.0, -d], [0.0, h, 0.0], [0.0, 0.0, d]); // left
    wall([w, 0.0, -d], [0.0, 0.0, d], [0.0, h, 0.0]); // right
    // The lamp hangs a little below the ceiling, so that the two do not coincide.
    wall([213.0, 548.7, -332.0], [130.0, 0.0, 0.0], [0.0, 0.0, 105.0]);
    block(&mut soup, cells, 165.0, [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]]);
    block(
        &mut soup,
        cells,
        330.0,
        [[423.0, 247.0], [265.0, 296.0], [314.0, 456.0], [472.0, 406.0]],
    );
    soup
}

/// A block on the floor, its footprint given in (x, depth) with x mirrored.
fn block(soup: &mut Soup, cells: u32, height: f64, footprint: [[f64; 2]; 4]) {
    let base = footprint.map(|[x, depth]| [556.0 - x, 0.0, depth - 559.2]);
    let up = [0.0, height, 0.0];
    for i in 0..4 {
        soup.parallelogram(cells, base[i], sub(base[(i + 1) % 4], base[i]), up);
    }
    // The footprint is nearly a parallelogram; the top takes its own fourth corner.
    let top = base.map(|[x, _, z]| [x, height, z]);
    soup.sheet(cells, |u, v| {
        [0, 1, 2].map(|i| {
            let near = top[0][i] + u * (top[1][i] - top[0][i]);
            let far = top[3][i] + u * (top[2][i] - top[3][i]);
            near + v * (far - near)
        })
    });
}
