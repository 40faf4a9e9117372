"""What the solver has to know of a mesh: which blocks its matrix has, and how it is solved."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.linear_algebra.galerkin import Galerkin
from taichifem.linear_algebra.program import Program, write_program
from taichifem.structure.aggregates import Aggregates
from taichifem.structure.elimination import Elimination, plan_elimination
from taichifem.structure.levels import Levels, stack_levels
from taichifem.structure.pattern import BlockPattern, block_pattern


@dataclass(frozen=True)
class Plan:
    """The blocks of the nodes and of all levels; how one of these is solved directly; the operations of a solve; what
    makes the coarse matrices."""

    pattern: BlockPattern
    levels: Levels
    elimination: Elimination
    program: Program
    galerkin: Galerkin | None


def make_plan(cells: np.ndarray, n_nodes: int, aggregates: Aggregates, *, solver: str) -> Plan:
    """Plan for cells (m,d+1) of a mesh, each of whose nodes some cell uses.

    solver: "multilevel" or "block-jacobi", which has no use for the levels but stores them as well.
    """
    pattern = block_pattern(cells, n_nodes)
    levels = stack_levels(pattern, aggregates)
    elimination = plan_elimination(pattern, levels, aggregates)
    program = write_program(pattern, aggregates, elimination, solver=solver)
    galerkin = Galerkin(aggregates, levels, elimination.level) if solver == "multilevel" else None
    return Plan(pattern, levels, elimination, program, galerkin)
