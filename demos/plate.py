"""The plate snaps, nothing of it is lost, and the pieces come to rest."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    mass = first = None
    for simulation in frames:
        mass = simulation.masses.sum() if mass is None else mass
        first = simulation.time if first is None and simulation.piece_count > 1 else first
    assert 0.5 < first < 0.8, "it breaks when the ball comes, not before"
    assert simulation.piece_count > 20
    assert abs(simulation.masses.sum() / mass - 1) < 1e-5
    sizes = np.sort(np.bincount(simulation.cell_pieces))[::-1]
    assert sizes[0] < 0.7 * len(simulation.cells), "two large pieces at least"
    assert simulation.positions[:, 2].min() > -0.01
    assert simulation.crack_faces.any()
    assert np.median(np.abs(simulation.velocities)) < 0.01
