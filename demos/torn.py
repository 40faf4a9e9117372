"""The block parts between the hands: each keeps about half, and nothing is lost."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    mass = first = None
    for simulation in frames:
        mass = simulation.masses.sum() if mass is None else mass
        first = simulation.time if first is None and simulation.piece_count > 1 else first
    assert 0.3 < first < 1.5
    assert abs(simulation.masses.sum() / mass - 1) < 1e-5
    sizes = np.sort(np.bincount(simulation.cell_pieces))[::-1] / len(simulation.cells)
    assert sizes[1] > 0.35 and sizes[:2].sum() > 0.95
    middle = simulation.positions[simulation.cells].mean(axis=1)[:, 0]
    left, right = (middle[simulation.cell_pieces == k] for k in np.argsort(np.bincount(simulation.cell_pieces))[-2:])
    assert left.max() < right.min() or right.max() < left.min(), "they are apart"
    opened = simulation.rest_positions[np.unique(simulation.surface[simulation.crack_faces]), 0]
    assert np.median(abs(opened)) < 0.1
    assert simulation.von_mises().max() < 2e3, "and at rest"
