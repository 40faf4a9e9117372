"""The elastic can stands up again, the plastic one keeps its shape and its volume."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    lowest = np.full(2, np.inf)
    for simulation in frames:
        x, bodies = simulation.positions, simulation.node_bodies
        heights = np.array([np.ptp(x[bodies == k, 2]) for k in range(2)])
        lowest = np.minimum(lowest, heights)
    np.testing.assert_allclose(lowest, 0.47, atol=0.01)
    assert heights[0] > 0.69 and heights[1] < 0.53
    wall = simulation.cell_bodies == 1
    accumulated = simulation.equivalent_plastic_strain()
    assert accumulated[~wall].max() == 0 and accumulated[wall].max() > 0.3
    now, rest = (volumes(x, simulation.cells[wall]) for x in (simulation.positions, simulation.rest_positions))
    assert abs(now.sum() / rest.sum() - 1) < 5e-3  # what is left are residual stresses


def volumes(x, cells):
    """Of tetrahedra [m^3]."""
    return np.linalg.det(x[cells[:, 1:]] - x[cells[:, :1]]) / 6
