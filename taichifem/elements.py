"""Loops over linear and corotational elements: rotations, forces, stress, energy; and the sums at the nodes.

The same code serves tetrahedra (d = 3) and triangles (d = 2: plane strain in the plane y = 0).
"""

from taichifem import plastic_strain
from taichifem.formulas import hooke, rotation
from taichifem.runtime import ti

LAMBDA, MU, MASS_DAMPING, STIFFNESS_DAMPING, DENSITY, MODEL, SPRING, PLASTICITY, LIMIT, SLOPE, RATE, PRESSED = range(12)
TOUGHNESS, CRITERION, SMOOTHING = range(12, 15)
"""Columns of the material table. SPRING: stiffness [N/m] given for the springs along edges, or 0. From PLASTICITY on:
the kind of law (`formulas.plasticity`) and its yield stress, hardening and viscosity, or for creep yield strain,
most plastic strain and rate; PRESSED: the limit of springs under pressure. CRITERION: see `processes.fracture`."""

LINEAR, COROTATIONAL, QUICK, SPRINGS, YIELDING_LINEAR, YIELDING, YIELDING_GREEN, FIRST_LAW = range(8)
"""What MODEL may be: up to QUICK (corotational by QR) they have the fast road below; SPRINGS are in
`spring_elements`; the plastic ones that Newton's method wants exact tangents of, and those that measure Green's strain
(St. Venant-Kirchhoff), in `yielding_elements`; from FIRST_LAW on come the isotropic laws of the scene."""

AXES = {2: (0, 2), 3: (0, 1, 2)}
"""Coordinates of the nodes that elements of dimension d see."""


@ti.func
def seen(v, w: ti.template()):
    """The coordinates (d,) of a node vector (3,) that the elements see."""
    return ti.Vector([v[k] for k in ti.static(AXES[w.d])])


@ti.func
def lifted(f, w: ti.template()):
    """The node vector (3,) of what an element says (d,): the inverse of `seen`, zero across the plane."""
    if ti.static(w.d == 3):
        return f
    else:
        return ti.Vector([f[0], 0.0 * f[0], f[1]])


@ti.func
def lifted_matrix(m, w: ti.template()):
    """The (3,3) matrix of an element's (d,d), zero across the plane."""
    if ti.static(w.d == 3):
        return m
    else:
        zero = 0.0 * m[0, 0]
        return ti.Matrix([[m[0, 0], zero, m[0, 1]], [zero, zero, zero], [m[1, 0], zero, m[1, 1]]])


@ti.func
def seen_matrix(m, w: ti.template()):
    """Of a (3,3) matrix, what an element sees (d,d)."""
    return ti.Matrix([[m[i, j] for j in ti.static(AXES[w.d])] for i in ti.static(AXES[w.d])])


@ti.func
def edges(field: ti.template(), w: ti.template(), e: ti.i32):
    """Differences of a node field to the element's first node, as columns (d,d)."""
    cell = w.cell[e]
    first = seen(field[cell[0]], w)
    return ti.Matrix.cols([seen(field[cell[k]], w) - first for k in ti.static(range(1, w.corners))])


@ti.func
def symmetric(m):
    return 0.5 * (m + m.transpose())


@ti.func
def plastic_law(row):
    """The last columns of a row of the material table."""
    return ti.Vector([row[PLASTICITY + k] for k in ti.static(range(4))])


@ti.func
def elastic_strain(F, R, w: ti.template(), e: ti.i32, row, dt, keep: ti.i32):
    """Elastic strain in the element's frame (3,3): sym(R^T F) - I - eps_p, after plastic flow over dt [s], if any.

    Of Green's strain, whose frame R is F itself, it is (F^T F - I) / 2 - eps_p.  keep: what has flowed stays.
    """
    small = symmetric(R.transpose() @ F)
    for k in ti.static(range(w.d)):
        small[k, k] -= 1
    strain = lifted_matrix(small, w)
    # Not one condition: where no field for it is there, the second must not be compiled.
    if ti.static(w.capacity.plastic):  # noqa: SIM102
        if row[PLASTICITY] > 0:
            if row[MODEL] == YIELDING_GREEN:
                strain *= 0.5
            strain -= plastic_strain.kept(w, e)
            if dt > 0:
                law = plastic_law(row)
                moved, growth = plastic_strain.flowed(w, e, strain, row[MU], law, ti.cast(dt, w.real))
                strain -= moved
                if keep and growth > 0:
                    plastic_strain.add(w, e, moved, growth)
    return strain


