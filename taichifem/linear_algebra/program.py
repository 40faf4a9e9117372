"""A solve by conjugate gradients as a list of operations: rounds with a cycle over the levels of the preconditioner.

As the cycle is data, not code, any number of levels and any cycle runs with the same compiled kernel.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.structure.aggregates import Aggregates
from taichifem.structure.elimination import Elimination
from taichifem.structure.pattern import BlockPattern, pieces_of

ADVANCE, LEAVE, RESTRICT, CORRECT, SMOOTH, LAST, PLAIN, DIRECT, PRODUCT, PREPARE, BEGIN, LEAN, FACTOR = range(13)
"""Kinds of operations; see `steps`, `multilevel`, `coarse_springs` and `coarse_factor`."""

FEW = 150
"""Aggregates of a level that is worth a second visit above it."""

ROWS, PARENTS = 16, 8
"""Aggregates that make a piece of work worth sharing out: their rows, or the gathering from those below."""


@dataclass(frozen=True)
class Program:
    """All operations (k,3): kind, level, pieces.

    First those that make ready: the matrix's diagonal, the residual at the start, from `READY` on the levels; then
    from `cycle` on a round with levels, if there are any; from `plain` on a round without.
    """

    operations: np.ndarray
    cycle: int
    plain: int


READY = 2
"""Operations that make ready where there are no levels."""


def most_operations(levels: int) -> int:
    """How many operations a program has at most, with this many levels of aggregates."""
    most = 2
    for _ in range(levels):
        most = 2 * (3 + most) + 2
    return READY + levels + 1 + most + 3 + 4


def write_program(pattern: BlockPattern, aggregates: Aggregates, elimination: Elimination, *, solver: str) -> Program:
    """The operations of a solve: levels up to the one that is eliminated.

    solver: "multilevel" or "block-jacobi".
    """
    n, fine = pattern.n_nodes, pattern.pieces
    counts = [n, *np.diff(aggregates.first).tolist()]
    last, parts = elimination.level, len(elimination.part) - 1

    def visit(level: int) -> list[tuple[int, int, int]]:
        """Improve the solution of a level, whose first smoothing is done, by way of those above."""
        if level == last:
            return [(LAST, last, parts)]
        # Twice, where what is above is not solved exactly: one visit leaves too much of long waves. But a level of
        # few aggregates costs as much to wait for as a large one.
        visits = 1 if level == 0 or level + 1 == last or counts[level] < FEW else 2
        items = fine if level == 0 else pieces_of(counts[level], ROWS)
        leave, up = (LEAVE, level, items), pieces_of(counts[level + 1], PARENTS)
        listing = []
        for _ in range(visits):
            listing += [leave, (RESTRICT, level + 1, up), *visit(level + 1), (CORRECT, level, items)]
        return [*listing, leave, (SMOOTH, level, items)]

    first, ending = (ADVANCE, 0, fine), [(DIRECT, 0, fine), (PRODUCT, 0, fine)]
    ready, cycle = [(PREPARE, 0, fine), (BEGIN, 0, fine)], []
    if solver == "multilevel":
        ready += [(LEAN, level, pieces_of(counts[level], PARENTS)) for level in range(1, last + 1)]
        ready += [(FACTOR, last, parts)]
        cycle = [first, *visit(0), *ending]
    operations = np.array([*ready, *cycle, first, (PLAIN, 0, fine), *ending], dtype=np.int32)
    return Program(operations, len(ready), len(ready) + len(cycle))
