"""A layout whose mesh was split: the same bodies with more nodes. NumPy only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from taichifem.layout import Group, Layout, LoadGroup, place_in
from taichifem.structure.pattern import order_of
from taichifem.structure.regrouping import regroup


def split_layout(layout: Layout, cells: np.ndarray, origin: np.ndarray, piece: np.ndarray) -> Layout:
    """The layout of a scene whose mesh was split, from that of the whole one.

    cells (m,d+1): the elements in the scene's order, of nodes and copies of them.  origin (n,): of which node of the
    scene each is a copy; the first ones are the nodes themselves, copies come last.  piece (n,): of each node.
    Pins and handles hold copies too; what pulls or presses is shared out anew, its sum stays. Elements stay where
    they were, and nodes come piece by piece, as their aggregates do.
    """
    old = layout.node_number[origin]
    sorted_by_old = order_of(old)
    placed, old = place_in(sorted_by_old)[cells[layout.cell_order]], old[sorted_by_old]
    aggregates, piece_start = regroup(placed, layout.node_bodies[old], piece[sorted_by_old], layout.aggregates.levels)
    node_order, node_from = sorted_by_old[aggregates.order], old[aggregates.order]
    bodies, corners = layout.node_bodies[node_from], place_in(aggregates.order)[placed]
    return replace(
        layout,
        rest=layout.rest[node_from],
        velocities=layout.velocities[node_from],
        cells=corners,
        node_bodies=bodies,
        body_start=np.searchsorted(bodies, np.arange(len(layout.body_start))).astype(np.int32),
        piece_start=piece_start,
        aggregates=aggregates,
        node_order=node_order,
        pins=[_group(group, layout, node_from) for group in layout.pins],
        handles=[_group(group, layout, node_from) for group in layout.handles],
        loads=[_load(layout, k, corners, node_from) for k in range(len(layout.loads))],
    )


def _group(group: Group, layout: Layout, node_from: np.ndarray) -> Group:
    nodes = _copies(group.nodes, layout, node_from)
    return replace(group, nodes=nodes, stiffness=group.stiffness * len(group.nodes) / len(nodes))


def _load(layout: Layout, k: int, corners: np.ndarray, node_from: np.ndarray) -> LoadGroup:
    load, on_face = layout.loads[k], layout.load_corners[k]
    if on_face is None:
        return replace(load, where=_copies(load.where, layout, node_from))
    # A face goes with the element that has it.
    element, corner = on_face
    return replace(load, where=np.take_along_axis(corners[element], corner, axis=1))


def _copies(nodes: np.ndarray, layout: Layout, node_from: np.ndarray) -> np.ndarray:
    """Some nodes and all copies of them, by their new numbers."""
    chosen = np.zeros(len(layout.rest), dtype=bool)
    chosen[nodes] = True
    return np.flatnonzero(chosen[node_from])
