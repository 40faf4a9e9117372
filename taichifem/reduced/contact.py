"""Contact forces of bodies that answer linearly: how far a force moves each contact point is known beforehand.

With forces f (m,3) constant over a step, the gaps and slips at its end are D f + d. Normal forces only push, and close
gaps exactly; friction stops the slip with at most mu times the normal force (Coulomb). Contact by contact, until that
changes nothing (projected Gauss-Seidel: Jean & Moreau 1992). What is left of the iteration's error may do no work:
forces with f (D f + d) > 0 are made shorter until that is 0. So contact takes energy only.
"""

import numpy as np

from taichifem import runtime
from taichifem.reduced.vectors import cross
from taichifem.runtime import ti

SWEEPS = 60
TOLERANCE = 1e-5
"""Of the largest force: a change at which the sweeps end."""

_array = ti.types.ndarray


def frames_of(normals: np.ndarray) -> np.ndarray:
    """Rows normal, tangent, tangent (m,3,3) for unit normals (m,3)."""
    aside = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = cross(normals, aside)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([normals, first, cross(normals, first)], axis=1)


@ti.kernel
def _sweep(data: _array(), m: ti.i32, pulls: ti.i32) -> ti.i32:
    """Improve the forces f (m,3); returns how often. pulls: normal forces of either sign, friction at `most`.

    data: rows of D (3m,3m), and behind them d (m,3), friction (m,), most (m,) and f: with an array of two dimensions a
    sweep takes more than twice as long, to find its entries.
    """
    done = 0
    ti.loop_config(serialize=True)
    for _ in range(1):
        wide, d = 3 * m, 9 * m * m
        friction, most, f = d + 3 * m, d + 4 * m, d + 5 * m
        change, size = ti.f64(1.0), ti.f64(0.0)
        while done < SWEEPS and change > TOLERANCE * size:
            change, size = 0.0, 0.0
            done += 1
            for i in range(m):
                v = ti.Vector([data[d + 3 * i], data[d + 3 * i + 1], data[d + 3 * i + 2]])
                row = 3 * i * wide
                for j in range(wide):
                    for a in ti.static(range(3)):
                        v[a] += data[row + a * wide + j] * data[f + j]
                own = row + 3 * i  # the block of the point with itself
                pushed = data[f + 3 * i] - v[0] / data[own]
                if pulls == 0:
                    pushed = ti.max(pushed, 0.0)
                step = pushed - data[f + 3 * i]
                for a in ti.static(range(1, 3)):
                    v[a] += data[own + a * wide] * step
                # The largest eigenvalue of the tangential block.
                one, other, mixed = data[own + wide + 1], data[own + 2 * wide + 2], data[own + wide + 2]
                stiff = 0.5 * (one + other) + ti.sqrt(0.25 * (one - other) ** 2 + mixed * mixed)
                side = ti.Vector([data[f + 3 * i + 1] - v[1] / stiff, data[f + 3 * i + 2] - v[2] / stiff])
                bound = data[most + i] + data[friction + i] * ti.max(pushed, 0.0)
                if side.norm() > bound:
                    side *= bound / side.norm()
                turn = ti.max(ti.abs(side[0] - data[f + 3 * i + 1]), ti.abs(side[1] - data[f + 3 * i + 2]))
                change = ti.max(change, ti.abs(step), turn)
                size = ti.max(size, ti.abs(pushed))
                data[f + 3 * i] = pushed
                data[f + 3 * i + 1] = side[0]
                data[f + 3 * i + 2] = side[1]
    return done


def contact_forces(
    answer: np.ndarray, end: np.ndarray, friction: np.ndarray, start: np.ndarray | None = None
) -> np.ndarray:
    """Forces (m,3), normal first, under which nothing penetrates, sticking points stay and sliding ones are braked.

    answer D (3m,3m): displacement by forces, symmetric and positive semi-definite.  end d (m,3): gap and slip at the
    end of the step without contact [m].  friction: coefficients (m,).  start: forces to begin with.
    """
    begin = np.zeros_like(end) if start is None else start.copy()
    return _solve(answer, end, friction, np.zeros(len(end)), begin, pulls=False)


def stopping_impulses(answer: np.ndarray, velocity: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Impulses (m,3) that stop points along the normal, and across it with at most `most` (m,).

    answer D (3m,3m): velocity by impulses.  velocity (m,3): relative, normal first. They never add kinetic energy.
    """
    return _solve(answer, velocity, np.zeros(len(velocity)), most, np.zeros_like(velocity), pulls=True)


def _solve(answer, end, friction, most, forces, *, pulls: bool) -> np.ndarray:
    # A point that nothing can move along some axis would be divided by zero.
    answer = answer + 1e-12 * np.abs(answer).max() * np.eye(len(answer))
    everything = np.concatenate([np.ravel(part) for part in (answer, end, friction, most, forces)], dtype=np.float64)
    with runtime.precision_of("f64"):
        _sweep(everything, len(end), int(pulls))
    forces = everything[len(everything) - end.size :].reshape(end.shape)
    flat = forces.ravel()
    # Impulses are judged by the kinetic energy that they add, forces by the work that they do.
    work, against = (0.5 if pulls else 1.0) * flat @ (answer @ flat), -flat @ end.ravel()
    return forces * max(0.0, against / work) if work > against else forces
