"""Fracture: where a body is torn beyond its toughness, a plane through a vertex splits it (slides 35 to 43).

The criteria are those of `description.Fracture`. By principal stress, the plane lies across its direction, and the
vertex is one of the element's where a crack ends, if there is one, so that cracks run on instead of crumbling; else a
random one. By the separation tensor, each vertex is judged by itself, and so is its plane.
"""

from dataclasses import dataclass

import numpy as np

from taichifem import elements
from taichifem.formulas.eigen import diagonal, symmetric_eigen
from taichifem.mesh.splitting import Splitting
from taichifem.runtime import ti

PRINCIPAL_STRESS, SEPARATION_TENSOR = range(2)
"""What CRITERION may be in the material table."""


@ti.kernel
def average(w: ti.template(), n: ti.i32, n_elements: ti.i32, done: ti.i32):
    """Replace `w.stress` by that of the neighbourhood, in elements whose SMOOTHING is more than `done`.

    It is the mean over the vertices of the mean, by volume, of all elements around them, whatever their material. An
    even stress stays as it is, and cracks are no neighbours.
    """
    for i in range(n):
        total, volume = ti.Matrix.zero(w.real, 3, 3), ti.cast(0.0, w.real)
        for k in range(w.incident_start[i], w.incident_start[i + 1]):
            e = w.incident[k] >> 2
            total += w.volume[e] * w.stress[e]
            volume += w.volume[e]
        w.around[i] = total / volume
    for e in range(n_elements):
        if w.table[w.material[e]][elements.SMOOTHING] > done:
            total = ti.Matrix.zero(w.real, 3, 3)
            for a in ti.static(range(w.corners)):
                total += w.around[w.cell[e][a]]
            w.stress[e] = total / w.corners


