//! Lemmas 3 to 9 on all of small domains: every node, box and pair of coordinates of few bits.

use glam::IVec3;

use xylem_core::compress::{CellBox, Context, Placement};
use xylem_core::geom::Aabb;
use xylem_core::node::{Child, Coordinates, Quantization, QuantizedChild};

const CHILD: Child = Child::Leaf { first: 0, count: Child::TO_MARK };

fn both(bits: u8) -> [Quantization; 2] {
    [Quantization::RELATIVE, Quantization::MODULO].map(|q| Quantization { bits, ..q })
}

/// A node that spans `cells` cells of `2^scale` from cell `first` on, on every axis.
fn node(first: i32, cells: i32, scale: u8, bits: u8) -> Placement {
    let low = (first & ((1 << bits) - 1)) as u8;
    let context = Context { scale: [scale; 3], cells: [cells as u16; 3], low: [low; 3] };
    Placement { context, lower: IVec3::splat(first << scale) }
}

/// All nodes of a width: those whose first cell is within one period of the coordinates on either
/// side of zero, in scales up to `scales`.
fn nodes(bits: u8, scales: u8) -> impl Iterator<Item = Placement> {
    let most = 1 << bits;
    (0..=scales).flat_map(move |scale| {
        (-most..most)
            .flat_map(move |first| (1..=most).map(move |cells| node(first, cells, scale, bits)))
    })
}

fn along(low: i32, high: i32) -> Aabb {
    Aabb::new(IVec3::splat(low), IVec3::splat(high))
}

#[test]
fn lemmas_3_to_5_every_box_in_a_node_is_encoded_and_decoded_to_one_just_around_it() {
    for placement in nodes(4, 2) {
        let (decoded, scale) = (placement.decoded(), u32::from(placement.context.scale[0]));
        let (first, beyond) = (decoded.min.x, decoded.max.x);
        for low in first..beyond {
            for high in low..beyond {
                for quantization in both(4) {
                    let coded = placement.encode(&along(low, high), CHILD, &quantization);
                    let (coded, cells) = coded.expect("lemma 4: a box in the node is encoded");
                    assert!(coded.low[0] < 16 && coded.high[0] < 16, "lemma 4: in N bits");
                    let read = placement.context.decode(&coded, &quantization);
                    assert_eq!(read, Some(cells), "lemma 5");
                    let child = placement.child(&cells, &quantization).decoded();
                    let cell = 1 << scale;
                    assert!(child.min.x <= low && low - child.min.x < cell, "lemma 3");
                    assert!(child.max.x > high && child.max.x - high <= cell, "lemma 3");
                    assert!(decoded.contains(&child), "lemma 3");
                }
            }
        }
        // And none that sticks out.
        for outside in [along(first - 1, first), along(beyond - 1, beyond)] {
            for quantization in both(4) {
                assert_eq!(placement.encode(&outside, CHILD, &quantization), None);
            }
        }
    }
}

#[test]
fn lemma_5_every_pair_of_coordinates_names_one_box_in_the_node_or_none() {
    for bits in 4..=6 {
        let most = 1u16 << bits;
        let [relative, modulo] = both(bits);
        for low in 0..most {
            for cells in 1..=most {
                let context = Context { scale: [3; 3], cells: [cells; 3], low: [low as u8; 3] };
                for (a, b) in (0..most).flat_map(|a| (0..most).map(move |b| (a, b))) {
                    let child =
                        QuantizedChild { low: [a as u8; 3], high: [b as u8; 3], child: CHILD };
                    // The definitions, by trying each width.
                    let fits = |r: u16, w: &u16| r + w <= cells;
                    let from_low = |r: u16| (1..=most).filter(move |w| fits(r, w));
                    let expect = from_low(a).find(|w| a + w - 1 == b);
                    let read = context.decode(&child, &relative);
                    assert_eq!(
                        read.map(|cells| (cells.low[0], cells.width[0])),
                        expect.map(|w| (a as u8, w))
                    );
                    let r = (most + a - low) % most;
                    let mut named = from_low(r).filter(|w| (a + w) % most == b);
                    let expect = named.next();
                    assert_eq!(named.next(), None, "no two widths have the same coordinates");
                    let read = context.decode(&child, &modulo);
                    assert_eq!(
                        read.map(|cells| (cells.low[0], cells.width[0])),
                        expect.map(|w| (r as u8, w))
                    );
                }
            }
        }
    }
}

