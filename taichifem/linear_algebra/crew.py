"""Runs the operations of a solve (`program`).

On the CPU all threads run the whole program together, in one launch: waking threads for every loop would take longer
than the loops of small scenes do. An operation is cut into pieces; each thread takes the next one of its own share
that is left, which its caches know, then those of the others, and waits at the end until all are done. A thread that
wakes up late, or is sent to sleep by other programs, holds nobody up: the others do its pieces. Elsewhere every
operation is a launch of its own, with the same code.

(Waiting is done with atomic operations: a plain read might never look at memory again.)
"""

import numpy as np

from taichifem import runtime
from taichifem.linear_algebra import coarse_factor, coarse_inverses, coarse_springs, multilevel, steps
from taichifem.linear_algebra import program as p
from taichifem.linear_algebra.matrix import multiply
from taichifem.linear_algebra.steps import Limits
from taichifem.runtime import ti
from taichifem.world import SIDES, World


@ti.func
def _perform(w: ti.template(), n: ti.i32, kind: ti.i32, level: ti.i32, c: ti.i32, pieces: ti.i32, noise: ti.f64):
    """Piece c of an operation, and its share of the sums that some need."""
    first, items = 0, n
    if level > 0:
        first, items = w.level_first[level - 1], w.level_first[level] - w.level_first[level - 1]
    begin, end = steps.range_of(items, c, pieces)
    begin, end = first + begin, first + end
    sums = ti.Vector.zero(ti.f64, 3)
    if kind == p.ADVANCE:
        alpha = ti.cast(w.scalar[steps.ALPHA], w.real)
        for i in range(begin, end):
            sums += steps.advance(w, i, alpha)
    elif kind == p.LEAVE:
        rows, last = begin, end
        if level > 0:
            rows, last = n + 2 * begin, n + 2 * end
        multiply(w, w.z, w.left, rows, last)
        for i in range(rows, last):
            w.left[i] = w.residual[i] - w.left[i]
    elif kind == p.RESTRICT:
        for g in range(begin, end):
            multilevel.restrict(w, n, level, g)
    elif kind == p.CORRECT:
        for item in range(begin, end):
            multilevel.correct(w, n, level, item)
    elif kind == p.SMOOTH:
        for item in range(begin, end):
            sums[0] += multilevel.smooth(w, n, level, item)
    elif kind == p.LAST:
        coarse_factor.solve(w, n, c)
    elif kind == p.PLAIN:
        for i in range(begin, end):
            sums[0] += ti.cast(w.residual[i].dot(w.z[i]), ti.f64)
    elif kind == p.DIRECT:
        beta = ti.cast(w.scalar[steps.BETA], w.real)
        for i in range(begin, end):
            w.direction[i] = w.z[i] + beta * w.direction[i]
    elif kind == p.PRODUCT:
        multiply(w, w.direction, w.product, begin, end)
        for i in range(begin, end):
            q = w.free[i] * w.product[i]
            w.product[i] = q
            sums[0] += ti.cast(w.direction[i].dot(q), ti.f64)
    elif kind == p.PREPARE:
        for i in range(begin, end):
            sums += steps.prepare(w, i, noise)
    elif kind == p.BEGIN:
        multiply(w, w.dv, w.product, begin, end)
        for i in range(begin, end):
            steps.leave(w, i, w.product[i])
    elif kind == p.LEAN:
        for g in range(begin, end):
            coarse_springs.lean(w, n, level, g)
            coarse_inverses.invert_own(w, n, g)
    elif kind == p.FACTOR:
        coarse_factor.factorise(w, n, c)
    w.partial[c] = sums


@ti.func
def _conclude(
    w: ti.template(), kind: ti.i32, level: ti.i32, pieces: ti.i32, tolerance: ti.f64, most: ti.i32, weight: ti.f64
):
    """What follows from the sums once all pieces of an operation are done."""
    if kind == p.ADVANCE:
        steps.after_advance(w, pieces, tolerance, most)
    elif (kind == p.SMOOTH and level == 0) or kind == p.PLAIN:
        steps.after_cycle(w, pieces)
    elif kind == p.PRODUCT:
        steps.after_product(w, pieces)
    elif kind == p.PREPARE:
        steps.after_prepare(w, pieces, weight)


@ti.kernel
def _run_together(
    w: ti.template(),
    workers: ti.i32,
    n: ti.i32,
    first: ti.i32,
    opening: ti.i32,
    begin: ti.i32,
    operations: ti.i32,
    rounds: ti.i32,
    tolerance: ti.f64,
    most: ti.i32,
    noise: ti.f64,
    weight: ti.f64,
):
    ti.loop_config(serialize=True)
    for turn in range(opening + operations * rounds):
        for side in ti.static(range(SIDES)):
            w.claimed[turn, side] = 0
        w.finished[turn] = 0
        if turn < opening:
            w.scalar[steps.DONE] = 0.0
    ti.loop_config(block_dim=1)
    for me in range(workers):
        sides = ti.min(workers, SIDES)
        for turn in range(opening + operations * rounds):
            if w.scalar[steps.DONE] == 0:
                at = first + turn
                if turn >= opening:
                    at = begin + (turn - opening) % operations
                kind, level, pieces = w.operation[at][0], w.operation[at][1], w.operation[at][2]
                for k in range(sides):
                    side = (me + k) % sides
                    start, last = steps.range_of(pieces, side, sides)
                    c = start + ti.atomic_add(w.claimed[turn, side], 1)
                    while c < last:
                        _perform(w, n, kind, level, c, pieces, noise)
                        if ti.atomic_add(w.finished[turn], 1) == pieces - 1:
                            _conclude(w, kind, level, pieces, tolerance, most, weight)
                            ti.atomic_add(w.finished[turn], 1)
                        c = start + ti.atomic_add(w.claimed[turn, side], 1)
                while ti.atomic_or(w.finished[turn], 0) <= pieces:
                    pass


@ti.kernel
def _run_one(
    w: ti.template(),
    n: ti.i32,
    kind: ti.i32,
    level: ti.i32,
    pieces: ti.i32,
    tolerance: ti.f64,
    most: ti.i32,
    noise: ti.f64,
    weight: ti.f64,
    opens: ti.i32,
):
    ti.loop_config(serialize=True)
    for _ in range(opens):
        w.scalar[steps.DONE] = 0.0
    for c in range(pieces):
        if w.scalar[steps.DONE] == 0:
            _perform(w, n, kind, level, c, pieces, noise)
    ti.loop_config(serialize=True)
    for _ in range(1):
        if w.scalar[steps.DONE] == 0:
            _conclude(w, kind, level, pieces, tolerance, most, weight)


def run(
    w: World,
    n: int,
    operations: np.ndarray,
    limits: Limits,
    *,
    opening: tuple[int, int] = (0, 0),
    repeated: tuple[int, int] = (0, 0),
    rounds: int = 0,
) -> None:
    """Do a range of the operations (k,3) that the world has, and repeat another until the solve is done.

    rounds: times at most.
    """
    (first, end), (begin, last) = opening, repeated
    judged = limits.tolerance, limits.most, limits.noise, limits.weight
    if runtime.running_arch() == "cpu":
        _run_together(w, runtime.threads(), n, first, end - first, begin, last - begin, rounds, *judged)
        return
    listed = operations.tolist()
    for k in range(first, end):
        _run_one(w, n, *listed[k], *judged, 1)
    for _ in range(rounds):
        for k in range(begin, last):
            _run_one(w, n, *listed[k], *judged, 0)
