"""Contact forces of a few points at once: which of them part, stick or slide is guessed, solved for, and mended.

The compliance of the points is the capacitance matrix of the Sherman-Morrison-Woodbury formula by which James & Pai
(1999) change boundary conditions. The guess is mended by Newton's method on the projections of contact and friction
(Alart & Curnier 1991), an active set method. Sweeps take many rounds where points lie close together: what moves one
moves the next as far.
"""

from __future__ import annotations

import numpy as np

from taichifem.reduced.contact import contact_forces

ROUNDS = 16
TOLERANCE = 1e-5
"""Of the largest force: by how much projections may miss."""


def balanced_forces(answer: np.ndarray, end: np.ndarray, friction: np.ndarray, start: np.ndarray) -> np.ndarray:
    """Forces (m,3), normal first, that close gaps exactly, only push, and brake by Coulomb's law.

    answer D (3m,3m): displacement by forces, not quite symmetric maybe.  end d (m,3): gap and slip without the forces
    [m].  friction: coefficients (m,).  start: forces (m,3) to begin with. Where the guess goes in circles, sweeps over
    the contacts decide.
    """
    m = len(end)
    stiff = 1 / np.einsum("mama->m", answer.reshape(m, 3, m, 3)) * 3
    forces, best = start.copy(), (np.inf, start)
    for _ in range(ROUNDS):
        reached = end + (answer @ forces.ravel()).reshape(m, 3)
        aim = forces - stiff[:, None] * reached
        acts = aim[:, 0] > 0
        bound = friction * np.maximum(aim[:, 0], 0.0)
        side = np.linalg.norm(aim[:, 1:], axis=1)
        slides = acts & (side > bound)
        share = np.where(slides, bound / np.maximum(side, 1e-300), 1.0)
        wanted = np.column_stack([np.where(acts, aim[:, 0], 0.0), np.where(acts, share, 0.0)[:, None] * aim[:, 1:]])
        miss = np.abs(wanted - forces).max()
        if miss < best[0]:
            best = miss, forces
        if miss <= TOLERANCE * np.abs(forces[:, 0]).max():
            return forces
        forces = forces + _mended(answer, forces, wanted, aim, stiff, acts, slides, share, friction)
    return contact_forces(0.5 * (answer + answer.T), end, friction, np.where(best[1][:, :1] > 0, best[1], 0.0))


def _mended(answer, forces, wanted, aim, stiff, acts, slides, share, friction) -> np.ndarray:
    """A Newton step (m,3) towards forces that are their own projections."""
    m = len(forces)
    # How each projection follows its aim: as it is, not at all, or turned about and cut down.
    follows = np.zeros((m, 3, 3))
    follows[acts] = np.eye(3)
    if slides.any():
        along = aim[slides, 1:] / np.linalg.norm(aim[slides, 1:], axis=1, keepdims=True)
        follows[slides, 1:, 1:] = share[slides, None, None] * (np.eye(2) - along[:, :, None] * along[:, None, :])
        follows[slides, 1:, 0] = friction[slides, None] * along
    # aim = forces - stiff (D forces + end)
    change = -(follows * stiff[:, None, None]) @ answer.reshape(m, 3, 3 * m)
    change[np.arange(m)[:, None], :, 3 * np.arange(m)[:, None] + np.arange(3)] += follows.transpose(0, 2, 1)
    system = np.eye(3 * m) - change.reshape(3 * m, 3 * m)
    return np.linalg.solve(system, (wanted - forces).ravel()).reshape(m, 3)