#[test]
fn lemma_6_every_child_has_its_box_on_the_finest_grid_that_holds_it() {
    for bits in Quantization::WIDTHS {
        let most = 1i32 << bits;
        let quantization = Quantization { bits, min_scale: 3, ..Quantization::MODULO };
        for first in 0..most {
            for scale in [3, 5, 15] {
                let parent = node(first, most, scale, bits);
                for low in 0..most {
                    // A width for every power of two and its neighbours, and the largest.
                    let widths = (0..=bits).flat_map(|k| [(1 << k) - 1, 1 << k, (1 << k) + 1]);
                    for width in widths.chain([most - low]).filter(|w| (1..=most - low).contains(w))
                    {
                        let cells = CellBox { low: [low as u8; 3], width: [width as u16; 3] };
                        let child = parent.child(&cells, &quantization);
                        let corner = |cell: i32| (first + cell) << scale;
                        assert_eq!(child.decoded(), along(corner(low), corner(low + width)));
                        let Context { scale: fine, cells: count, low } = child.context;
                        assert!(i32::from(count[0]) <= most && fine[0] >= 3);
                        assert!(fine[0] == 3 || i32::from(count[0]) * 2 > most, "the finest");
                        assert_eq!(i32::from(low[0]), (child.lower.x >> fine[0]) & (most - 1));
                        assert_eq!(child.context, parent.context.child(&cells, &quantization));
                    }
                }
            }
        }
    }
}

#[test]
fn lemma_7_floors_nest_and_so_do_inclusive_upper_bounds() {
    for x in -2048i32..2048 {
        for a in 0..=8 {
            for b in a..=12 {
                assert_eq!(x >> a << a >> b, x >> b);
                let inclusive = (((x >> a) + 1) << a) - 1;
                assert_eq!(inclusive >> b, x >> b);
            }
        }
    }
}

#[test]
fn lemma_8_coordinates_stay_right_in_another_context_as_long_as_a_repair_says_so() {
    const BITS: u8 = 4;
    let [relative, modulo] = both(BITS);
    let (mut kept, mut moved) = (0u64, 0u64);
    for old in nodes(BITS, 0) {
        let (first, cells) = (old.lower.x, i32::from(old.context.cells[0]));
        for shift in -16..=16 {
            for count in 1..=16 {
                let new = node(first + shift, count, 0, BITS);
                let (before, after) = (old.decoded(), new.decoded());
                let meet = before.min.x.max(after.min.x) < before.max.x.min(after.max.x);
                if !meet {
                    continue;
                }
                // Both hold the same exact box, so cells that agree modulo 2^N are the same.
                assert_eq!(old.context.low == new.context.low, old.lower == new.lower);
                for (low, width) in (0..cells).flat_map(|r| (1..=cells - r).map(move |w| (r, w))) {
                    let (p, q) = (first + low, first + low + width - 1);
                    let inside = after.contains(&along(p, q + 1));
                    for quantization in [&relative, &modulo] {
                        let still = quantization.coordinates == Coordinates::Modulo
                            || old.context.low == new.context.low;
                        if !(inside && still) {
                            moved += 1;
                            continue;
                        }
                        let coded = old.encode(&along(p, q), CHILD, quantization);
                        let (coded, cells) = coded.expect("the box is in the old node");
                        let read = new.context.decode(&coded, quantization);
                        let read = read.expect("it is in the new one");
                        let of =
                            |node: &Placement, cells| node.child(cells, quantization).decoded();
                        assert_eq!(of(&new, &read), of(&old, &cells));
                        kept += 1;
                    }
                }
            }
        }
    }
    assert!(kept > 1 << 20 && moved > 1 << 20, "{kept} {moved}");
}

#[test]
fn lemma_9_a_box_encoded_again_still_holds_the_exact_one() {
    // An exact box, a node that holds it on one grid, and another on a coarser or finer one.
    let (relative, mut repairs) = (&both(4)[0], 0u64);
    for (low, high) in (-24..24).flat_map(|low| (low..24).map(move |high| (low, high))) {
        let exact = along(low, high);
        for (a, b) in (0..=3u8).flat_map(|a| (0..=3u8).map(move |b| (a, b))) {
            let around = |scale: u8, margin: i32| {
                let (first, last) = ((low >> scale) - margin, (high >> scale) + margin);
                (last - first < 16).then(|| node(first, last - first + 1, scale, 4))
            };
            for (old, new) in [(0, 0), (0, 1), (1, 0), (2, 1)] {
                let (Some(old), Some(new)) = (around(a, old), around(b, new)) else { continue };
                let (coded, _) =
                    old.encode(&exact, CHILD, relative).expect("it is in the old node");
                let cells = old.context.decode(&coded, relative).expect("lemma 5");
                let decoded = old.child(&cells, relative).decoded();
                // As a repair does: the upper bound inside, and cut to the new node.
                let limit = new.decoded();
                let inclusive = Aabb::new(
                    decoded.min.max(limit.min),
                    (decoded.max - IVec3::ONE).min(limit.max - IVec3::ONE),
                );
                let (_, again) = new.encode(&inclusive, CHILD, relative).expect("lemma 4");
                let again = new.child(&again, relative).decoded();
                assert!(again.contains(&exact) && again.max.x > high && limit.contains(&again));
                if b >= a {
                    let (_, direct) = new.encode(&exact, CHILD, relative).expect("lemma 4");
                    assert_eq!(again, new.child(&direct, relative).decoded(), "lemma 7");
                }
                repairs += 1;
            }
        }
    }
    assert!(repairs > 10_000, "{repairs}");
}
