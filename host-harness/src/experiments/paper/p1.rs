//! T. Viitanen et al., "MergeTree: a HLBVH constructor for mobile systems", SIGGRAPH Asia 2015
//! Technical Briefs: P1.

use crate::experiments::scenes::{CLOTH, CONFERENCE, DRAGON, FAIRY, PaperScene, SIBENIK};

/// Table 1, "32B IO words / primitive": primitive reads, sorting, BVH writes, total.
pub const TABLE_1: [(&str, [f64; 4]); 6] = [
    ("codes, radix-16 counting sort", [10.0, 48.0, 24.0, 82.0]),
    ("codes, multimerge, 1 pass", [10.0, 4.0, 24.0, 38.0]),
    ("codes, multimerge, 2 passes", [10.0, 8.0, 24.0, 42.0]),
    ("boxes, radix-16 counting sort", [10.0, 168.0, 14.0, 192.0]),
    ("boxes, multimerge, 1 pass", [10.0, 14.0, 14.0, 38.0]),
    ("boxes, multimerge, 2 passes", [10.0, 28.0, 14.0, 52.0]),
];

/// Table 2, MB: Doyle et al., proposed.
pub static TABLE_2: [(&PaperScene, [f64; 2]); 3] =
    [(&CLOTH, [25.0, 15.0]), (&CONFERENCE, [120.0, 53.0]), (&DRAGON, [380.0, 140.0])];

/// Table 3, the proposed builder, ms: at 16 and at 32 GB/s.
pub static TABLE_3: [(&PaperScene, [f64; 2]); 5] = [
    (&SIBENIK, [0.92, 0.60]),
    (&CLOTH, [1.02, 0.62]),
    (&FAIRY, [1.98, 1.24]),
    (&CONFERENCE, [3.79, 2.54]),
    (&DRAGON, [9.74, 5.93]),
];

/// §5: the share of the bus that the sibenik scene used, per cent; and the mean of all five.
pub const BUS_PERCENT: [f64; 2] = [82.0, 87.0];
/// §5: what the top-level SAH build takes of the time, per cent, in the mean.
pub const TOP_LEVEL_PERCENT: f64 = 2.0;
