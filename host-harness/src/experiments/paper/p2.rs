//! T. Viitanen et al., "MergeTree: A Fast Hardware HLBVH Constructor for Animated Ray Tracing", ACM
//! Transactions on Graphics 36(5), 2017: P2.

use crate::experiments::scenes::{
    BABYLONIAN, BUDDHA, BUNNY, CLOTH, CONFERENCE, CRYTEK, DRAGON, FAIRY, ITALIAN, KITCHEN, LION,
    LIVINGROOM, PaperScene, SPORTSCAR, TOASTERS,
};

/// Table I, bytes: primitive reads, sort, BVH writes, total.
pub const TABLE_1: [(&str, [f64; 4]); 6] = [
    ("codes, radix-16 counting sort", [32.0, 192.0, 100.0, 324.0]),
    ("codes, multimergesort, 1 pass", [32.0, 16.0, 100.0, 148.0]),
    ("codes, multimergesort, 2 passes", [32.0, 32.0, 100.0, 164.0]),
    ("boxes, radix-16 counting sort", [32.0, 768.0, 68.0, 868.0]),
    ("boxes, multimergesort, 1 pass", [32.0, 64.0, 68.0, 164.0]),
    ("boxes, multimergesort, 2 passes", [32.0, 128.0, 68.0, 228.0]),
];

/// Table II, MB: Doyle et al.'s builder as reported, and as P2's model estimates it.
pub static TABLE_2: [(&PaperScene, [f64; 2]); 4] = [
    (&TOASTERS, [2.0, 1.0]),
    (&FAIRY, [25.0, 25.0]),
    (&CONFERENCE, [120.0, 125.0]),
    (&DRAGON, [380.0, 379.0]),
];

/// Table III's means of 14 scenes, as §6.3.2 states them: SAH cost in per cent of a full sweep's, of
/// HLBVH, with a binned SAH top level, with an ATRBVH top level, and of binned SAH alone. What the
/// table prints scene by scene is not part of the text that these were taken from.
pub const SAH_PERCENT: [f64; 4] = [148.0, 118.0, 111.0, 104.0];

/// Table VI, MB: proposed, hardware binned SAH, GPU HLBVH.
pub static TABLE_6: [(&PaperScene, [f64; 3]); 14] = [
    (&TOASTERS, [1.7, 1.1, 1.7]),
    (&BUNNY, [10.6, 18.0, 27.0]),
    (&CLOTH, [14.2, 25.0, 36.0]),
    (&FAIRY, [19.4, 70.0, 74.0]),
    (&CRYTEK, [32.9, 116.0, 115.0]),
    (&CONFERENCE, [28.9, 125.0, 125.0]),
    (&SPORTSCAR, [38.6, 110.0, 135.0]),
    (&ITALIAN, [43.9, 145.0, 169.0]),
    (&BABYLONIAN, [60.2, 219.0, 230.0]),
    (&KITCHEN, [77.1, 436.0, 352.0]),
    (&DRAGON, [124.8, 379.0, 413.0]),
    (&BUDDHA, [147.9, 493.0, 520.0]),
    (&LIVINGROOM, [150.4, 833.0, 685.0]),
    (&LION, [230.1, 800.0, 766.0]),
];

/// A memory of Table VII and what it measured there.
#[derive(Debug, Clone, Copy)]
pub struct Power {
    /// The name of that memory here.
    pub memory: &'static str,
    /// The most that it moves, GB/s.
    pub peak_gb_per_s: f64,
    /// What it moved, GB/s.
    pub gb_per_s: f64,
    /// The DRAM above an idle one, mW.
    pub dram_mw: f64,
    /// The share of the bus that was used, per cent (§6.3.1).
    pub bus_percent: f64,
}

/// Table VII and §6.3.1: means of 14 scenes.
pub const TABLE_7: [Power; 3] = [
    Power { memory: "slow", peak_gb_per_s: 12.8, gb_per_s: 9.2, dram_mw: 507.2, bus_percent: 72.0 },
    Power {
        memory: "medium",
        peak_gb_per_s: 25.6,
        gb_per_s: 13.9,
        dram_mw: 814.8,
        bus_percent: 54.0,
    },
    Power {
        memory: "fast",
        peak_gb_per_s: 42.7,
        gb_per_s: 18.9,
        dram_mw: 1112.4,
        bus_percent: 44.0,
    },
];
