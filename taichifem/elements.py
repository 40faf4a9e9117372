"""Loops over linear and corotational elements: rotations, forces, stress, energy; and the sums at the nodes."""

from taichifem.formulas import hooke, rotation
from taichifem.runtime import ti

LAMBDA, MU, MASS_DAMPING, STIFFNESS_DAMPING, DENSITY, MODEL = range(6)
"""Columns of the material table."""

LINEAR, COROTATIONAL, FIRST_LAW = 0, 1, 2
"""What MODEL may be: the two with the fast road below, or from 2 on the isotropic laws of the scene."""


@ti.func
def edges(field: ti.template(), w: ti.template(), e: ti.i32):
    """Differences of a node field to the element's first node, as columns (3,3)."""
    cell = w.cell[e]
    first = field[cell[0]]
    return ti.Matrix.cols([field[cell[1]] - first, field[cell[2]] - first, field[cell[3]] - first])


@ti.func
def _symmetric(m):
    return 0.5 * (m + m.transpose())


@ti.func
def _plastic(w: ti.template(), e: ti.i32):
    """Plastic strain as a matrix."""
    p = w.plastic[e]
    return ti.Matrix([[p[0], p[3], p[5]], [p[3], p[1], p[4]], [p[5], p[4], p[2]]])


@ti.func
def _strain(F, R, w: ti.template(), e: ti.i32):
    """Elastic strain in the rotated frame: sym(R^T F) - I - eps_p."""
    strain = _symmetric(R.transpose() @ F) - _plastic(w, e)
    for k in ti.static(range(3)):
        strain[k, k] -= 1
    return strain


@ti.func
def rotation_of(w: ti.template(), e: ti.i32, F, most: ti.i32, keep: ti.i32):
    """Rotation of element e, found from its last one, which it replaces if `keep`; the identity if linear."""
    R = ti.Matrix.identity(w.real, 3)
    if w.table[w.material[e]][MODEL] > LINEAR:
        q = rotation.nearest_rotation(F, w.rotation[e], ti.cast(ti.static(_tolerance(w.precision)), w.real), most)
        if keep:
            w.rotation[e] = q
        R = rotation.rotation_of(q)
    return R


def _tolerance(precision: str) -> float:
    """Turn [rad] below which a rotation counts as found: Newton's next error is about its square."""
    return {"f32": 2e-4, "f64": 1e-8}[precision]


@ti.func
def gradient(w: ti.template(), e: ti.i32, a: ti.i32):
    """Shape gradient g_a of corner a (3,) [1/m]."""
    D = w.gradients[e]
    g = -ti.Vector([D[0, k] + D[1, k] + D[2, k] for k in ti.static(range(3))])
    for b in ti.static(range(3)):
        if a == b + 1:
            g = ti.Vector([D[b, k] for k in ti.static(range(3))])
    return g


@ti.func
def with_first(rows):
    """The rows 1..3 of a quantity of the corners, and before them row 0: minus their sum (4,3)."""
    return ti.Matrix.rows(
        [
            ti.Vector([-(rows[0, k] + rows[1, k] + rows[2, k]) for k in ti.static(range(3))]),
            ti.Vector([rows[0, k] for k in ti.static(range(3))]),
            ti.Vector([rows[1, k] for k in ti.static(range(3))]),
            ti.Vector([rows[2, k] for k in ti.static(range(3))]),
        ]
    )


