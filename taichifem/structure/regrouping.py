"""Aggregates of a mesh that was split: grown along its elements, so that each is of what moves as one.

Cracks run where they like: what lies together on both sides of one moves on its own. And what hangs on by a neck, or
a few nodes between two cracks, is only found by following the elements.
"""

import numpy as np

from taichifem.runtime import ti
from taichifem.structure.aggregates import BRANCHES, SIZE, TOP, Aggregates
from taichifem.structure.pattern import corners_at, order_of

CRUMB = SIZE // 4
"""Nodes below which what is left between aggregates goes to the neighbour that it has most links with."""

MOST = 2
"""An aggregate of whole pieces ends with this many times the usual nodes."""

MORE_LEVELS = 2
"""Levels above those of the whole mesh, at most."""

_list = ti.types.ndarray(ndim=1)


def most_aggregates(nodes: int, pieces: int, levels: int) -> int:
    """How many aggregates `regroup` makes at most, of this many nodes and pieces, and levels of the whole mesh."""
    return sum(nodes // (CRUMB * BRANCHES**level) + pieces for level in range(levels + MORE_LEVELS))


@ti.kernel
def _grow(
    corners: ti.template(),
    cells: _list,
    start: _list,
    incident: _list,
    item_of: _list,
    item_start: _list,
    node_of: _list,
    size: ti.i32,
    crumb: ti.i32,
    label: _list,
    links: _list,
    votes: _list,
    front: _list,
    members: _list,
    found: _list,
):
    """Put items together to labels, 0 and up: from the first one left, whatever has most links with those so far.

    item_of (n,): the item of each node.  item_start, node_of: the nodes of each item.  A link is a corner that an
    element shares with one of another item. size: nodes with which a label ends; those with less than `crumb` join a
    neighbour, if they have one.
    label: -1 at first.  links, votes: 0 at first.  front, members: scratch.  found (1,): how many labels there are.
    """
    ti.loop_config(serialize=True)
    for _ in range(1):
        count = 0
        for seed in range(label.shape[0]):
            if label[seed] >= 0:
                continue
            waiting, chosen, nodes = 1, 0, 0
            front[0] = seed
            while waiting > 0 and nodes < size:
                best = 0
                for k in range(1, waiting):
                    if links[front[k]] > links[front[best]]:
                        best = k
                item = front[best]
                waiting -= 1
                front[best] = front[waiting]
                label[item], links[item], members[chosen] = count, 0, item
                chosen += 1
                nodes += item_start[item + 1] - item_start[item]
                for c in range(item_start[item], item_start[item + 1]):
                    for k in range(start[node_of[c]], start[node_of[c] + 1]):
                        for a in range(corners):
                            other = item_of[cells[corners * (incident[k] >> 2) + a]]
                            if label[other] < 0:
                                if links[other] == 0:
                                    front[waiting] = other
                                    waiting += 1
                                links[other] = links[other] + 1
            for k in range(waiting):
                links[front[k]] = 0
            if nodes < crumb:
                asked, home = 0, -1
                for member in range(chosen):
                    item = members[member]
                    for c in range(item_start[item], item_start[item + 1]):
                        for k in range(start[node_of[c]], start[node_of[c] + 1]):
                            for a in range(corners):
                                other = label[item_of[cells[corners * (incident[k] >> 2) + a]]]
                                if other >= 0 and other != count:
                                    if votes[other] == 0:
                                        front[asked] = other
                                        asked += 1
                                    votes[other] = votes[other] + 1
                for k in range(asked):
                    if home < 0 or votes[front[k]] > votes[home]:
                        home = front[k]
                if home >= 0:
                    for member in range(chosen):
                        label[members[member]] = home
                    count -= 1
                for k in range(asked):
                    votes[front[k]] = 0
            count += 1
        found[0] = count


def _share(lone: np.ndarray, nodes: np.ndarray, body: np.ndarray, most: int) -> np.ndarray:
    """The group of each label (k,): those that are whole pieces share groups of some `most` nodes.

    lone (k,): is it a whole piece, or more?  nodes, body (k,): of each. Those in a group are of one body, and follow
    one another.
    """
    group = np.arange(len(lone))
    which = np.flatnonzero(lone)
    before = np.cumsum(nodes[which]) - nodes[which]
    shelf = before // most
    first = np.r_[True, (np.diff(shelf) != 0) | (np.diff(body[which]) != 0)][: len(which)]
    group[which] = which[np.maximum.accumulate(np.where(first, np.arange(len(which)), 0))]
    return np.unique(group, return_inverse=True)[1]


def regroup(cells: np.ndarray, body: np.ndarray, piece: np.ndarray, levels: int) -> tuple[Aggregates, np.ndarray]:
    """Aggregates of a mesh that was split.

    Gives also where in their order the pieces begin, and the last one ends (pieces+1,).

    cells (m,d+1): the elements.  body, piece (n,): of each node; nodes lie in space as their numbers do, about.
    levels: of the whole mesh.
    As long as a piece has several aggregates, it shares none. Then what lies together is put together, also where
    nothing joins it: pieces that press upon one another move together. No aggregate has two bodies.
    """
    of, n, corners = np.int32, len(body), cells.shape[1]
    flat = np.ascontiguousarray(cells, dtype=of).ravel()
    start, incident = corners_at(cells, n)
    item, count, labels = np.arange(n, dtype=of), n, []
    for level in range(levels + MORE_LEVELS):
        node_of = order_of(item).astype(of)
        nodes = np.bincount(item)
        item_start = np.r_[0, np.cumsum(nodes)].astype(of)
        label, found = np.full(count, -1, dtype=of), np.zeros(1, dtype=of)
        links, votes = np.zeros(count, dtype=of), np.zeros(count, dtype=of)
        front, members = np.empty(count, dtype=of), np.empty(count, dtype=of)
        parts = label, links, votes, front, members, found
        size, crumb = SIZE * BRANCHES**level, CRUMB * BRANCHES**level
        _grow(corners, flat, start, incident, item, item_start, node_of, size, crumb, *parts)
        of_node, k = label[item], int(found[0])
        if level:
            several = np.bincount(np.unique(piece * np.int64(k) + of_node) // k) > 1
            lone, belongs = np.ones(k, dtype=bool), np.empty(k, dtype=of)
            lone[of_node[several[piece]]] = False
            belongs[of_node] = body
            most = MOST * size if level < levels else 2 * n
            group = _share(lone, np.bincount(of_node), belongs, most)
            of_node, k = group[of_node].astype(of), int(group.max()) + 1
        if k < count:
            labels.append(of_node)
            item, count = of_node, k
        if count <= max(TOP, 1 + np.count_nonzero(np.diff(body))):
            break
    return _number(labels, piece, body)


def _number(labels: list[np.ndarray], piece: np.ndarray, body: np.ndarray) -> tuple[Aggregates, np.ndarray]:
    """Number the labels (n,) of all levels through, each a range of those below; and where pieces begin."""
    of, n = np.int32, len(body)
    above, place = body, np.arange(int(body.max()) + 1)
    for label in reversed(labels):
        # Those of one piece follow one another; of groups of pieces, any one counts.
        k = int(label.max()) + 1
        belongs, lead = np.empty(k, dtype=np.int64), np.empty(k, dtype=np.int64)
        belongs[label], lead[label] = place[above], piece
        place, above = np.empty(k, dtype=np.int64), label
        place[np.lexsort((lead, belongs))] = np.arange(k)
    order = order_of(place[above])
    first, begin, end, parent, below = [0], [], [], [], np.arange(n)
    for label in labels:
        starts = np.flatnonzero(np.r_[True, np.diff(label[order]) != 0])
        edges = np.r_[np.searchsorted(below, starts), len(below)]
        offset = first[-2] if len(first) > 1 else 0
        begin.append(edges[:-1] + offset)
        end.append(edges[1:] + offset)
        parent.append(np.repeat(np.arange(len(starts)), np.diff(edges)) + first[-1])
        first.append(first[-1] + len(starts))
        below = starts
    parent.append(np.full(len(below), -1))
    narrow = [np.concatenate(a).astype(of) for a in (begin, end, parent)]
    piece_start = np.flatnonzero(np.r_[True, np.diff(piece[order]) != 0, True]).astype(of)
    return Aggregates(order, np.array(first, dtype=of), *narrow), piece_start
