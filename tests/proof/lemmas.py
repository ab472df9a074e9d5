#!/usr/bin/env python3
"""Proves the lemmas of core-nostd/src/traverse/watertight.rs at any width, with the solver Z3.

Each lemma is stated as hypotheses and a claim over integers or reals without bounds; the solver looks
for a counterexample and must find none. Each `needs` drops or breaks one rule, and there the solver must
find a counterexample: it shows that the rule matters and that the hypotheses do not contradict each other.

Widths N run over 4..8 bits and scales over 0..20, one formula each. Needs the package z3-solver.
Exit code 1 if anything is not as it should be.
"""

import sys
import time

from z3 import And, If, Int, Ints, Not, Or, Reals, Solver, ToReal, sat, unsat

WIDTHS = range(4, 9)
SCALES = range(0, 21)
UNIT = 1 << 24  # of a mantissa

failures = []
log = {}


def check(lemma, hypotheses, claim, expect):
    solver = Solver()
    solver.set("timeout", 60_000)
    solver.add(*hypotheses)
    solver.add(Not(claim))
    began = time.time()
    found = solver.check()
    entry = log.setdefault(lemma, {"proved": 0, "needed": 0, "seconds": 0.0})
    entry["seconds"] += time.time() - began
    entry["proved" if expect == unsat else "needed"] += 1
    if found != expect:
        model = solver.model() if found == sat else ""
        failures.append(f"{lemma}: {found}, not {expect} {model}")


def proves(lemma, hypotheses, claim):
    """No counterexample exists."""
    check(lemma, hypotheses, claim, unsat)


def needs(lemma, hypotheses, claim):
    """A counterexample exists: this is a weaker lemma that does not hold."""
    check(lemma, hypotheses, claim, sat)


def top(a, b):
    return If(a > b, a, b)


def low(a, b):
    return If(a < b, a, b)


# Integer division by a positive number is the floor, as a shift is; `%` is in 0 .. divisor - 1.


def geometry():
    weights, vertices = Reals("a b"), Reals("v0 v1 v2")
    least, greatest = Reals("least greatest")
    (a, b), (v0, v1, v2) = weights, vertices
    box = [And(least <= v, v <= greatest) for v in vertices]
    point = (1 - a - b) * v0 + a * v1 + b * v2
    proves("lemma 1", box + [a >= 0, b >= 0, a + b <= 1], And(least <= point, point <= greatest))
    needs("lemma 1", box + [a >= 0, b >= 0], point <= greatest)
    other, wide = Reals("other wide")
    proves("lemma 2", [least <= v0], low(least, other) <= v0)
    proves("lemma 2", [v0 <= greatest], v0 <= top(greatest, wide))


def quantization():
    p, q, k, c, r, s = Ints("p q k c r s")
    for e in SCALES:
        cell = 1 << e
        outward = And((p / cell) * cell <= p, p - (p / cell) * cell < cell,
                      q < (q / cell + 1) * cell, (q / cell + 1) * cell <= q + cell)
        proves("lemma 3", [], outward)
        # Without the extra cell, an upper bound in the middle of one is not enclosed.
        if e > 0:
            needs("lemma 3", [], q <= (q / cell) * cell)
        for n in WIDTHS:
            most = 1 << n
            u = k * cell
            inside = [1 <= c, c <= most, u <= p, p <= q, q < u + c * cell]
            first, beyond = p / cell - k, q / cell + 1 - k
            proves("lemma 4", inside,
                   And(0 <= first, first < beyond, beyond <= c, beyond - 1 < most))
    for n in WIDTHS:
        most = 1 << n
        box = [0 <= r, r < s, s <= c, 1 <= c, c <= most]
        stored_low, stored_high, known = (k + r) % most, (k + s) % most, k % most
        read = (stored_low - known) % most
        width = (stored_high - stored_low - 1) % most + 1
        proves("lemma 5", box, And(read == r, width == s - r))
        # An upper bound that is read without the width first, as in P3 Fig. 4.
        upper = (stored_high - known) % most
        fixed = If(stored_low == stored_high, upper + most, upper)
        needs("lemma 5", box, fixed == s)
        # Boxes without a width would have the coordinates of full ones.
        needs("lemma 5", [0 <= r, r <= s, s <= c, 1 <= c, c <= most], width == s - r)
        for f in range(0, n + 1):
            fine = 1 << f
            finer = And((s - r) * fine <= most)
            e_fine = Int("E")  # the finer cell; the coarser one is `fine` of them
            coarse = fine * e_fine
            proves("lemma 6", box + [finer, e_fine >= 1],
                   And(((known + r) * fine) % most == ((k + r) * fine) % most,
                       (k + r) * coarse == ((k + r) * fine) * e_fine,
                       (k + s) * coarse == ((k + r) * fine + (s - r) * fine) * e_fine))
    x = Int("x")
    for a in SCALES:
        for b in range(a, 21):
            fine, coarse = 1 << a, 1 << b
            proves("lemma 7", [], And((x / fine) * fine / coarse == x / coarse,
                                      ((x / fine + 1) * fine - 1) / coarse == x / coarse))
    # An upper bound that is not brought inside gains a cell; a finer grid loses bits.
    needs("lemma 7", [], ((x / 2 + 1) * 2) / 4 == x / 4)
    needs("lemma 7", [], (x / 4) * 4 / 2 == x / 2)