@ti.func
def frame_of(w: ti.template(), e: ti.i32, F, most: ti.i32, keep: ti.i32):
    """What takes the strain of element e to the axes of the world (d,d).

    Its rotation, found from the last one, which it replaces if `keep`; the identity if linear; F for Green's strain.
    """
    R = ti.Matrix.identity(w.real, w.d)
    model = w.table[w.material[e]][MODEL]
    if model == QUICK:
        R = rotation.orthonormal(F)
    elif model == YIELDING_GREEN:
        R = F
    elif model > LINEAR and model != YIELDING_LINEAR:
        if ti.static(w.d == 2):
            R = rotation.nearest_rotation_2d(F)
        else:
            q = rotation.nearest_rotation(F, w.rotation[e], ti.cast(ti.static(_tolerance(w.precision)), w.real), most)
            if keep:
                w.rotation[e] = q
            R = rotation.rotation_of(q)
    return R


def _tolerance(precision: str) -> float:
    """Error [rad] with which a rotation counts as found."""
    return {"f32": 1e-5, "f64": 1e-13}[precision]


@ti.func
def gradients_of(w: ti.template(), e: ti.i32):
    """The rows g_1..g_d [1/m] that take edges to F, or to F_e where plasticity is multiplicative."""
    D = w.gradients[e]
    if ti.static(w.capacity.plastic):  # noqa: SIM102
        if w.table[w.material[e]][MODEL] >= FIRST_LAW:
            D = D @ seen_matrix(w.plastic_inverse[e], w)
    return D


@ti.func
def gradient(D, w: ti.template(), a: ti.i32):
    """Of the rows D, that of corner a (d,) [1/m]: its shape gradient."""
    g = ti.Vector.zero(w.real, w.d)
    for b in ti.static(range(w.d)):
        row = ti.Vector([D[b, k] for k in ti.static(range(w.d))])
        if a == 0:
            g -= row
        elif a == b + 1:
            g = row
    return g


@ti.func
def with_first(rows):
    """The rows 1..d of a quantity of the corners, and before them row 0: minus their sum (d+1,d)."""
    n = ti.static(rows.n)
    first = ti.Vector([-rows[0, k] for k in ti.static(range(n))])
    for b in ti.static(range(1, n)):
        first -= ti.Vector([rows[b, k] for k in ti.static(range(n))])
    # Taichi looks at both sides of a choice, so the index has to be valid in the first row as well.
    return ti.Matrix(
        [
            [rows[(a - 1) % n, k] if ti.static(a > 0) else first[k] for k in ti.static(range(n))]
            for a in ti.static(range(n + 1))
        ]
    )


@ti.func
def hand_out(rows, corners: ti.template(), w: ti.template(), e: ti.i32):
    """Write the rows (d+1,d) of a quantity of the corners to a field that holds it corner by corner."""
    for a in ti.static(range(w.corners)):
        corners[e * w.corners + a] = ti.Vector([rows[a, k] for k in ti.static(range(w.d))])


