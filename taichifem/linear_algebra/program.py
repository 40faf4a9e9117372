"""A round of conjugate gradients as a list of operations: with a cycle over the levels of the preconditioner.

As the cycle is data, not code, any number of levels and any cycle runs with the same compiled kernel.
"""

from __future__ import annotations

import numpy as np

from taichifem.linear_algebra.aggregates import Aggregates
from taichifem.world import CHUNKS, DENSE

ADVANCE, LEAVE, RESTRICT, CORRECT, SMOOTH, LAST, PLAIN, DIRECT, PRODUCT = range(9)
"""Kinds of operations; see `steps` and `multilevel`."""

NODES = 64
"""Nodes that make a piece of work worth sharing out."""


def pieces_of(items: int, size: int = NODES) -> int:
    """Into how many pieces of about `size` so many items are cut."""
    return min(CHUNKS, max(1, items // size))


def write_program(n: int, aggregates: Aggregates, *, solver: str) -> np.ndarray:
    """The operations (k,3) of a round for n nodes: kind, level, pieces.  solver: "multilevel" or "block-jacobi"."""
    fine = pieces_of(n)
    counts = [n, *np.diff(aggregates.first).tolist()]
    last = aggregates.levels
    whole = 6 * counts[last] <= DENSE

    def visit(level: int) -> list[tuple[int, int, int]]:
        """Improve the solution of a level, whose first smoothing is done, by way of those above."""
        if level == last:
            return [(LAST, last, 1)]
        # Twice, where what is above is not solved exactly: one visit leaves too much of long waves.
        visits = 1 if level == 0 or (level + 1 == last and whole) else 2
        items = fine if level == 0 else pieces_of(counts[level], NODES // 8)
        leave, up = (LEAVE, level, items), pieces_of(counts[level + 1], NODES // 16)
        listing = []
        for _ in range(visits):
            listing += [leave, (RESTRICT, level + 1, up), *visit(level + 1), (CORRECT, level, items)]
        return [*listing, leave, (SMOOTH, level, items)]

    cycle = visit(0) if solver == "multilevel" else [(PLAIN, 0, fine)]
    rounds = [(ADVANCE, 0, fine), *cycle, (DIRECT, 0, fine), (PRODUCT, 0, fine)]
    return np.array(rounds, dtype=np.int32)
