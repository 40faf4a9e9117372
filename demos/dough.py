"""Flattened by the stamp, dented by the ball, and as large as before."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    flat = None
    for simulation in frames:
        if flat is None and simulation.time > 2.45:
            flat = np.ptp(simulation.positions[:, 2])
    assert flat < 0.115, "flatter than the ball of 0.16 m that it was"
    x = simulation.positions
    radius = np.hypot(*(x[:, :2] - x[:, :2].mean(axis=0)).T)
    assert x[radius < 0.015, 2].max() < x[:, 2].max() - 0.006, "a dent"
    assert simulation.equivalent_plastic_strain().max() > 1.0
    now, rest = (volumes(x, simulation.cells) for x in (x, simulation.rest_positions))
    assert abs(now.sum() / rest.sum() - 1) < 0.02  # its weight compresses it


def volumes(x, cells):
    """Of tetrahedra [m^3]."""
    return np.linalg.det(x[cells[:, 1:]] - x[cells[:, :1]]) / 6
