"""The vase is whole until it lands, breaks into sherds of all sizes, and they come to lie on the ground."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    mass = first = None
    for simulation in frames:
        mass = simulation.masses.sum() if mass is None else mass
        first = simulation.time if first is None and simulation.crack_faces.any() else first
    assert 0.4 < first < 0.7, "it breaks when it lands, not before"
    assert abs(simulation.masses.sum() / mass - 1) < 1e-5
    sizes = np.sort(np.bincount(simulation.cell_pieces))[::-1]
    assert len(sizes) > 10 and sizes[0] < 0.9 * len(simulation.cells)
    assert simulation.positions[:, 2].min() > -0.02
    assert np.median(np.abs(simulation.velocities)) < 0.05
