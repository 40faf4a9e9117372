"""Contact forces of bodies that answer linearly: how far a force moves each contact point is known beforehand.

With forces f (m,3) constant over a step, the gaps and slips at its end are D f + d. Normal forces only push, friction
is at most mu times the normal force, and both do what they can: min 1/2 f D f + f d within these bounds. Normal and
tangential bounds are renewed in turns (staggered projections: Kaufman et al. 2008), each problem being solved by
accelerated projected gradients (Nesterov's method with restarts; Mazhar et al. 2015). What is left of an iteration's
error may do no work: forces with f (D f + d) > 0 are made shorter until that is 0. So contact takes energy only.
"""

from __future__ import annotations

import numpy as np

PASSES, ITERATIONS = 3, 150
TOLERANCE = 1e-7


def frames_of(normals: np.ndarray) -> np.ndarray:
    """Rows normal, tangent, tangent (m,3,3) for unit normals (m,3)."""
    aside = np.eye(3)[np.abs(normals).argmin(axis=1)]
    first = np.cross(normals, aside)
    first /= np.linalg.norm(first, axis=1, keepdims=True)
    return np.stack([normals, first, np.cross(normals, first)], axis=1)


def contact_forces(answer: np.ndarray, end: np.ndarray, friction: np.ndarray) -> np.ndarray:
    """Forces (m,3), normal first, under which nothing penetrates, sticking points stay and sliding ones are braked.

    answer D (3m,3m): displacement by forces, symmetric and positive semi-definite.  end d (m,3): gap and slip at the
    end of the step without contact [m].  friction: coefficients (m,).
    """
    forces = np.zeros_like(end)
    for _ in range(PASSES if (friction > 0).any() else 1):
        forces = _descend(answer, end, friction * forces[:, 0], forces)
    return _without_work(answer, end, forces)


def stopping_impulses(answer: np.ndarray, velocity: np.ndarray, most: np.ndarray) -> np.ndarray:
    """Impulses (m,3) that stop points along the normal, and across it with at most `most` (m,).

    answer D (3m,3m): velocity by impulses.  velocity (m,3): relative, normal first. They never add kinetic energy.
    """
    return _without_work(answer, velocity, _descend(answer, velocity, most, np.zeros_like(velocity), pulls=True))


def _descend(
    answer: np.ndarray, end: np.ndarray, most: np.ndarray, start: np.ndarray, *, pulls: bool = False
) -> np.ndarray:
    """Minimise 1/2 f D f + f d over normal forces that push (or pull as well) and tangential ones up to `most`."""
    m = len(end)
    # One scale for each contact: the bound stays a disc.
    diagonal = answer.diagonal().reshape(m, 3).mean(axis=1)
    scale = 1 / np.sqrt(np.maximum(diagonal, 1e-12 * diagonal.max(initial=1e-300)))
    long = np.repeat(scale, 3)
    scaled, slope = long[:, None] * answer * long, (scale[:, None] * end).ravel()
    bound = most / scale
    rate = 1 / _largest(scaled)
    f = (start / scale[:, None]).ravel()
    ahead, t, small = f.copy(), 1.0, TOLERANCE * np.abs(slope).max(initial=0.0) * rate
    for _ in range(ITERATIONS):
        new = (ahead - rate * (scaled @ ahead + slope)).reshape(m, 3)
        if not pulls:
            np.maximum(new[:, 0], 0, out=new[:, 0])
        side = np.sqrt(new[:, 1] ** 2 + new[:, 2] ** 2)
        new[:, 1:] *= (bound / np.maximum(side, np.maximum(bound, 1e-300)))[:, None]
        new = new.ravel()
        change = new - f
        if np.abs(change).max(initial=0.0) <= small:
            f = new
            break
        later = 0.5 * (1 + np.sqrt(1 + 4 * t * t))
        if (ahead - new) @ change > 0:
            ahead, later = new, 1.0
        else:
            ahead = new + (t - 1) / later * change
        f, t = new, later
    return f.reshape(m, 3) * scale[:, None]


def _largest(matrix: np.ndarray) -> float:
    """An upper bound of the largest eigenvalue of a positive semi-definite matrix."""
    return max(min(float(np.abs(matrix).sum(axis=0).max()), float(np.trace(matrix))), 1e-300)


def _without_work(answer: np.ndarray, end: np.ndarray, forces: np.ndarray) -> np.ndarray:
    """The forces, or if f (D f + d) > 0 as much shorter as makes that 0."""
    flat = forces.ravel()
    work, against = flat @ (answer @ flat), -flat @ end.ravel()
    return forces * max(0.0, against / work) if work > against else forces
