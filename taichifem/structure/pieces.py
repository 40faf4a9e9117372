"""Which elements hang together, by whatever vertices they share."""

import numpy as np

from taichifem import runtime
from taichifem.runtime import ti

_list = ti.types.ndarray(ndim=1)


@ti.func
def root_of(above: ti.template(), row: ti.i32, node: ti.i32):
    """The root of a node's tree, in a row of trees; on the way, nodes are hung on those above their parents."""
    i = node
    while above[row, i] != i:
        above[row, i] = above[row, above[row, i]]
        i = above[row, i]
    return i


@ti.kernel
def _label(
    corners: ti.template(), cells: _list, above: ti.types.ndarray(ndim=2), of_node: _list, of_cell: _list, found: _list
):
    """above: every node its own at first.  of_node: -1 at first."""
    ti.loop_config(serialize=True)
    for _ in range(1):
        m, count = of_cell.shape[0], 0
        for e in range(m):
            first = root_of(above, 0, cells[corners * e])
            for a in range(1, corners):
                other = root_of(above, 0, cells[corners * e + a])
                if other < first:
                    above[0, first] = other
                    first = other
                else:
                    above[0, other] = first
        for e in range(m):
            root = root_of(above, 0, cells[corners * e])
            if of_node[root] < 0:
                of_node[root] = count
                count += 1
            of_cell[e] = of_node[root]
            for a in range(corners):
                of_node[cells[corners * e + a]] = of_cell[e]
        found[0] = count


def label_pieces(cells: np.ndarray, n_nodes: int) -> tuple[int, np.ndarray, np.ndarray]:
    """Number of pieces, and the piece of each element (m,) and of each node (n,), those of the first elements first.

    cells (m,d+1); each of the `n_nodes` nodes belongs to some element.
    """
    runtime.start()
    of = np.int32
    flat = np.ascontiguousarray(cells, dtype=of).ravel()
    of_node, of_cell, found = np.full(n_nodes, -1, dtype=of), np.empty(len(cells), dtype=of), np.zeros(1, dtype=of)
    _label(cells.shape[1], flat, np.arange(n_nodes, dtype=of)[None], of_node, of_cell, found)
    return int(found[0]), of_cell, of_node
