"""Aggregates of a mesh that was split, from those of the whole one."""

import numpy as np

from taichifem import runtime
from taichifem.runtime import ti
from taichifem.structure.aggregates import BRANCHES, SIZE, Aggregates

LEAST = 3
"""An aggregate begins with a new one of the whole mesh only if the last has a third of the usual nodes: no crumbs."""

_list = ti.types.ndarray(ndim=1)


def most_aggregates(nodes: int, pieces: int, levels: int) -> int:
    """How many aggregates `regroup` makes at most, of this many nodes and pieces, and levels of the whole mesh."""
    return sum(LEAST * nodes // (SIZE * BRANCHES**level) + pieces for level in range(levels + 1))


@ti.kernel
def _group(piece: _list, key: _list, weight: _list, least: ti.i32, group: _list):
    """Number items through: a new group where the piece changes, or the key does and the group is heavy enough."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        count, heavy = -1, 0
        for k in range(piece.shape[0]):
            new = True
            if k > 0:
                new = piece[k] != piece[k - 1] or (key[k] != key[k - 1] and heavy >= least)
            if new:
                count += 1
                heavy = 0
            heavy += weight[k]
            group[k] = count


def regroup(whole: Aggregates, nodes: np.ndarray, piece: np.ndarray) -> Aggregates:
    """Aggregates of nodes that come piece by piece, and within a piece in the order of the whole mesh.

    nodes (n,): which of the whole mesh each is, or is a copy of.  piece (n,): no aggregate has two.
    The last level has one for each piece, or is that of the whole mesh, as far as pieces have it to themselves.
    """
    runtime.start()
    of = np.int32
    n, count, key = len(nodes), 1 + int(piece.max()), nodes
    weight, below = np.ones(n, dtype=of), piece.astype(of)
    first, begin, end, parent, total = [0], [], [], [], 0
    for level in range(whole.levels + 1):
        if level < whole.levels:
            key = whole.parent[key if level == 0 else key + len(whole.order)]
            least = SIZE * BRANCHES**level // LEAST
        else:
            least = 2 * n  # one for each piece
        group = np.empty(len(below), dtype=of)
        _group(below, key.astype(of), weight, least, group)
        starts = np.flatnonzero(np.r_[True, group[1:] != group[:-1]])
        ends = np.r_[starts[1:], len(group)]
        item = total - len(group) if level else 0
        begin.append(starts + item)
        end.append(ends + item)
        parent.append(group + total)
        weight = np.add.reduceat(weight, starts).astype(of)
        below, key = below[starts], key[starts]
        total += len(starts)
        first.append(total)
        if len(starts) == count:
            break
    parent.append(np.full(len(starts), -1))
    narrow = [np.concatenate(a).astype(of) for a in (begin, end, parent)]
    return Aggregates(np.arange(n), np.array(first, dtype=of), *narrow)