@ti.kernel
def deform(
    w: ti.template(),
    n_elements: ti.i32,
    stiffness_factor: ti.f64,
    damping_factor: ti.f64,
    rate_factor: ti.f64,
    rate_damping: ti.f64,
    most: ti.i32,
    keep: ti.i32,
):
    """Rotations, forces at the corners and what the matrix needs, from positions `w.x` and velocities `w.v`.

    Corner forces are -V R (sigma + sigma_rate) g_a, where the rate stress is that of the strain rate times
    (rate_factor + rate_damping beta): the part of dt K v that linearisation brings, and the damping.
    `w.moduli` becomes V (stiffness_factor + damping_factor beta) (lambda, mu), with beta the material's stiffness
    damping.  most: iterations for a rotation.  keep: the rotations found start the next search; 0 leaves no trace.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[MODEL] >= FIRST_LAW:
            continue
        gradients = w.gradients[e]
        F = edges(w.x, w, e) @ gradients
        R = rotation_of(w, e, F, most, keep)
        rate = _symmetric(R.transpose() @ (edges(w.v, w, e) @ gradients))
        damping = row[STIFFNESS_DAMPING]
        strain = _strain(F, R, w, e) + (ti.cast(rate_factor, w.real) + ti.cast(rate_damping, w.real) * damping) * rate
        stress = R @ hooke.stress(strain, row[LAMBDA], row[MU])
        volume = w.volume[e]
        w.h[e] = with_first(gradients @ R.transpose())
        w.corner_force[e] = with_first(-volume * (gradients @ stress.transpose()))
        factor = ti.cast(stiffness_factor, w.real) + ti.cast(damping_factor, w.real) * damping
        w.moduli[e] = volume * factor * ti.Vector([row[LAMBDA], row[MU]])


@ti.func
def gathered_force(w: ti.template(), i: ti.i32):
    """Sum of the corner forces at node i [N], in the order of the elements."""
    total = ti.Vector.zero(w.real, 3)
    for k in range(w.incident_start[i], w.incident_start[i + 1]):
        e, a = w.incident[k] >> 2, w.incident[k] & 3
        f = w.corner_force[e]
        total += ti.Vector([f[a, 0], f[a, 1], f[a, 2]])
    return total


@ti.kernel
def gather_forces(w: ti.template(), n: ti.i32):
    """Elastic forces `w.force` [N] at the nodes."""
    for i in range(n):
        w.force[i] = gathered_force(w, i)


@ti.kernel
def measure(w: ti.template(), n_elements: ti.i32, most: ti.i32):
    """Cauchy stress `w.stress` [Pa] and elastic energy `w.energy` [J] of every element at `w.x`.

    Corotational: P F^T / det F; where an element is flat or inside out that has no meaning, and the
    rotated stress R sigma R^T stands in, which is the same for small strain. Linear: sigma itself.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[MODEL] >= FIRST_LAW:
            continue
        F = edges(w.x, w, e) @ w.gradients[e]
        R = rotation_of(w, e, F, most, 0)
        strain = _strain(F, R, w, e)
        sigma = hooke.stress(strain, row[LAMBDA], row[MU])
        cauchy = R @ sigma @ R.transpose()
        det = F.determinant()
        if row[MODEL] > LINEAR and det > 0:
            cauchy = R @ sigma @ F.transpose() / det
        w.stress[e] = cauchy
        w.energy[e] = w.volume[e] * hooke.energy_density(strain, row[LAMBDA], row[MU])


@ti.kernel
def gather_masses(w: ti.template(), n: ti.i32, n_bodies: ti.i32):
    """Lumped mass and mass-proportional damping of the nodes, and what sizes their contact springs.

    `w.contact_stiffness` [N/m] is the trace of the node's own stiffness block at rest, which no rotation changes,
    over 3; `w.body_mass` [kg] is the mass of its body.
    """
    for i in range(n):
        mass, drag, stiffness = ti.cast(0.0, w.real), ti.cast(0.0, w.real), ti.cast(0.0, w.real)
        for k in range(w.incident_start[i], w.incident_start[i + 1]):
            e, a = w.incident[k] >> 2, w.incident[k] & 3
            row = w.table[w.material[e]]
            g = gradient(w, e, a)
            share = row[DENSITY] * w.volume[e] / 4
            mass += share
            drag += share * row[MASS_DAMPING]
            stiffness += w.volume[e] * (row[LAMBDA] + 4 * row[MU]) * g.norm_sqr() / 3
        w.mass[i] = mass
        w.drag[i] = drag
        w.contact_stiffness[i] = stiffness
    for b in range(n_bodies):
        total = ti.cast(0.0, ti.f64)
        for i in range(w.body_start[b], w.body_start[b + 1]):
            total += ti.cast(w.mass[i], ti.f64)
        for i in range(w.body_start[b], w.body_start[b + 1]):
            w.body_mass[i] = ti.cast(total, w.real)
