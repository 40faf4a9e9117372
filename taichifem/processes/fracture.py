"""Fracture: where a body is torn beyond its toughness (slides 35 to 43); `Splitting` then parts it there.

The criteria are those of `description.Fracture`. By principal stress, the plane lies across its direction, through
some vertex of the element. By the separation tensor, each vertex is judged by itself, and so is its plane.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from taichifem import elements, transfer
from taichifem.description import Fracture
from taichifem.formulas.eigen import diagonal, symmetric_eigen
from taichifem.runtime import ti
from taichifem.world import Counts, World

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


@ti.func
def _largest(values, Q):
    """The largest of the principal values, and its direction."""
    value, direction = values[0], ti.Vector([Q[k, 0] for k in ti.static(range(Q.n))])
    for j in ti.static(range(1, Q.n)):
        if values[j] > value:
            value, direction = values[j], ti.Vector([Q[k, j] for k in ti.static(range(Q.n))])
    return value, direction


@ti.kernel
def find_tension(w: ti.template(), n_elements: ti.i32):
    """Largest principal stress over toughness to `w.energy`, from `w.stress`; 0 where another criterion holds.

    Its direction goes to `w.corner_force`, that of the first corner. In the plane, what acts across it parts nothing,
    and does not count.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        w.energy[e] = 0.0
        if row[elements.CRITERION] == PRINCIPAL_STRESS:
            values, Q = symmetric_eigen(elements.seen_matrix(w.stress[e], w))
            stress, normal = _largest(values, Q)
            w.energy[e] = stress / row[elements.TOUGHNESS]
            w.corner_force[e * w.corners] = normal


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
            force, normal = _largest(values, Q)
            area = ti.cast(0.0, w.real)
            for k in range(w.incident_start[i], w.incident_start[i + 1]):
                e, a = w.incident[k] >> 2, w.incident[k] & 3
                area += 0.5 * ti.abs(normal.dot(w.h[e * w.corners + a]))
            across = elements.lifted(normal, w)
            stress = force / ti.max(area, 1e-30)
            w.parting[i] = ti.Vector([across[0], across[1], across[2], stress / toughness])


@ti.kernel
def _read_normals(w: ti.template(), torn: ti.types.ndarray(ndim=1), normal: ti.types.ndarray(ndim=2)):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for k in range(torn.shape[0]):
        across = elements.lifted(w.corner_force[torn[k] * w.corners], w)
        for a in ti.static(range(3)):
            normal[k, a] = across[a]


@ti.kernel
def _read_corners(w: ti.template(), nodes: ti.types.ndarray(ndim=1), corner: ti.types.ndarray(ndim=1)):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for k in range(nodes.shape[0]):
        corner[k] = w.incident[w.incident_start[nodes[k]]]


@dataclass(frozen=True)
class Torn:
    """What is torn beyond its toughness, by the world's numbers, the most torn first.

    element (k,), corner (k,): a vertex of an element, or -1 for whichever of them.  normal (k,3): of the plane that is
    to part what is around it.
    """

    element: np.ndarray
    corner: np.ndarray
    normal: np.ndarray


def find_torn(w: World, counts: Counts, criteria: Sequence[Fracture]) -> Torn:
    """Judge everything by the criteria of its material; `criteria` are those of the scene, `w.stress` is measured."""
    n, m = counts.nodes, counts.elements
    for done in range(max(criterion.smoothing for criterion in criteria)):
        average(w, n, m, done)
    used = {criterion.criterion for criterion in criteria}
    excess, element, corner, normals = [np.zeros(0)], [np.zeros(0, int)], [np.zeros(0, int)], [np.zeros((0, 3))]
    if "principal-stress" in used:
        find_tension(w, m)
        tension = transfer.read(w, w.energy, m)
        torn = np.flatnonzero(tension > 1).astype(np.int32)
        normal = np.empty((len(torn), 3), dtype=transfer.dtype_of(w))
        if len(torn):
            _read_normals(w, torn, normal)
        excess.append(tension[torn])
        element.append(torn)
        corner.append(np.full(len(torn), -1))
        normals.append(normal)
    if "separation-tensor" in used:
        find_separation(w, n, m)
        parting = transfer.read(w, w.parting, n)
        torn = np.flatnonzero(parting[:, 3] > 1).astype(np.int32)
        first = np.empty(len(torn), dtype=np.int32)
        if len(torn):
            _read_corners(w, torn, first)
        excess.append(parting[torn, 3])
        element.append(first >> 2)
        corner.append(first & 3)
        normals.append(parting[torn, :3])
    order = np.argsort(-np.concatenate(excess), kind="stable")
    return Torn(*(np.concatenate(a)[order] for a in (element, corner, normals)))
