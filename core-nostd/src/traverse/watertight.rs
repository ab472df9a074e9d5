//! A proof that no hit is lost, in any node format, however a tree was built and compressed.
//!
//! This module has no code: it is the argument, in lemmas small enough that a machine can check each.
//! Two checks do. `tests/tests/lemmas/` runs the core's own functions over *all* of small domains
//! (every node, box and coordinate of 4 bits, every component below 2²⁴, every small box and ray).
//! `tests/proof/lemmas.py` states the lemmas as formulas over integers and reals, and a solver shows
//! that no counterexample of *any* size exists; it also shows that each rounding rule is needed,
//! by finding one as soon as the rule is dropped. What no machine has checked is that these formulas
//! are what the functions compute beyond the small domains, and the inductions in the theorems; those
//! are tested on random trees and rays (`tests/tests/watertight.rs`, `methods.rs`, `oracle.rs`).
//!
//! # Notation
//!
//! All lemmas but the first two are about one axis. Positions are integers in grid units; `E = 2^e` is
//! a cell of a local grid, `M = 2^N` the most cells that a node spans. A node's *exact box* is the
//! smallest one around its triangles, `[p, q]` on the axis, both ends included. Its *decoded box*
//! `[u, v)` is what a reader of the quantized tree finds: `u = kE` and `v = u + cE` with
//! `1 <= c <= M`. `⌊x⌋` is the floor, also of negative numbers.
//!
//! # Geometry
//!
//! **Lemma 1.** *If the exact test says that a ray hits a triangle, then at the exact time of the hit the
//! ray is in the triangle's box.* The test ([`crate::geom::Triangle::intersect`]) evaluates polynomials
//! of the inputs without rounding: it hits only if the point is `(1-a-b) v0 + a v1 + b v2` with weights
//! that are not negative. Each coordinate of the point is then between the least and the greatest of
//! the vertices', which are the box. The loader rounds vertices to the grid *before* any box is made,
//! so this holds of the vertices that are tested. (That the hits of triangles sharing an edge leave
//! no gap is a property of the same exact test: both evaluate the same edge, and both are closed.)
//!
//! **Lemma 2.** *At that time it is in the exact box of every node above.* A union of boxes holds both.
//!
//! # Quantization
//!
//! **Lemma 3 (outward).** *`⌊p/E⌋E <= p` and `q < (⌊q/E⌋ + 1)E`, by no more than a cell.* So a box encoded
//! by [`Placement::encode`](crate::compress::Placement::encode) is inside its decoded one, and strictly
//! below its upper planes.
//!
//! **Lemma 4 (it fits).** *If `u <= p <= q < v`, then `r = ⌊p/E⌋ - k` and `s = ⌊q/E⌋ + 1 - k` satisfy
//! `0 <= r < s <= c`.* So `encode` accepts every box in a node's decoded box, `r` and `s - 1` fit `N`
//! bits, and the child's decoded box is in its parent's.
//!
//! **Lemma 5 (what is written is what is read).** *Relative: `(r, s - 1)` gives back `r` and `s`. Modulo:
//! from `r̂ = (k + r) mod M`, `ŝ = (k + s) mod M` and `k mod M` follow `r = (r̂ - k) mod M` and
//! `s - r = ((ŝ - r̂ - 1) mod M) + 1`.* `r` is below `M`; the width is from 1 to `M`, as Lemma 4 says that
//! it is never 0, and those are `M` values that differ modulo `M`. This is what the extra cell of P3
//! Eq. 1 is for. P3 Fig. 4 computes `s` first, which is from 1 to `2M` modulo `M` and ambiguous.
//!
//! **Lemma 6 (both sides agree).** *A child's context, computed from `r`, `s` and its parent's context,
//! describes the same box on a grid `2^f` times finer: `(s - r) 2^f <= M` cells of `E/2^f`, with the
//! number of the lower one, modulo `M`, `((k + r) 2^f) mod M`.* Encoder and reader both call
//! [`Context::child`](crate::compress::Context::child) with the same `r` and `s` by Lemma 5, and start
//! from [`Placement::root`](crate::compress::Placement::root) of the same exact box: so they have the same
//! context at every node.
//!
//! **Lemma 7 (floors nest).** *For `A = 2^a`, `B = 2^b`, `a <= b`: `⌊⌊x/A⌋A / B⌋ = ⌊x/B⌋`, and
//! `⌊((⌊x/A⌋ + 1)A - 1) / B⌋ = ⌊x/B⌋`.* So a bound that is rounded to a grid, brought inside by one unit if
//! it is an upper one, and rounded to a coarser grid, is what the exact bound is rounded to.
//!
//! **Lemma 8 (another context).** *Modulo coordinates that were written in a context are read in another
//! one of the same scale as the same box, if that box is in the other's decoded box. Relative ones are
//! if, besides, `k = k' mod M` and the two decoded boxes meet.* The first is Lemma 5 with `k'`. For the
//! second: two spans of at most `M` cells that have one in common begin less than `M` cells apart, so
//! `k = k'`.
//!
//! **Lemma 9 (repair).** *Let an exact box be in a child's decoded box `[a, b)` and in its parent's new
//! decoded box `[u', v')`. Then `[max(a, u'), min(b - 1, v' - 1)]`, encoded in the new context, has the
//! exact box inside its decoded one.* Both ends still enclose the exact box, which has integer ends;
//! Lemmas 3 and 4 do the rest.
//!
//! **Theorem A (enclosure).** *In every finished quantized tree each node's decoded box holds its exact
//! box, and each child's decoded box is in its parent's.* By induction from the root, whose decoded
//! box is its exact one rounded outward. Compressed from the root down, a child's exact box is in its
//! parent's exact box (Lemma 2), so in its parent's decoded box; encoding it gives the claim (3, 4), and
//! the reader finds the same box (5, 6). Compressed as it streams by, children are encoded in the
//! *estimated* context of their parent, to which the same applies. When the real context is known,
//! either a repair keeps the child's coordinates, and the reader finds the same box as before (8),
//! or it encodes the child's decoded box again, and the exact box stays inside (9); the child's own
//! context changes with it and its children are looked at in turn. Repairs go down until nothing
//! changes, so in the end each node is read in the context that it was last encoded in, or in one that
//! reads it alike. If every estimate is on a grid no coarser than the real one, Lemma 7 adds that the
//! tree is, bit for bit, the one that is compressed from the root down.
//!
//! A *refit* writes boxes by the same functions from exact boxes, so nothing changes. A tree of 64-byte
//! nodes has the exact boxes themselves.
//!
//! # Distances
//!
//! On an axis where the direction is `D != 0` let `d = |D|`, `2^(k-1) < d <= 2^k`. Distances `x` are in units
//! of 2⁻⁶, counted along the ray; a plane at `x` has the exact offset `x·m`, `m = 2^(k-1)/d`, and is
//! crossed at time `2^(31-k)·x·m`.
//!
//! **Lemma 10 (mantissa).** *`m' = ⌊2^(23+k)/d⌋` satisfies `m'd <= 2^(23+k) < (m' + 1)d` and
//! `2²³ <= m' < 2²⁴`; its upper bits are a lower bound by less than one of their units.*
//!
//! **Lemma 11 (offsets).** *[`offset_down`](crate::num::Reciprocal::offset_down) is at most, and
//! [`offset_up`](crate::num::Reciprocal::offset_up) at least, `x·m`; neither is farther from 0 than `x`.* A
//! product with `x >= 0` is rounded down with `m'` and up with `m' + 1`, one with `x < 0` the other way round.
//!
//! **Lemma 12 (steps).** *If `o <= x·m` and `C >= 0`, then `o + ⌊C m' / 2²⁴⌋ <= (x + C)·m`; if `o >= x·m`, then
//! `o - ⌊C m' / 2²⁴⌋ >= (x - C)·m`.* [`Slabs::step`](super::Slabs::step) counts both steps inward, so that `C`
//! is not negative; then rounding a step down widens the box on either side. Near offsets only grow
//! and far ones only fall, and each stays on its side of an exact one: between `-2³¹` and `2³¹`, so
//! that no addition wraps, however deep the tree.
//!
//! **Lemma 13 (times).** *The shift by `31 - k` is exact*, and its result fits 63 bits.
//!
//! **Lemma 14 (verdict).** *Let the ray be in the box at a time `t` with `t_min < t <= t_max`. If near times
//! `n_i` are at most, and far times `f_i` at least, the exact ones, then `max n_i <= min f_i`,
//! `min f_i > t_min` and `max n_i <= t_max`; and `max n_i <= t`.* Since `n_i <= t <= f_i` on each axis.
//! Where the ray does not move, [`Slabs::entry`](super::Slabs::entry) asks for `n_i <= 0 <= f_i` in its place:
//! true of a ray between exact planes, as `m = 1` there and nothing is rounded.
//!
//! **Theorem B (no box test loses a ray).** *If a ray hits a triangle at a time `t` of its interval, every
//! box test of a node above that triangle reports a hit, with an entry time of at most `t`.* By Lemmas 1
//! and 2 the ray is in the exact box at `t`; for quantized nodes by Theorem A in the decoded one. Exact
//! and decompressed planes are enclosed by Lemma 11, stepped ones by induction with Lemma 12; Lemma 13
//! carries that over to times and Lemma 14 to the verdict. For the traversal point see below.
//!
//! # Search
//!
//! **Lemma 15 (pruning).** *A subtree is left out only if its entry time exceeds the best hit's time.*
//! By Theorem B all its hits are then later than the best one. It is not left out if they are equal.
//!
//! **Lemma 16 (rounded times).** *For a representable `m`: `t <= m` if and only if `⌈t⌉ <= m`.* So the exact
//! test against a best time that was rounded up accepts exactly the triangles that are, rounded, no
//! later; of those at the same rounded time the lowest index is kept.
//!
//! **Theorem C (the search is right).** *A closest-hit search returns the hit with the least pair of
//! rounded time and index, and an any-hit search some hit if there is one.* The triangle with the
//! least pair, `(τ, i)`, is in some leaf. On the way there no test fails (B), and no subtree on it is left
//! out before the best time is below `τ` (15), which it never is. So its leaf is searched, the
//! test accepts it (16), and nothing replaces it. A tree that a builder wrote is no deeper than the stack
//! ([`MAX_DEPTH`](crate::emit::MAX_DEPTH)) and holds each node and entry once, so neither bound of the
//! search ends it early.
//!
//! # The traversal point
//!
//! [`TraversalPoint`](super::TraversalPoint) tests from a point on the ray at the node's time `T`. Let `x`
//! be its distance from the node's near corner in cells, `n` and `f` those of the child's planes.
//!
//! **Lemma 17 (from the point).** *With `q = ⌊4x⌋` and `m'` cut to its upper bits, of unit `2^-B`:
//! `max(4n - (q+1), 0)·m' <= max(4n - 4x, 0)·2^B m`, and if `f >= x`, then
//! `(4f - q)·(m'+1) >= (4f - 4x)·2^B m`. If `4f - q < 0`, then `f < x`.* As `q <= 4x < q + 1` and
//! `m' <= 2^B m < m' + 1`, and the factors are not negative.
//!
//! **Lemma 18 (the point is early).** *If every time of the interval at which the ray is in the node's exact
//! box is at least `T`, the same holds of a child that is hit and its `T`.* A time `t` at which it is in the
//! child's is one at which it is in the node's (2), so `t >= T`; from the point it takes `t - T`, which is at least the entry
//! time that was found (14, 17), which is at least its upper bits. For the root, `T` is the larger of the
//! entry time and the interval's start.
//!
//! Theorem B then holds by this method too: near planes that are ahead are enclosed, near planes that
//! are behind count as 0 and `t - T >= 0`, and the far planes are not behind, because the ray passes them
//! at `t` or later.
//!
//! **Lemma 19 (widths).** *The point is never more than `b·2^N` cells before its node, `b <= 17/24`.* The
//! point falls short of a child by `1/4 + 1/32` of a cell for the rounding of `q` and of products, and by
//! `2 · 2^(1-B)` of the distance, `(1 + b) 2^N` cells at most, for the cuts of `m'` and of the time. In the
//! child's cells that is up to `2^N` times more: `17/32 + b/4` times `2^N`, with `B = N + 4`. At the root
//! it falls short by no more than 4 grid units, which is less.
