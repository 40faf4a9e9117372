"""The earlier a bar yields, the lower its ends hang and the more has flowed; then all stay as they are."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    *_, simulation = frames
    bodies, cells = simulation.node_bodies, simulation.cell_bodies
    lowest = np.array([simulation.positions[bodies == k, 2].min() for k in range(3)])
    flowed = [simulation.equivalent_plastic_strain()[cells == k].max() for k in range(3)]
    assert lowest[0] > lowest[1] + 0.03 > lowest[2] + 0.04
    assert 0.05 < flowed[0] < flowed[1] < flowed[2]
    assert abs(simulation.velocities).max() < 0.02
