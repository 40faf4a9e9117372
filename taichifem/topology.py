"""A layout whose mesh was split: the same bodies with more nodes. NumPy only."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from taichifem.layout import Group, Layout, LoadGroup, boundary_of
from taichifem.mesh.connectivity import pieces
from taichifem.structure.aggregates import aggregate


def split_layout(layout: Layout, cells: np.ndarray, origin: np.ndarray) -> Layout:
    """The layout of a scene whose mesh was split, from that of the whole one.

    cells (m,d+1): the elements in the scene's order, of nodes and copies of them.  origin (n,): of which node of the
    scene each is a copy; the first ones are the nodes themselves, copies come last.
    Pins and handles hold copies too; what pulls or presses is shared out anew, its sum stays.
    """
    number_of = np.argsort(layout.node_order)
    row_of = np.argsort(layout.cell_order)
    bodies = layout.node_bodies[number_of][origin]
    # To the solver each piece is a body: no rigid motion that it works with joins two of them.
    _, piece = pieces(cells, len(origin))
    by_piece = np.lexsort((piece, bodies))
    starts = np.searchsorted(bodies[by_piece], np.arange(len(layout.body_start)))
    ends = np.flatnonzero(np.diff(piece[by_piece])) + 1
    rest = layout.rest[number_of][origin]
    aggregates = aggregate(rest[by_piece], np.r_[0, ends, len(origin)])
    node_order = by_piece[aggregates.order]
    number = np.argsort(node_order).astype(np.int32)
    corners = number[cells]
    cell_order = np.argsort(corners.min(axis=1), kind="stable")
    corners, rows = corners[cell_order], row_of[cell_order]
    node_from = number_of[origin[node_order]]
    surface, owner, cracked = _surface(corners, cell_order, layout)
    return replace(
        layout,
        rest=layout.rest[node_from],
        velocities=layout.velocities[node_from],
        cells=corners,
        thickness=layout.thickness[rows],
        node_bodies=layout.node_bodies[node_from],
        cell_bodies=layout.cell_bodies[rows],
        cell_materials=layout.cell_materials[rows],
        regions=layout.regions[rows],
        surface=surface,
        surface_bodies=layout.cell_bodies[rows][owner],
        cracked=cracked,
        body_start=starts.astype(np.int32),
        aggregates=aggregates,
        node_order=node_order,
        cell_order=cell_order,
        pins=[_group(group, layout, node_from) for group in layout.pins],
        handles=[_group(group, layout, node_from) for group in layout.handles],
        loads=[_load(load, layout, number[cells], node_from) for load in layout.loads],
    )


def _surface(cells: np.ndarray, cell_order: np.ndarray, whole: Layout) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Triangles to draw (k,3), the element of each, and whether a crack opened it."""
    if cells.shape[1] == 3:
        in_scene = np.argsort(cell_order)
        return cells[in_scene], in_scene, np.zeros(len(cells), dtype=bool)
    now = boundary_of(cells, cell_order)
    return now.faces, now.owner, ~np.isin(now.keys, whole.boundary.keys)


def _group(group: Group, layout: Layout, node_from: np.ndarray) -> Group:
    nodes = _copies(group.nodes, layout, node_from)
    return replace(group, nodes=nodes, stiffness=group.stiffness * len(group.nodes) / len(nodes))


def _load(load: LoadGroup, layout: Layout, cells: np.ndarray, node_from: np.ndarray) -> LoadGroup:
    if load.where.ndim == 1:
        return replace(load, where=_copies(load.where, layout, node_from))
    # A face goes with the element that has it.
    boundary = layout.boundary
    element_of = {frozenset(face): e for face, e in zip(boundary.faces.tolist(), boundary.owner.tolist(), strict=True)}
    element = np.array([element_of[frozenset(face)] for face in load.where.tolist()])
    corner = (layout.cells[element][:, None, :] == load.where[:, :, None]).argmax(axis=2)
    return replace(load, where=np.take_along_axis(cells[layout.cell_order[element]], corner, axis=1))


def _copies(nodes: np.ndarray, layout: Layout, node_from: np.ndarray) -> np.ndarray:
    """Some nodes and all copies of them, by their new numbers."""
    chosen = np.zeros(len(layout.rest), dtype=bool)
    chosen[nodes] = True
    return np.flatnonzero(chosen[node_from])
