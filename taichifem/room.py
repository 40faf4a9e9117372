"""How much room a scene needs in a world."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from taichifem.description import Scene
from taichifem.hands import ROOM
from taichifem.laws import Laws
from taichifem.layout import Layout
from taichifem.linear_algebra.plan import Plan
from taichifem.linear_algebra.program import most_operations
from taichifem.structure.elimination import most_changes
from taichifem.structure.regrouping import MORE_LEVELS, most_aggregates
from taichifem.world import Capacity


def room_for(scene: Scene, layout: Layout, laws: Laws, plan: Plan) -> Capacity:
    """Room for a scene; where it may break, until every element is on its own."""
    pattern, levels, program = plan.pattern, plan.levels, plan.program
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
        operations=len(program.operations),
        factor=most_changes(pattern.n_blocks),
        usual=len(layout.rest),
        dimension=layout.dimension,
        tangents=laws.stores_tangents,
        springs=laws.springs,
        plastic=laws.plastic,
    )
    if any(m.fracture for m in layout.materials):
        capacity = _broken(capacity, layout)
    return _meeting(capacity, layout) if scene.pieces_meet else capacity


def assert_room(capacity: Capacity, plan: Plan) -> None:
    """Raise MemoryError if what came of a mesh that was split is more than there was thought to be room for.

    Kernels do not look: what is written behind a field's end spoils another.
    """
    pattern, levels, program = plan.pattern, plan.levels, plan.program
    needed = {
        "blocks": pattern.n_blocks,
        "pairs": pattern.n_pairs,
        "aggregates": len(levels.own),
        "coarse_blocks": len(levels.column) - pattern.n_blocks,
        "coarse_pairs": len(levels.pair),
        "members": len(levels.member),
        "operations": len(program.operations),
        "factor": int(plan.elimination.start[-1]),
    }
    for name, count in needed.items():
        if count > getattr(capacity, name):
            raise MemoryError(f"the pieces have {count} {name} and there is room for {getattr(capacity, name)}")


def _meeting(apart: Capacity, layout: Layout) -> Capacity:
    """Springs between half as many pairs of nodes and faces as there are elements, each of which makes three pairs."""
    springs = max(64, len(layout.cells) // 2)
    coarse = apart.coarse_pairs + 3 * springs * (layout.aggregates.levels + MORE_LEVELS)
    return replace(
        apart,
        blocks=apart.blocks + 6 * springs,
        pairs=apart.pairs + 3 * springs,
        coarse_blocks=8 * coarse,
        coarse_pairs=coarse,
        members=apart.members + 3 * springs * (layout.aggregates.levels + MORE_LEVELS),
        operations=most_operations(layout.aggregates.levels + MORE_LEVELS),
        factor=most_changes(apart.blocks + 6 * springs),
        meetings=springs,
    )


def _broken(whole: Capacity, layout: Layout) -> Capacity:
    """Every element brings its own nodes, and a block for each two of its corners.

    Pairs of aggregates grow as the nodes do, and every aggregate has one with itself.
    """
    elements, corners = layout.cells.shape
    nodes, pairs = elements * corners, elements * corners * (corners + 1) // 2
    around = np.bincount(layout.cells.ravel(), minlength=len(layout.rest))
    levels = layout.aggregates.levels
    aggregates, grown = most_aggregates(nodes, elements, levels), 1 + nodes // len(layout.rest)
    coarse_pairs = grown * whole.coarse_pairs + aggregates
    return replace(
        whole,
        nodes=nodes,
        blocks=nodes * corners,
        pairs=pairs,
        held=1 + ROOM + sum(int(around[g.nodes].sum()) for g in layout.pins),
        pulled=1 + ROOM + sum(int(around[g.nodes].sum()) for g in layout.handles),
        aggregates=aggregates,
        coarse_blocks=8 * coarse_pairs,
        coarse_pairs=coarse_pairs,
        members=pairs + coarse_pairs,
        operations=most_operations(levels + MORE_LEVELS),
        factor=most_changes(nodes * corners),
    )
