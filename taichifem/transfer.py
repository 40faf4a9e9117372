"""Between NumPy and the fields. Few kernels with many arguments: each costs a compilation at start-up.

What is written again whenever something splits or meets is copied by one thread: that takes less than waking others.
"""

import numpy as np

from taichifem.layout import Layout
from taichifem.runtime import PRECISIONS, ti
from taichifem.world import MEMORY, World

_array = ti.types.ndarray


@ti.kernel
def _fill_nodes(w: ti.template(), v: _array()):
    for i in range(v.shape[0]):
        for k in ti.static(range(3)):
            w.v[i][k] = v[i, k]
            w.v0[i][k] = v[i, k]
        w.x[i] = w.rest[i]
        w.dv[i] = ti.Vector.zero(w.real, 3)
        w.past[i] = ti.Matrix.zero(w.real, 3, MEMORY + 1)
        w.outside[i] = ti.Vector.zero(w.real, 3)
        for c in range(w.touching.shape[0]):
            w.touching[c, i] = 0
            w.slip[c, i] = ti.Vector.zero(w.real, 3)
            w.pressed[c, i] = 0.0


@ti.kernel
def _fill_elements(w: ti.template(), indices: _array(), gradients: _array(), volume: _array()):
    for e in range(indices.shape[0]):
        w.material[e] = indices[e, 0]
        w.body[e] = indices[e, 1]
        for a in ti.static(range(w.d)):
            for k in ti.static(range(w.d)):
                w.gradients[e][a, k] = gradients[e, a, k]
        w.volume[e] = volume[e]
        w.rotation[e] = ti.Vector([1.0, 0.0, 0.0, 0.0])
        if ti.static(w.capacity.plastic):
            w.plastic[e] = ti.Vector.zero(w.real, 6)
            w.hardened[e] = 0.0
            w.plastic_inverse[e] = ti.Matrix.identity(w.real, 3)
            if ti.static(w.capacity.springs):
                w.spring_growth[e] = ti.zero(w.spring_growth[e])
                w.spring_hardened[e] = ti.zero(w.spring_hardened[e])


@ti.kernel
def _fill_mesh(w: ti.template(), rest: _array(), cells: _array(), incident_start: _array(), incident: _array()):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(rest.shape[0]):
        for k in ti.static(range(3)):
            w.rest[i][k] = rest[i, k]
        w.shielded[i] = 0
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for e in range(cells.shape[0]):
        for a in ti.static(range(w.corners)):
            w.cell[e][a] = cells[e, a]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(incident_start.shape[0]):
        w.incident_start[i] = incident_start[i]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(incident.shape[0]):
        w.incident[i] = incident[i]


@ti.kernel
def _fill_table(w: ti.template(), table: _array(), body_start: _array(), body_flies: _array()):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for i in range(table.shape[0]):
        for k in ti.static(range(w.table.n)):
            w.table[i][k] = table[i, k]
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for b in range(body_flies.shape[0]):
        w.body_start[b] = body_start[b]
        w.body_start[b + 1] = body_start[b + 1]
        w.body_flies[b] = body_flies[b]


@ti.kernel
def _fill_groups(w: ti.template(), held: _array(), pulled: _array(), stiffness: _array()):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for k in range(held.shape[0]):
        w.held_node[k] = held[k, 0]
        w.held_pose[k] = held[k, 1]
        for a in ti.static(range(3)):
            w.held_axes[k][a] = ti.cast(held[k, 2 + a], w.real)
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for k in range(pulled.shape[0]):
        w.pulled_node[k] = pulled[k, 0]
        w.pulled_pose[k] = pulled[k, 1]
        w.pulled_stiffness[k] = stiffness[k]


@ti.kernel
def _fill_poses(w: ti.template(), poses: _array()):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for g in range(poses.shape[0]):
        for a in ti.static(range(3)):
            for b in ti.static(range(3)):
                w.pose_rotation[g][a, b] = poses[g, a, b]
            w.pose_offset[g][a] = poses[g, a, 3]


@ti.kernel
def _fill_colliders(w: ti.template(), rows: _array()):
    ti.loop_config(serialize=ti.static(w.alone(0)))
    for c in range(rows.shape[0]):
        w.collider_kind[c] = ti.cast(rows[c, 0], ti.i32)
        w.collider_friction[c] = rows[c, 1]
        for a in ti.static(range(3)):
            w.collider_size[c][a] = rows[c, 2 + a]
            w.collider_center[c][a] = rows[c, 5 + a]
            w.collider_velocity[c][a] = rows[c, 8 + a]
            w.collider_spin[c][a] = rows[c, 11 + a]
            w.collider_center0[c][a] = rows[c, 14 + a]
            for b in ti.static(range(3)):
                w.collider_rotation[c][a, b] = rows[c, 17 + 3 * a + b]
                w.collider_rotation0[c][a, b] = rows[c, 26 + 3 * a + b]


