"""Fracture: where elements are torn beyond their toughness, a plane through a vertex splits it (slides 35 to 43).

The plane lies across the direction of the largest principal stress. The vertex is one where a crack ends, if the
element has one, so that cracks run on instead of crumbling; else a random one.
"""

from dataclasses import dataclass

import numpy as np

from taichifem.formulas.eigen import symmetric_eigen
from taichifem.mesh.splitting import Splitting
from taichifem.runtime import ti


@ti.kernel
def find_tension(w: ti.template(), n_elements: ti.i32):
    """Largest principal stress [Pa] to `w.energy`, from `w.stress`."""
    for e in range(n_elements):
        values, _Q = symmetric_eigen(w.stress[e])
        w.energy[e] = values.max()


@dataclass(frozen=True)
class Break:
    """What broke in a step. capped: more would have.

    split: the mesh after it.  tips (n,): at which of its vertices do cracks end?
    """

    split: Splitting
    tips: np.ndarray
    splits: int
    capped: bool


def propagate(
    cells: np.ndarray,
    x: np.ndarray,
    stress: np.ndarray,
    torn: np.ndarray,
    tips: np.ndarray,
    *,
    rng: np.random.Generator,
    most: int,
) -> Break | None:
    """Split vertices of the elements `torn`, in that order; None if no plane parts any of them from its neighbours.

    cells (m,d+1), positions x (n,3) [m], stress (m,3,3) [Pa].  tips (n,): where cracks end.  most: splits at most.
    An element around a vertex that was split waits for the next step: its stress is another one now.
    """
    split, capped, splits = Splitting(cells, len(x)), False, 0
    waits = np.zeros(len(cells), dtype=bool)
    ends = dict.fromkeys(np.flatnonzero(tips).tolist())
    for element in torn.tolist():
        if waits[element]:
            continue
        if splits == most:
            capped = True
            break
        _, axes = np.linalg.eigh(stress[element])
        corners = rng.permutation(split.cells[element]).tolist()
        for node in sorted(corners, key=lambda corner: corner not in ends):
            star = split.star(node)
            middle = x[cells[star]].mean(axis=1) - x[split.origin[node]]
            above = middle @ axes[:, 2] > 0
            if above.any() and not above.all():
                ends.pop(node, None)
                ends |= dict.fromkeys(split.cut(node, star[above]))
                waits[star] = True
                splits += 1
                break
    if not splits:
        return None
    found = np.zeros(len(split.origin), dtype=bool)
    found[list(ends)] = True
    return Break(split, found, splits, capped)
