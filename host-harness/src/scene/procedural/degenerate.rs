//! Small scenes that break builders and tracers: each a case that a loader, a sorter, a builder or a
//! box test has been seen to get wrong somewhere.

use super::soup::{Soup, UnitSphere};

/// A degenerate scene, `degenerate/NAME`.
#[derive(Clone, Copy, Debug)]
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// What is odd about it.
    pub about: &'static str,
    build: fn() -> Soup,
}

impl Case {
    /// The scene.
    pub fn build(&self) -> Soup {
        (self.build)()
    }
}

/// Every degenerate scene.
pub const CASES: &[Case] = &[
    Case { name: "empty", about: "no vertices, no faces", build: Soup::default },
    Case {
        name: "one_triangle",
        about: "a tree that is a single leaf",
        build: || triangles([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [0.0, 1.0, 0.5]]]),
    },
    Case {
        name: "two_triangles",
        about: "the smallest tree with a node",
        build: || {
            let far = [[3.0, 0.0, 0.0], [4.0, 0.0, 1.0], [3.0, 1.0, 0.5]];
            triangles([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [0.0, 1.0, 0.5]], far])
        },
    },
    Case {
        name: "identical",
        about: "100 times the same triangle: equal codes, equal boxes, a leaf that overflows",
        build: || triangles([[[0.0, 0.0, 0.0], [1.0, 0.0, 0.25], [0.0, 1.0, 0.5]]; 100]),
    },
    Case {
        name: "coplanar",
        about: "a flat sheet across the axes: every ray in its plane misses it",
        build: || {
            let mut soup = Soup::default();
            soup.parallelogram(12, [0.0; 3], [3.0, 1.5, 0.0], [0.0, 1.5, 3.0]);
            soup
        },
    },
    Case {
        name: "flat",
        about: "a sheet in y = 0.1: boxes without thickness, 0.1 is not a binary fraction",
        build: || {
            let mut soup = Soup::default();
            soup.parallelogram(12, [-1.0, 0.1, -1.0], [0.0, 0.0, 2.0], [2.0, 0.0, 0.0]);
            soup
        },
    },
    Case {
        name: "zero_area",
        about: "points, collinear corners and one triangle",
        build: zero_area,
    },
    Case {
        name: "all_one_point",
        about: "twelve triangles that are one point: the scene box has no extent",
        build: || triangles([[[2.0, -3.0, 5.0]; 3]; 12]),
    },
    Case {
        name: "huge",
        about: "a ball of radius 1e30: squared lengths overflow f32",
        build: || ball([0.0; 3], 1e30),
    },
    Case {
        name: "tiny",
        about: "a ball of radius 1e-30: squared lengths underflow f32",
        build: || ball([0.0; 3], 1e-30),
    },
    Case {
        name: "subnormal",
        about: "a ball of radius 1e-40: every coordinate is a subnormal f32",
        build: || ball([0.0; 3], 1e-40),
    },
    Case {
        name: "far_away",
        about: "a ball of radius 1 at 1e6: f32 leaves 16 steps a unit, vertices coincide",
        build: || ball([1e6, -1e6, 1e6], 1.0),
    },
    Case {
        name: "duplicate_faces",
        about: "a ball whose every face comes twice, the copy wound the other way",
        build: || {
            let mut soup = ball([0.0; 3], 1.0);
            let copies: Vec<_> = soup.indices.iter().map(|&[a, b, c]| [a, c, b]).collect();
            soup.indices.extend(copies);
            soup
        },
    },
    Case {
        name: "needles",
        about: "slivers a hundred thousand times as long as wide, across the whole scene",
        build: || {
            triangles([0, 1, 2, 3, 4, 5, 6, 7].map(|i| {
                let y = f64::from(i) / 7.0;
                [[0.0, y, 0.0], [1.0, 1.0 - y, 1.0], [1.0, 1.0 - y + 1e-5, 1.0]]
            }))
        },
    },
];

fn triangles<const N: usize>(list: [[[f64; 3]; 3]; N]) -> Soup {
    let mut soup = Soup::default();
    for corners in list {
        let [a, b, c] = corners.map(|p| soup.vertex(p));
        soup.indices.push([a, b, c]);
    }
    soup
}

fn ball(centre: [f64; 3], radius: f64) -> Soup {
    let mut soup = Soup::default();
    soup.sphere(&UnitSphere::new(1), centre, radius);
    soup
}

fn zero_area() -> Soup {
    let (o, x, xx, y) = ([0.0; 3], [1.0, 0.0, 0.0], [2.0, 0.0, 0.0], [0.0, 1.0, 0.0]);
    triangles([[o, o, o], [o, x, xx], [o, x, o], [xx, xx, y], [o, [1.0; 3], [2.0; 3]], [o, x, y]])
}
