"""What nodes carry over when the mesh changes, or a state is kept: motion, and contact with colliders."""

import numpy as np

from taichifem.runtime import ti
from taichifem.transfer import dtype_of
from taichifem.world import MEMORY, Counts, World

_array = ti.types.ndarray

_STATE = 18 + 3 * (MEMORY + 1)
"""Numbers that a node goes on with: x, v, v0, past_x, past_v, dv, and what the last steps did."""


@ti.kernel
def _read_nodes(w: ti.template(), state: _array()):
    for i in range(state.shape[0]):
        for k in ti.static(range(3)):
            for m, field in ti.static(enumerate((w.x, w.v, w.v0, w.past_x, w.past_v, w.dv))):
                state[i, 3 * m + k] = field[i][k]
            for m in ti.static(range(MEMORY + 1)):
                state[i, 18 + 3 * m + k] = w.past[i][k, m]


@ti.kernel
def _write_nodes(w: ti.template(), state: _array(), source: _array()):
    for i in range(source.shape[0]):
        for k in ti.static(range(3)):
            for m, field in ti.static(enumerate((w.x, w.v, w.v0, w.past_x, w.past_v, w.dv))):
                field[i][k] = state[source[i], 3 * m + k]
            for m in ti.static(range(MEMORY + 1)):
                w.past[i][k, m] = state[source[i], 18 + 3 * m + k]


@ti.kernel
def _read_contacts(w: ti.template(), slip: _array(), pressed: _array(), touching: _array()):
    for c, i in ti.ndrange(touching.shape[0], touching.shape[1]):
        for k in ti.static(range(3)):
            slip[c, i, k] = w.slip[c, i][k]
        pressed[c, i] = w.pressed[c, i]
        touching[c, i] = w.touching[c, i]


@ti.kernel
def _write_contacts(w: ti.template(), slip: _array(), pressed: _array(), touching: _array()):
    for c, i in ti.ndrange(touching.shape[0], touching.shape[1]):
        for k in ti.static(range(3)):
            w.slip[c, i][k] = slip[c, i, k]
        w.pressed[c, i] = pressed[c, i]
        w.touching[c, i] = touching[c, i]


def read_contacts(w: World, n_colliders: int, n: int) -> dict[str, np.ndarray]:
    """slip (colliders,n,3) [m], pressed (colliders,n) [N] and touching (colliders,n) of `World`."""
    shape = (max(n_colliders, 1), n)
    real = dtype_of(w)
    arrays = {
        "slip": np.zeros((*shape, 3), real),
        "pressed": np.zeros(shape, real),
        "touching": np.zeros(shape, np.int32),
    }
    _read_contacts(w, *arrays.values())
    return arrays


def write_contacts(w: World, arrays: dict[str, np.ndarray]) -> None:
    """The inverse of `read_contacts`."""
    _write_contacts(w, *(np.ascontiguousarray(arrays[name]) for name in ("slip", "pressed", "touching")))


def read_nodes(w: World, counts: Counts) -> tuple[np.ndarray, dict[str, np.ndarray]]:
    """All that nodes go on with when the mesh changes, for `write_nodes`."""
    state = np.empty((counts.nodes, _STATE), dtype=dtype_of(w))
    _read_nodes(w, state)
    return state, read_contacts(w, counts.colliders, counts.nodes)


def write_nodes(w: World, counts: Counts, state: tuple[np.ndarray, dict[str, np.ndarray]], source: np.ndarray) -> None:
    """Go on: node i with what node source[i] had before."""
    numbers, contacts = state
    _write_nodes(w, numbers, source.astype(np.int32))
    if counts.colliders:
        write_contacts(w, {name: values[:, source] for name, values in contacts.items()})