@ti.kernel
def deform(
    w: ti.template(),
    n_elements: ti.i32,
    stiffness_factor: ti.f64,
    damping_factor: ti.f64,
    rate_factor: ti.f64,
    rate_damping: ti.f64,
    due: ti.f64,
    most: ti.i32,
    keep: ti.i32,
):
    """Rotations, forces at the corners and what the matrix needs, from positions `w.x` and velocities `w.v`.

    Corner forces are -V R (sigma + sigma_rate) g_a, where the rate stress is that of the strain rate times
    (rate_factor + rate_damping beta): the part of dt K v that linearisation brings, and the damping.
    `w.moduli` becomes V (stiffness_factor + damping_factor beta) (lambda, mu), with beta the material's stiffness
    damping.  due: time of plastic flow that the last step has left [s].  most: iterations for a rotation.
    keep: the rotations found start the next search, and what has flowed stays; 0 leaves no trace.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        if row[MODEL] > QUICK:
            continue
        gradients = w.gradients[e]
        F = edges(w.x, w, e) @ gradients
        R = frame_of(w, e, F, most, keep)
        damping = row[STIFFNESS_DAMPING]
        share = ti.cast(rate_factor, w.real) + ti.cast(rate_damping, w.real) * damping
        change = share * (edges(w.v, w, e) @ gradients)
        strain = ti.Matrix.zero(w.real, 3, 3)
        if ti.static(w.capacity.plastic):
            strain = elastic_strain(F, R, w, e, row, due, keep) + lifted_matrix(symmetric(R.transpose() @ change), w)
        else:
            strain = elastic_strain(F + change, R, w, e, row, due, keep)
        stress = R @ seen_matrix(hooke.stress(strain, row[LAMBDA], row[MU]), w)
        volume = w.volume[e]
        hand_out(with_first(gradients @ R.transpose()), w.h, w, e)
        hand_out(with_first(-volume * (gradients @ stress.transpose())), w.corner_force, w, e)
        factor = ti.cast(stiffness_factor, w.real) + ti.cast(damping_factor, w.real) * damping
        w.moduli[e] = volume * factor * ti.Vector([row[LAMBDA], row[MU]])


@ti.func
def gathered_force(w: ti.template(), i: ti.i32):
    """Sum of the corner forces at node i (3,) [N], in the order of the elements."""
    total = ti.Vector.zero(w.real, w.d)
    for k in range(w.incident_start[i], w.incident_start[i + 1]):
        e, a = w.incident[k] >> 2, w.incident[k] & 3
        total += w.corner_force[e * w.corners + a]
    return lifted(total, w)


@ti.kernel
def gather_forces(w: ti.template(), n: ti.i32):
    """Elastic forces `w.force` [N] at the nodes."""
    for i in range(n):
        w.force[i] = gathered_force(w, i)


@ti.kernel
def measure(w: ti.template(), n_elements: ti.i32, due: ti.f64, most: ti.i32):
    """Cauchy stress `w.stress` [Pa] and elastic energy `w.energy` [J] of every element at `w.x`.

    Corotational: P F^T / det F; where an element is flat or inside out that has no meaning, and the
    rotated stress R sigma R^T stands in, which is the same for small strain. Linear: sigma itself.
    In the plane, the stress across it is what holds that strain at zero.  due: as in `deform`.
    """
    for e in range(n_elements):
        row = w.table[w.material[e]]
        model = row[MODEL]
        if model == SPRINGS or model >= FIRST_LAW:
            continue
        F = edges(w.x, w, e) @ w.gradients[e]
        R = frame_of(w, e, F, most, 0)
        strain = elastic_strain(F, R, w, e, row, due, 0)
        whole = hooke.stress(strain, row[LAMBDA], row[MU])
        sigma, across = seen_matrix(whole, w), whole[1, 1]
        cauchy = R @ sigma @ R.transpose()
        det = F.determinant()
        if model > LINEAR and model != YIELDING_LINEAR and det > 0:
            cauchy = R @ sigma @ F.transpose() / det
            across /= det
        w.stress[e] = lifted_matrix(cauchy, w)
        if ti.static(w.d == 2):
            w.stress[e][1, 1] = across
        w.energy[e] = w.volume[e] * hooke.energy_density(strain, row[LAMBDA], row[MU])


@ti.kernel
def gather_masses(w: ti.template(), n: ti.i32, piece_start: ti.types.ndarray(dtype=ti.i32, ndim=1), inertia: ti.i32):
    """Lumped mass and mass-proportional damping of the nodes, and what sizes their contact springs.

    `w.contact_stiffness` [N/m] is the mean diagonal entry of the node's own stiffness block at rest, which no
    rotation changes; `w.piece_mass` [kg] is the mass of its piece, 0 without inertia.
    piece_start (pieces+1,): the first node of each piece, and the end of the last.
    """
    for i in range(n):
        mass, drag, stiffness = ti.cast(0.0, w.real), ti.cast(0.0, w.real), ti.cast(0.0, w.real)
        for k in range(w.incident_start[i], w.incident_start[i + 1]):
            e, a = w.incident[k] >> 2, w.incident[k] & 3
            row = w.table[w.material[e]]
            g = gradient(w.gradients[e], w, a)
            share = row[DENSITY] * w.volume[e] / w.corners
            mass += share
            drag += share * row[MASS_DAMPING]
            stiffness += w.volume[e] * (row[LAMBDA] + (w.d + 1) * row[MU]) * g.norm_sqr() / w.d
        w.mass[i] = mass
        w.drag[i] = drag
        w.contact_stiffness[i] = stiffness
    for p in range(piece_start.shape[0] - 1):
        total = ti.cast(0.0, ti.f64)
        for i in range(piece_start[p], piece_start[p + 1]):
            total += ti.cast(w.mass[i], ti.f64)
        for i in range(piece_start[p], piece_start[p + 1]):
            w.piece_mass[i] = ti.cast(total, w.real) if inertia else ti.cast(0.0, w.real)
