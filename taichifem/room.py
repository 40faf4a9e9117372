"""How much room a scene needs in a world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from taichifem.description import Scene
from taichifem.hands import ROOM
from taichifem.laws import Laws
from taichifem.layout import Layout
from taichifem.structure.levels import Levels
from taichifem.structure.pattern import BlockPattern
from taichifem.world import Capacity


def room_for(
    scene: Scene, layout: Layout, laws: Laws, *, pattern: BlockPattern, levels: Levels, program: np.ndarray
) -> Capacity:
    """Room for a scene; where it may break, until every element is on its own."""
    capacity = Capacity(
        nodes=len(layout.rest),
        elements=len(layout.cells),
        blocks=pattern.n_blocks,
        pairs=pattern.n_pairs,
        materials=len(layout.materials),
        colliders=1 + len(scene.colliders),
        held=1 + ROOM + sum(len(g.nodes) for g in layout.pins),
        pulled=1 + ROOM + sum(len(g.nodes) for g in layout.handles),
        poses=1 + ROOM + len(layout.pins) + len(layout.handles),
        bodies=len(scene.bodies),
        aggregates=layout.aggregates.count,
        coarse_blocks=len(levels.column) - pattern.n_blocks,
        coarse_pairs=len(levels.pair),
        members=len(levels.member),
        operations=len(program),
        dimension=layout.dimension,
        tangents=laws.stores_tangents,
        springs=laws.springs,
        plastic=laws.plastic,
    )
    return _broken(capacity, layout) if any(m.fracture for m in layout.materials) else capacity


def _broken(whole: Capacity, layout: Layout) -> Capacity:
    """Every element brings its own nodes, and a block for each two of its corners.

    What is coarse grows as the nodes do, and every piece has an aggregate of its own on each level.
    """
    elements, corners = layout.cells.shape
    nodes, pairs = elements * corners, elements * corners * (corners + 1) // 2
    around = np.bincount(layout.cells.ravel(), minlength=len(layout.rest))
    grown, own = 1 + nodes // len(layout.rest), (2 + layout.aggregates.levels) * elements
    return replace(
        whole,
        nodes=nodes,
        blocks=nodes * corners,
        pairs=pairs,
        held=1 + ROOM + sum(int(around[g.nodes].sum()) for g in layout.pins),
        pulled=1 + ROOM + sum(int(around[g.nodes].sum()) for g in layout.handles),
        aggregates=grown * whole.aggregates + own,
        coarse_blocks=grown * whole.coarse_blocks + 4 * own,
        coarse_pairs=grown * whole.coarse_pairs + own,
        members=pairs + grown * whole.coarse_pairs + own,
        operations=2 * whole.operations,
    )
