//! Request patterns whose bandwidth other DRAM simulators were asked for.
//!
//! Requests are of 64 bytes, in program order. All randomness is splitmix64's, one draw a decision.

/// A pattern: its name and its requests, as (byte address, whether it writes).
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern {
    /// The name.
    pub name: &'static str,
    /// The requests.
    pub requests: Vec<(u64, bool)>,
}

const MB: u64 = 1 << 20;
/// Where writes begin in the patterns that mix.
const WRITES: u64 = 32 * MB;
const STREAMS: u64 = 256;
/// Blocks of 512 bytes in a stream.
const BLOCKS: u64 = 128;

/// All patterns, in the order of their names.
pub fn patterns() -> Vec<Pattern> {
    let aligned = 64 << 10;
    // A row further for each stream, so that bases rotate through the banks.
    let skewed = aligned + (8 << 10);
    let merged = merge(&random_streams(3), skewed);
    let read_only = merged.iter().copied().filter(|(_, write)| !write).collect();
    vec![
        Pattern { name: "a_seq_read", requests: sequential(false) },
        Pattern { name: "b_seq_write", requests: sequential(true) },
        Pattern { name: "c_rand512_read", requests: random_blocks(1, false) },
        Pattern { name: "c2_rand512_write", requests: random_blocks(1, true) },
        Pattern { name: "d_rand64_read", requests: random_reads(2) },
        Pattern { name: "e1_merge_rr_aligned", requests: merge(&round_robin(), aligned) },
        Pattern { name: "e2_merge_rnd_aligned", requests: merge(&random_streams(3), aligned) },
        Pattern { name: "e3_merge_rr_skew", requests: merge(&round_robin(), skewed) },
        Pattern { name: "e4_merge_rnd_skew", requests: merged },
        Pattern { name: "f_alt_rw", requests: alternating(WRITES) },
        Pattern { name: "f2_alt_rw_skew", requests: alternating(WRITES + (32 << 10)) },
        Pattern { name: "g_merge_readonly", requests: read_only },
    ]
}

/// The splitmix64 generator.
#[derive(Debug, Clone)]
pub struct SplitMix64(u64);

impl SplitMix64 {
    /// A generator of that seed.
    pub fn new(seed: u64) -> Self {
        Self(seed)
    }

    /// The next number.
    pub fn draw(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9E37_79B9_7F4A_7C15);
        let z = (self.0 ^ (self.0 >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
        let z = (z ^ (z >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
        z ^ (z >> 31)
    }

    /// The next number modulo `n`, which must not be 0.
    pub fn below(&mut self, n: u64) -> u64 {
        self.draw() % n
    }
}

/// 16 MB from address 0.
fn sequential(write: bool) -> Vec<(u64, bool)> {
    (0..16 * MB / 64).map(|i| (i * 64, write)).collect()
}

/// 32768 blocks of 512 bytes within 64 MB.
fn random_blocks(seed: u64, write: bool) -> Vec<(u64, bool)> {
    let mut random = SplitMix64::new(seed);
    let bases = (0..32768).map(|_| random.below(64 * MB / 512) * 512);
    bases.flat_map(|base| block(base, write)).collect()
}

/// 65536 requests within 64 MB.
fn random_reads(seed: u64) -> Vec<(u64, bool)> {
    let mut random = SplitMix64::new(seed);
    (0..65536).map(|_| (random.below(64 * MB / 64) * 64, false)).collect()
}

/// Blocks read from streams in that order, one block written after each.
fn merge(order: &[u64], stride: u64) -> Vec<(u64, bool)> {
    let mut blocks_read = [0; STREAMS as usize];
    let mut requests = Vec::with_capacity(order.len() * 16);
    for (i, stream) in (0..).zip(order) {
        let read = &mut blocks_read[*stream as usize];
        requests.extend(block(stream * stride + *read * 512, false));
        requests.extend(block(WRITES + i * 512, true));
        *read += 1;
    }
    requests
}

fn round_robin() -> Vec<u64> {
    (0..BLOCKS).flat_map(|_| 0..STREAMS).collect()
}

/// A uniform choice among the streams that are not at their end.
fn random_streams(seed: u64) -> Vec<u64> {
    let mut random = SplitMix64::new(seed);
    let mut live: Vec<u64> = (0..STREAMS).collect();
    let mut left = [BLOCKS; STREAMS as usize];
    let mut order = Vec::with_capacity((STREAMS * BLOCKS) as usize);
    while !live.is_empty() {
        let i = random.below(live.len() as u64) as usize;
        let stream = live[i];
        order.push(stream);
        left[stream as usize] -= 1;
        if left[stream as usize] == 0 {
            live.swap_remove(i);
        }
    }
    order
}

/// 8 MB read and 8 MB written, alternating.
fn alternating(writes: u64) -> Vec<(u64, bool)> {
    (0..8 * MB / 64).flat_map(|i| [(i * 64, false), (writes + i * 64, true)]).collect()
}

fn block(base: u64, write: bool) -> impl Iterator<Item = (u64, bool)> {
    (0..8).map(move |i| (base + i * 64, write))
}