def repairs():
    k, new, c, d, a, b, x = Ints("k new c d a b x")
    for n in WIDTHS:
        most = 1 << n
        spans = [1 <= c, c <= most, 1 <= d, d <= most]
        # A child at cells a .. b of the scene, written for the node at k and read for the one at `new`.
        held = [k <= a, a < b, b <= k + c, new <= a, b <= new + d]
        read = (a % most - new % most) % most
        width = (b % most - a % most - 1) % most + 1
        proves("lemma 8", spans + held, And(new + read == a, width == b - a))
        needs("lemma 8", spans + [k <= a, a < b, b <= k + c], new + read == a)
        meet = [k <= x, x < k + c, new <= x, x < new + d]
        proves("lemma 8", spans + meet + [k % most == new % most], k == new)
        needs("lemma 8", spans + [k % most == new % most], k == new)
    p, q, u, v = Ints("p q u v")
    exact = [a <= p, p <= q, q < b, u <= p, q < v]
    start, end = top(a, u), low(b - 1, v - 1)
    for e in SCALES:
        cell = 1 << e
        proves("lemma 9", exact, And(u <= start, start <= end, end < v, (start / cell) * cell <= p,
                                     q < (end / cell + 1) * cell))
    proves("lemma 9", exact, And(start <= p, q <= end))
    needs("lemma 9", [a <= p, p <= q, q < b], And(start <= p, q <= end))


def distances():
    m, d, f, x, o, c, s = Ints("m d F x o C s")
    # F = 2^(23+k); an exact offset is x * F / (UNIT * d).
    mantissa = [d >= 1, f >= 1, m == f / d]
    proves("lemma 10", mantissa, And(m * d <= f, f < (m + 1) * d))
    # Of an octave, f / 2 < 2^22 d ... f >= 2^23 d: the mantissa is normalised.
    octave = [d >= 1, m * d <= f, f < (m + 1) * d, (1 << 23) * d <= f, f < UNIT * d]
    proves("lemma 10", octave, And(m >= 1 << 23, m < UNIT))
    enclosed = [d >= 1, m >= 0, m < UNIT, m * d <= f, f < (m + 1) * d]
    down = lambda product: product / UNIT
    up = lambda product: (product + UNIT - 1) / UNIT
    for sign, factors in [(x >= 0, (m, m + 1)), (x < 0, (m + 1, m))]:
        proves("lemma 11", enclosed + [sign, o == down(x * factors[0])], o * UNIT * d <= x * f)
        proves("lemma 11", enclosed + [sign, o == up(x * factors[1])], o * UNIT * d >= x * f)
        proves("lemma 11", enclosed + [sign, o == down(x * factors[0])], Or(o >= x, o >= 0))
        proves("lemma 11", enclosed + [sign, o == up(x * factors[1])], Or(o <= x, o <= 0))
    needs("lemma 11", enclosed + [x == -3 * UNIT, o == down(x * m)], o * UNIT * d <= x * f)
    needs("lemma 11", enclosed + [x == 3 * UNIT, o == up(x * m)], o * UNIT * d >= x * f)
    step = enclosed + [c >= 0, s == down(c * m)]
    proves("lemma 12", step, And(s * UNIT * d <= c * f, s >= 0, s <= c))
    # What was shown of the step is all that adding it takes.
    added = [s * UNIT * d <= c * f]
    proves("lemma 12", added + [o * UNIT * d <= x * f], (o + s) * UNIT * d <= (x + c) * f)
    proves("lemma 12", added + [o * UNIT * d >= x * f], (o - s) * UNIT * d >= (x - c) * f)
    # The far plane from the near one, with the same rounding, would come in.
    needs("lemma 12", added + [o * UNIT * d >= x * f, d == 3, f == UNIT * 2],
          (o + s) * UNIT * d >= (x + c) * f)
    shift = 31
    proves("lemma 13", [o >= -(1 << 31), o <= 1 << 31],
           And(o * (1 << shift) >= -(1 << 62), o * (1 << shift) <= 1 << 62))