def _rank(field) -> int:
    """Indices of an entry of a field: 0 for a number, 1 for a vector, 2 for a matrix."""
    return 0 if not hasattr(field, "n") else 1 if field.m == 1 else 2


@ti.kernel
def _write(target: ti.template(), source: _array(), n: ti.i32):
    for i in range(n):
        if ti.static(_rank(target) == 0):
            target[i] = source[i]
        elif ti.static(_rank(target) == 1):
            for k in ti.static(range(target.n)):
                target[i][k] = source[i, k]
        else:
            for a, b in ti.static(ti.ndrange(target.n, target.m)):
                target[i][a, b] = source[i, a, b]


@ti.kernel
def _read(source: ti.template(), target: _array(), n: ti.i32):
    for i in range(n):
        if ti.static(_rank(source) == 0):
            target[i] = source[i]
        elif ti.static(_rank(source) == 1):
            for k in ti.static(range(source.n)):
                target[i, k] = source[i][k]
        else:
            for a, b in ti.static(ti.ndrange(source.n, source.m)):
                target[i, a, b] = source[i][a, b]


def dtype_of(w: World) -> type:
    """NumPy type of the world's real numbers."""
    return np.float32 if w.real == PRECISIONS["f32"] else np.float64


def _real(w: World, array: np.ndarray) -> np.ndarray:
    return np.ascontiguousarray(array, dtype=dtype_of(w))


def fill(w: World, layout: Layout) -> None:
    """The state at the start, and what elements have whatever comes."""
    _fill_nodes(w, _real(w, layout.velocities))
    indices = np.column_stack([layout.cell_materials, layout.cell_bodies]).astype(np.int32)
    _fill_elements(w, indices, _real(w, layout.gradients), _real(w, layout.volumes))


def fill_mesh(w: World, layout: Layout, incident_start: np.ndarray, incident: np.ndarray) -> None:
    """Rest shape and elements, and which corners meet at each node."""
    _fill_mesh(w, _real(w, layout.rest), layout.cells, incident_start, incident)


def fill_table(w: World, table: np.ndarray, body_start: np.ndarray, body_flies: np.ndarray) -> None:
    """Material rows (materials,15), node ranges of the bodies, and how each flies (`linear_algebra.balance`)."""
    _fill_table(w, _real(w, table), body_start, body_flies.astype(np.int32))


def fill_groups(w: World, held: np.ndarray, pulled: np.ndarray, stiffness: np.ndarray) -> None:
    """held (k,5): node, pose, axes.  pulled (k,2): node, pose, with stiffness (k,) [N/m]."""
    # Taichi takes no empty arrays: one row too many is harmless, the counts say what is in use.
    held = np.vstack([held, np.zeros((1, 5))]).astype(np.int32)
    pulled = np.vstack([pulled, np.zeros((1, 2))]).astype(np.int32)
    _fill_groups(w, held, pulled, _real(w, np.append(stiffness, 0.0)))


def fill_poses(w: World, poses: np.ndarray) -> None:
    """Rotation and offset of each group (groups,3,4)."""
    _fill_poses(w, _real(w, poses))


def fill_colliders(w: World, rows: np.ndarray) -> None:
    """kind, friction, size, center, velocity, spin, center before, rotation and rotation before of each collider."""
    _fill_colliders(w, _real(w, rows))


def read(w: World, field, n: int) -> np.ndarray:
    """The first n entries of a scalar, vector or matrix field, in the world's precision."""
    shape = (n, *((field.n, field.m)[: _rank(field)] if _rank(field) else ()))
    target = np.empty(shape, dtype=dtype_of(w))
    _read(field, target, n)
    return target


def write(w: World, field, array: np.ndarray) -> None:
    """Set the first entries of a scalar, vector or matrix field from (n), (n,k) or (n,k,l)."""
    _write(field, _real(w, array), len(array))


def read_integers(field, n: int) -> np.ndarray:
    """The first n entries of a field of integers (n,) or vectors of them (n,k)."""
    target = np.empty((n, field.n)[: 1 + _rank(field)], dtype=np.int32)
    if n:
        _read(field, target, n)
    return target


def write_integers(field, array: np.ndarray) -> None:
    """Set the first entries of a field of integers."""
    _write(field, np.ascontiguousarray(array, dtype=np.int32), len(array))