@ti.kernel
def find_tension(w: ti.template(), n_elements: ti.i32):
    """Largest principal stress over toughness to `w.energy`, from `w.stress`; 0 where another criterion holds.

    In the plane, what acts across it parts nothing, and does not count.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        w.energy[e] = 0.0
        if row[elements.CRITERION] == PRINCIPAL_STRESS:
            values, _Q = symmetric_eigen(elements.seen_matrix(w.stress[e], w))
            w.energy[e] = values.max() / row[elements.TOUGHNESS]


@ti.func
def _areas(w: ti.template(), e: ti.i32):
    """V g_a of every corner now (d+1,d) [m^2]: a stress times it is minus the force on the corner."""
    D = elements.edges(w.x, w, e)
    if ti.static(w.d == 3):
        a = ti.Vector([D[0, 0], D[1, 0], D[2, 0]])
        b = ti.Vector([D[0, 1], D[1, 1], D[2, 1]])
        c = ti.Vector([D[0, 2], D[1, 2], D[2, 2]])
        return elements.with_first(ti.Matrix.rows([b.cross(c), c.cross(a), a.cross(b)]) / 6)
    else:
        return elements.with_first(ti.Matrix([[D[1, 1], -D[0, 1]], [-D[1, 0], D[0, 0]]]) / 2)


@ti.func
def _doubled(f):
    """f f^T / |f|: along f, with eigenvalue |f|; 0 of 0."""
    return f.outer_product(f) / ti.max(f.norm(), 1e-30)


@ti.kernel
def find_separation(w: ti.template(), n: ti.i32, n_elements: ti.i32):
    """Normal of the plane across which each vertex comes apart, and the stress that parts it over the toughness.

    To `w.parting`, from `w.stress`; the stress is 0 where no element around has this criterion, and where some have,
    the least toughness counts.

    The separation tensor of O'Brien & Hodgins 1999 (eq. 9 to 17): the stress of each element, split by its principal
    values into what pulls and what presses, is handed out to the corners as forces. With m(f) = f f^T / |f|,
        S = 1/2 (-m(sum of pulls) + sum of m(pull) + m(sum of presses) - sum of m(press))
    is zero where forces have no partner that they pull against. Its largest eigenvalue is a force [N], which depends
    on the size of elements; here it is divided by the area that elements around put across its direction n,
    1/2 sum V |g . n|: under a pull in one direction, that is the stress exactly, on any mesh.
    """
    for e in range(n_elements):
        values, Q = symmetric_eigen(elements.seen_matrix(w.stress[e], w))
        areas = _areas(w, e)
        elements.hand_out(areas, w.h, w, e)
        elements.hand_out(-areas @ (Q @ diagonal(ti.max(values, 0.0)) @ Q.transpose()), w.corner_force, w, e)
    for i in range(n):
        tensor = ti.Matrix.zero(w.real, w.d, w.d)
        pulls, presses = ti.Vector.zero(w.real, w.d), ti.Vector.zero(w.real, w.d)
        toughness = ti.cast(0.0, w.real)
        for k in range(w.incident_start[i], w.incident_start[i + 1]):
            e, a = w.incident[k] >> 2, w.incident[k] & 3
            row, corner = w.table[w.material[e]], e * w.corners + a
            if row[elements.CRITERION] == SEPARATION_TENSOR:
                own = row[elements.TOUGHNESS]
                toughness = ti.min(own, toughness) if toughness > 0 else own
            pull = w.corner_force[corner]
            press = -elements.seen_matrix(w.stress[e], w) @ w.h[corner] - pull
            pulls += pull
            presses += press
            tensor += _doubled(pull) - _doubled(press)
        w.parting[i] = ti.Vector.zero(w.real, 4)
        if toughness > 0:
            values, Q = symmetric_eigen(0.5 * (tensor - _doubled(pulls) + _doubled(presses)))
            force, normal = values[0], ti.Vector([Q[k, 0] for k in ti.static(range(w.d))])
            for j in ti.static(range(1, w.d)):
                if values[j] > force:
                    force, normal = values[j], ti.Vector([Q[k, j] for k in ti.static(range(w.d))])
            area = ti.cast(0.0, w.real)
            for k in range(w.incident_start[i], w.incident_start[i + 1]):
                e, a = w.incident[k] >> 2, w.incident[k] & 3
                area += 0.5 * ti.abs(normal.dot(w.h[e * w.corners + a]))
            across = elements.lifted(normal, w)
            stress = force / ti.max(area, 1e-30)
            w.parting[i] = ti.Vector([across[0], across[1], across[2], stress / toughness])


@dataclass(frozen=True)
class Torn:
    """What is torn: elements or vertices `place` (k,), the normal (k,3) of the plane that is to part each, and how far
    each is beyond its toughness (k,)."""

    place: np.ndarray
    is_node: np.ndarray
    normal: np.ndarray
    excess: np.ndarray

    @classmethod
    def of(cls, tension: np.ndarray, stress: np.ndarray, parting: np.ndarray) -> "Torn":
        """From what the kernels found: tension (m,), stress (m,3,3) and parting (n,4); the most torn first."""
        of_cells, of_nodes = np.flatnonzero(tension > 1), np.flatnonzero(parting[:, 3] > 1)
        _, axes = np.linalg.eigh(stress[of_cells])
        excess = np.r_[tension[of_cells], parting[of_nodes, 3]]
        order = np.argsort(-excess, kind="stable")
        place, is_node = np.r_[of_cells, of_nodes], np.arange(len(excess)) >= len(of_cells)
        normal = np.concatenate([axes[:, :, 2], parting[of_nodes, :3]])
        return cls(place[order], is_node[order], normal[order], excess[order])


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
    cells: np.ndarray, x: np.ndarray, torn: Torn, tips: np.ndarray, *, rng: np.random.Generator, most: int
) -> Break | None:
    """Split vertices where it is torn, in that order; None if no plane parts anything from its neighbours.

    cells (m,d+1), positions x (n,3) [m].  tips (n,): where cracks end.  most: splits at most.
    What has an element around a vertex that was split waits for the next step: its stress is another one now.
    """
    split, capped, splits = Splitting(cells, len(x)), False, 0
    waits = np.zeros(len(cells), dtype=bool)
    ends = dict.fromkeys(np.flatnonzero(tips).tolist())
    for place, is_node, normal in zip(torn.place.tolist(), torn.is_node.tolist(), torn.normal, strict=True):
        if waits[split.star(place) if is_node else place].any():
            continue
        if splits == most:
            capped = True
            break
        corners = [place] if is_node else rng.permutation(split.cells[place]).tolist()
        for node in sorted(corners, key=lambda corner: corner not in ends):
            star = split.star(node)
            middle = x[cells[star]].mean(axis=1) - x[split.origin[node]]
            above = middle @ normal > 0
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