def verdicts():
    t, t_min, t_max = Reals("t t_min t_max")
    near, far = Reals("n0 n1 n2"), Reals("f0 f1 f2")  # of the test
    exact_near, exact_far = Reals("N0 N1 N2"), Reals("F0 F1 F2")
    enclosed = [And(near[i] <= exact_near[i], far[i] >= exact_far[i]) for i in range(3)]
    inside = [And(exact_near[i] <= t, t <= exact_far[i]) for i in range(3)]
    enter = top(near[0], top(near[1], near[2]))
    leave = low(far[0], low(far[1], far[2]))
    hit = And(enter <= leave, leave > t_min, enter <= t_max)
    interval = [t_min < t, t <= t_max]
    proves("lemma 14", enclosed + inside + interval, And(hit, enter <= t))
    needs("lemma 14", enclosed[1:] + inside + interval, hit)
    # A ray that does not move along axis 0 is between the planes there or it is in no box.
    between = And(near[0] <= 0, 0 <= far[0])
    still = [And(exact_near[0] <= 0, 0 <= exact_far[0])]
    enter, leave = top(near[1], near[2]), low(far[1], far[2])
    hit = And(between, enter <= leave, leave > t_min, enter <= t_max)
    proves("lemma 14", enclosed + still + inside[1:] + interval, And(hit, enter <= t))
    a, b, m = Ints("a b m")
    up = -((-a) / b)
    for divisor in [1, 2, 3, 64, 1000, 12345]:
        proves("lemma 16", [b == divisor], (a <= m * b) == (up <= m))
    needs("lemma 16", [b == 3], (a <= m * b) == (a / b <= m))
    best, entry, hit_time = Reals("best entry hit")
    proves("lemma 15", [entry <= hit_time, entry > best], hit_time > best)


def traversal_point():
    x, n, f, m = Reals("x n f m")  # the point, the planes, the mantissa in units of its last bit
    q, cut = Ints("q cut")
    rounded = [ToReal(q) <= 4 * x, 4 * x < ToReal(q) + 1, ToReal(cut) <= m, m < ToReal(cut) + 1, cut >= 0]
    ahead = lambda d: top(d, 0)
    to_near = ahead(4 * n - (ToReal(q) + 1))
    proves("lemma 17", rounded, And(to_near >= 0, to_near <= ahead(4 * n - 4 * x)))
    a, b = Reals("a b")
    proves("lemma 17", [0 <= a, a <= b, 0 <= ToReal(cut), ToReal(cut) <= m],
           a * ToReal(cut) <= b * m)
    to_far = 4 * f - ToReal(q)
    proves("lemma 17", rounded + [f >= x], to_far >= 4 * f - 4 * x)
    proves("lemma 17", [0 <= b, b <= a, 0 <= m, m < ToReal(cut) + 1], a * (ToReal(cut) + 1) >= b * m)
    proves("lemma 17", rounded + [to_far < 0], f < x)
    needs("lemma 17", rounded, ahead(4 * n - ToReal(q)) <= ahead(4 * n - 4 * x))
    t, time_, after, kept = Reals("t T after kept")
    proves("lemma 18", [t - time_ >= after, kept <= after, kept >= 0], t >= time_ + kept)
    number = Int("number")
    for spare in range(0, 40):
        part = 1 << spare
        proves("lemma 18", [number >= 0], And((number / part) * part <= number, (number / part) >= 0))
    before, shortfall, distance, scale = Reals("before shortfall distance scale")
    for bits in WIDTHS:
        most, unit = 1 << bits, 2.0 ** (1 - (bits + 4))
        # In cells of the node; the child's are at most `most` times finer.
        recurrence = [before <= 17.0 / 24 * most, before >= 0, distance >= 0,
                      distance <= most + before, scale >= 1, scale <= most,
                      shortfall <= 0.25 + 1.0 / 32 + distance * 2 * unit, shortfall >= 0]
        proves("lemma 19", recurrence, shortfall * scale <= 17.0 / 24 * most)
        # Two bits less of the mantissa and there is no such bound.
        worse = recurrence[:-2] + [shortfall == 0.25 + 1.0 / 32 + distance * 8 * unit]
        needs("lemma 19", worse, shortfall * scale <= 17.0 / 24 * most)
        proves("lemma 19", [before <= 17.0 / 24 * most, distance <= most + before],
               4 * distance < 2 ** (bits + 3))


def main():
    began = time.time()
    for part in [geometry, quantization, repairs, distances, verdicts, traversal_point]:
        part()
    for lemma, entry in sorted(log.items(), key=lambda item: int(item[0].split()[1])):
        print(f"{lemma}: {entry['proved']} formulas proved, {entry['needed']} weaker ones refuted, "
              f"{entry['seconds']:.1f} s")
    for failure in failures:
        print(f"FAILED {failure}", file=sys.stderr)
    print(f"proof: {sum(entry['proved'] for entry in log.values())} formulas proved, "
          f"{len(failures)} failures, {time.time() - began:.1f} s")
    return 1 if failures else 0


if __name__ == "__main__":
    sys.exit(main())
