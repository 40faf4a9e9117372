"""Aggregates of a mesh that was split, from those of the whole one."""

import numpy as np

from taichifem import runtime
from taichifem.runtime import ti
from taichifem.structure.aggregates import BRANCHES, SIZE, TOP, Aggregates
from taichifem.structure.pieces import root_of

CRUMB = 3
"""Nodes below which a part does not need an aggregate of its own: the smoother does for them."""

MOST = 2
"""An aggregate of whole pieces ends with this many times the usual nodes."""

MOST_CUTS = 16
"""Into how many an aggregate whose nodes have many copies is cut at most."""

MORE_LEVELS = 2
"""Levels above those of the whole mesh, at most."""

_list, _lists = ti.types.ndarray(ndim=1), ti.types.ndarray(ndim=2)


def most_aggregates(nodes: int, pieces: int, levels: int) -> int:
    """How many aggregates `regroup` makes at most, of this many nodes and pieces, and levels of the whole mesh."""
    return sum(nodes // (CRUMB * BRANCHES**level) + pieces for level in range(levels + MORE_LEVELS))


@ti.kernel
def _join(corners: ti.template(), cells: _list, key: _lists, above: _lists):
    """Per row of keys, hang nodes of an element that have the same key on one another, the first one at the root.

    above: every node its own at first; in the end, the first node of its part.
    """
    ti.loop_config(block_dim=1)
    for row in range(key.shape[0]):
        for e in range(cells.shape[0] // corners):
            for a in range(1, corners):
                i = cells[corners * e + a]
                for b in range(a):
                    j = cells[corners * e + b]
                    if key[row, i] == key[row, j] and above[row, i] != above[row, j]:
                        first, other = root_of(above, row, i), root_of(above, row, j)
                        if first < other:
                            above[row, other] = first
                        else:
                            above[row, first] = other
        for i in range(key.shape[1]):
            above[row, i] = root_of(above, row, i)


@ti.kernel
def _group(part: _list, size: _list, whole: _list, body: _list, weight: _list, only: _list, most: ti.i32, group: _list):
    """Number items through: a new group where the part changes; but crumbs of the same `whole` keep together.

    size: nodes of the part.

    Items that are the `only` ones of their pieces share a group, until it has the weight `most`.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        count, heavy = -1, 0
        for k in range(part.shape[0]):
            new = True
            if k > 0:
                crumbs = whole[k] == whole[k - 1] and (heavy < CRUMB or size[k] < CRUMB)
                together = only[k] == 1 and only[k - 1] == 1 and body[k] == body[k - 1] and heavy + weight[k] <= most
                new = part[k] != part[k - 1] and not crumbs and not together
            if new:
                count += 1
                heavy = 0
            heavy += weight[k]
            group[k] = count


def _parts(whole: Aggregates, cells: np.ndarray, old: np.ndarray) -> np.ndarray:
    """First node of the part that each node (n,) belongs to: per level of the whole mesh, and last of its piece.

    A part is what of an aggregate hangs together. What has hardly more nodes than an aggregate is one part.
    """
    keys = [whole.parent[old]]
    for _ in range(1, whole.levels):
        keys.append(whole.parent[keys[-1] + len(whole.order)])
    # Where nodes have many copies, the smallest aggregates are cut as they lie: their nodes come along some axis.
    begin, end = whole.begin[keys[0]], whole.end[keys[0]]
    cuts = np.clip((np.bincount(keys[0])[keys[0]] + SIZE // 2) // SIZE, 1, MOST_CUTS)
    keys[0] = MOST_CUTS * keys[0] + cuts * (old - begin) // (end - begin)
    keys = np.array([*keys, np.zeros(len(old))], dtype=np.int32)
    parts = np.tile(np.arange(len(old), dtype=np.int32), (len(keys), 1))
    _join(cells.shape[1], np.ascontiguousarray(cells, dtype=np.int32).ravel(), keys, parts)
    for level in reversed(range(whole.levels)):
        above = parts[level + 1]
        small = np.bincount(above)[above] <= SIZE * BRANCHES**level
        parts[level, small] = above[small]
    return parts


def regroup(whole: Aggregates, cells: np.ndarray, old: np.ndarray, body: np.ndarray) -> tuple[Aggregates, np.ndarray]:
    """Aggregates of a mesh that was split: of nodes that hang together, and were in one aggregate.

    Gives also where in their order the pieces begin, and the last one ends (pieces+1,).

    cells (m,d+1): the elements.  old (n,): of which node of the whole mesh each is, or is a copy of, in ascending
    order.  body (n,): of each.
    As long as a piece has several aggregates, it shares none. Then what lies together is put together, also where
    nothing joins it: pieces that press upon one another move together. No aggregate has two bodies.
    """
    runtime.start()
    of, n = np.int32, len(old)
    parts = _parts(whole, cells, old)
    order = np.lexsort(parts)
    parts, body = [part[order] for part in parts], body[order].astype(of)
    bodies = 1 + np.count_nonzero(np.diff(body))
    weight, item = np.ones(n, dtype=of), np.arange(n)  # item: the first node of each
    first, begin, end, parent, total = [0], [], [], [], 0
    for level in range(whole.levels + MORE_LEVELS):
        part, above = (parts[min(k, whole.levels)][item] for k in (level, level + 1))
        most = MOST * SIZE * BRANCHES**level if level < whole.levels else 2 * n
        piece = parts[-1][item]
        only = np.bincount(piece)[piece] == 1 if level else np.zeros(n)
        group = np.empty(len(item), dtype=of)
        size = np.bincount(part, weight)[part].astype(of)
        _group(part, size, above, body[item], weight, only.astype(of), most, group)
        starts = np.flatnonzero(np.r_[True, group[1:] != group[:-1]])
        below = total - len(group) if level else 0
        begin.append(starts + below)
        end.append(np.r_[starts[1:], len(group)] + below)
        parent.append(group + total)
        weight, item = np.add.reduceat(weight, starts).astype(of), item[starts]
        total += len(starts)
        first.append(total)
        if len(starts) <= max(TOP, bodies):
            break
    parent.append(np.full(len(starts), -1))
    narrow = [np.concatenate(a).astype(of) for a in (begin, end, parent)]
    piece_start = np.flatnonzero(np.r_[True, np.diff(parts[-1]) != 0, True]).astype(of)
    return Aggregates(order, np.array(first, dtype=of), *narrow), piece_start
