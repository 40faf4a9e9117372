"""The linear bar gains more than a fifth in volume, the corotational one stays within a twentieth of it."""

import numpy as np


def volume(simulation, body):
    """Volume of a body now [m^3]."""
    corners = simulation.positions[simulation.cells[simulation.cell_bodies == body]]
    return np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6


def check(frames):
    """`frames` yields the simulation after every frame."""
    *_, simulation = frames
    rest = 1.0 * 0.2 * 0.2
    assert volume(simulation, 0) > 1.2 * rest
    assert abs(volume(simulation, 1) - rest) < 0.05 * rest
