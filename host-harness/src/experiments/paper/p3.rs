//! T. Viitanen et al., "Fast Hardware Construction and Refitting of Quantized Bounding Volume
//! Hierarchies", Computer Graphics Forum 36(4), 2017: P3.

use crate::experiments::scenes::{BUNNY, CRYTEK, DRAGON, PaperScene};

/// Table 2, ms: LBVH builds to single-precision nodes, of the models that are known here.
pub static TABLE_2: [(&PaperScene, f64); 3] = [(&BUNNY, 1.1), (&CRYTEK, 3.6), (&DRAGON, 13.4)];
