//! T. Viitanen et al., "Fast Hardware Construction and Refitting of Quantized Bounding Volume
//! Hierarchies", Computer Graphics Forum 36(4), 2017: P3.

use crate::experiments::scenes::{
    ARMADILLO, BABYLONIAN, BUDDHA, BUNNY, CLOTH, CONFERENCE, CRYTEK, DRAGON, ELEPHANT, FAIRY,
    HAIRBALL, HAND, ITALIAN, LION, PaperScene, SPORTSCAR, TOASTERS,
};

/// Table 1, means of 16 scenes. Repairs relative to streaming in relative coordinates without treelets,
/// and traffic of builds and of refits relative to the separate pass: treelet depths 1 to 4 in relative
/// coordinates, then in modulo ones.
pub const TABLE_1: [[f64; 8]; 3] = [
    [1.00, 0.15, 0.04, 0.01, 0.22, 0.06, 0.02, 0.01],
    [0.84, 0.61, 0.59, 0.58, 0.63, 0.59, 0.58, 0.58],
    [0.79, 0.49, 0.45, 0.44, 0.52, 0.46, 0.44, 0.44],
];

/// Table 2, ms: LBVH builds to single-precision nodes; the same with the separate pass; streamed in
/// relative coordinates; streamed in modulo coordinates with treelets of depth 4.
pub static TABLE_2: [(&PaperScene, [f64; 4]); 16] = [
    (&TOASTERS, [0.2, 0.2, 0.3, 0.1]),
    (&BUNNY, [1.1, 1.6, 1.9, 0.8]),
    (&ELEPHANT, [1.3, 1.9, 2.2, 1.0]),
    (&CLOTH, [1.5, 2.1, 2.4, 1.1]),
    (&FAIRY, [2.1, 2.5, 2.6, 1.9]),
    (&ARMADILLO, [3.4, 4.8, 5.7, 2.6]),
    (&CRYTEK, [3.6, 4.8, 5.4, 3.0]),
    (&CONFERENCE, [3.2, 3.5, 3.4, 2.9]),
    (&SPORTSCAR, [4.3, 5.8, 6.4, 3.5]),
    (&ITALIAN, [5.0, 6.6, 7.7, 4.2]),
    (&BABYLONIAN, [6.7, 8.8, 10.2, 5.6]),
    (&HAND, [9.6, 13.3, 15.2, 7.6]),
    (&DRAGON, [13.4, 19.0, 21.5, 10.3]),
    (&BUDDHA, [16.7, 23.5, 26.0, 13.0]),
    (&LION, [23.9, 33.6, 37.7, 18.7]),
    (&HAIRBALL, [40.9, 56.5, 52.2, 32.2]),
];

/// Fig. 11 and §5.3: means of Table 2 relative to builds of single-precision nodes: with the separate pass,
/// streamed in relative coordinates, streamed in modulo coordinates with treelets of depth 4.
pub const FIG_11: [f64; 3] = [1.36, 1.52, 0.80];

/// §5.4: box and triangle tests of quantized trees above those of single-precision ones, per cent, in the
/// mean.
pub const EXTRA_TESTS: [f64; 2] = [8.0, 13.0];

/// Table 3, MB, builds: the separate pass (B), streamed in relative coordinates (R0), with one layer of
/// treelets (R1), streamed in modulo coordinates (M0), with one layer (M1).
pub static TABLE_3_BUILD: [(&PaperScene, [f64; 5]); 16] = [
    (&TOASTERS, [2.5, 2.1, 1.4, 1.5, 1.3]),
    (&BUNNY, [16.2, 13.3, 8.6, 8.7, 8.3]),
    (&ELEPHANT, [19.1, 15.8, 10.5, 10.8, 10.0]),
    (&CLOTH, [21.6, 17.5, 12.0, 12.2, 11.3]),
    (&FAIRY, [24.3, 23.0, 19.2, 19.4, 18.8]),
    (&ARMADILLO, [46.7, 38.5, 26.2, 26.8, 25.1]),
    (&CRYTEK, [44.9, 42.2, 31.7, 32.6, 30.3]),
    (&SPORTSCAR, [53.2, 50.0, 36.8, 38.9, 35.5]),
    (&CONFERENCE, [33.6, 34.0, 30.7, 31.2, 30.2]),
    (&ITALIAN, [57.0, 60.2, 45.2, 49.2, 43.4]),
    (&BABYLONIAN, [79.7, 81.4, 60.5, 66.4, 58.0]),
    (&HAND, [126.3, 111.3, 76.4, 77.8, 74.7]),
    (&DRAGON, [183.7, 155.7, 104.8, 107.9, 101.7]),
    (&BUDDHA, [211.3, 188.2, 128.4, 131.5, 124.7]),
    (&LION, [338.8, 280.6, 194.5, 199.4, 187.7]),
    (&HAIRBALL, [585.1, 438.5, 346.4, 352.0, 335.7]),
];

/// Fig. 1a, bytes a primitive of builds with one primitive a leaf: with the separate pass, and streamed at
/// best. The figure is not part of the text; these follow from §5.2.
pub const FIG_1: [f64; 2] = [252.0, 124.0];

/// Table 3, MB, refits: the same columns.
pub static TABLE_3_REFIT: [(&PaperScene, [f64; 5]); 16] = [
    (&TOASTERS, [2.0, 1.6, 0.9, 1.0, 0.8]),
    (&BUNNY, [12.9, 10.4, 5.5, 5.8, 5.1]),
    (&ELEPHANT, [15.0, 12.2, 7.0, 7.4, 6.2]),
    (&CLOTH, [17.3, 17.6, 8.1, 10.9, 7.2]),
    (&FAIRY, [14.3, 12.7, 9.5, 9.8, 9.0]),
    (&ARMADILLO, [36.5, 29.7, 17.3, 18.1, 15.4]),
    (&CRYTEK, [30.8, 27.3, 18.1, 19.1, 16.4]),
    (&SPORTSCAR, [37.3, 32.1, 20.6, 22.9, 19.1]),
    (&CONFERENCE, [16.8, 16.1, 13.9, 14.5, 13.5]),
    (&ITALIAN, [36.3, 33.1, 22.9, 25.5, 21.5]),
    (&BABYLONIAN, [52.3, 49.8, 34.5, 38.3, 31.5]),
    (&HAND, [92.9, 74.5, 44.8, 46.0, 42.0]),
    (&DRAGON, [141.0, 113.5, 65.1, 68.0, 60.2]),
    (&BUDDHA, [156.0, 149.8, 95.2, 96.1, 78.9]),
    (&LION, [260.2, 207.4, 122.9, 130.4, 112.4]),
    (&HAIRBALL, [441.4, 314.9, 216.5, 225.2, 199.4]),
];
