"""Nodes grouped into aggregates, and those into larger ones, for the coarse levels of the solver. NumPy only."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

SIZE = 24
"""Nodes of an aggregate of the first level, about."""

BRANCHES = 5
"""Aggregates of a level that make one of the next, about."""

TOP = 12
"""Aggregates of the last level at most, as far as there are no more bodies than that: they are solved directly."""


@dataclass(frozen=True)
class Aggregates:
    """Aggregates of all levels, numbered through: first those of level 1, which are made of nodes.

    order (n,): the nodes, sorted such that every aggregate is a range of them, given by their old numbers.
    first (levels+1,): number of the first aggregate of each level.  Those of a level are made of contiguous
        nodes or aggregates of the level below.
    begin, end (aggregates,): which ones.
    parent (n + aggregates,): the aggregate that each node, and each aggregate, belongs to; -1 on the last level.
    """

    order: np.ndarray
    first: np.ndarray
    begin: np.ndarray
    end: np.ndarray
    parent: np.ndarray

    @property
    def levels(self) -> int:
        return len(self.first) - 1

    @property
    def count(self) -> int:
        return len(self.begin)


def _bisect(points: np.ndarray, nodes: np.ndarray, pieces: int) -> list[np.ndarray]:
    """Cut nodes into pieces of equal size, across the longest side, again and again."""
    if pieces <= 1:
        return [nodes]
    longest = np.argmax(np.ptp(points[nodes], axis=0))
    nodes = nodes[np.argsort(points[nodes, longest], kind="stable")]
    cut = len(nodes) * (pieces // 2) // pieces
    return _bisect(points, nodes[:cut], pieces // 2) + _bisect(points, nodes[cut:], pieces - pieces // 2)


def aggregate(points: np.ndarray, body_start: np.ndarray) -> Aggregates:
    """Aggregates of bodies with nodes body_start[b] .. body_start[b+1], at `points` (n,3); each within one body."""
    bodies = len(body_start) - 1
    top = max(1, TOP // bodies)
    largest = int(np.diff(body_start).max()) / SIZE
    levels = 1
    while largest / BRANCHES ** (levels - 1) > top + 0.5:
        levels += 1
    parts = [np.arange(body_start[b], body_start[b + 1]) for b in range(bodies)]
    counts: list[np.ndarray] = []  # per level, from the last one down: parts of each part above
    for level in range(levels, 0, -1):
        pieces = [max(1, round(len(part) / (SIZE * BRANCHES ** (level - 1)))) for part in parts]
        counts.append(np.array(pieces))
        parts = [piece for part, k in zip(parts, pieces, strict=True) for piece in _bisect(points, part, k)]
    order = np.concatenate(parts)

    n, sizes = len(points), [int(c.sum()) for c in reversed(counts)]
    first = np.r_[0, np.cumsum(sizes)]
    children = [np.array([len(part) for part in parts]), *reversed(counts[1:])]
    begin, end, parent = [], [], []
    for level, count in enumerate(children):
        below = 0 if level == 0 else first[level - 1]
        starts = np.r_[0, np.cumsum(count)] + below
        begin.append(starts[:-1])
        end.append(starts[1:])
        parent.append(np.repeat(np.arange(sizes[level]) + first[level], count))
    parent.append(np.full(sizes[-1], -1))
    assert sum(len(p) for p in parent) == n + first[-1]
    narrow = [np.concatenate(a).astype(np.int32) for a in (begin, end, parent)]
    return Aggregates(order, first.astype(np.int32), *narrow)
