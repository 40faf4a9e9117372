"""Squeezed to the gap under the plate and no further, carried sideways by friction, round again at the end."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    lowest = np.full(3, np.inf)
    carried = np.zeros(3)
    for simulation in frames:
        x = simulation.positions
        for body in range(3):
            nodes = simulation.node_bodies == body
            height = np.ptp(x[nodes, 2])
            lowest[body] = min(lowest[body], height)
            if abs(simulation.time - 3.0) < 1e-9:
                rest = simulation.rest_positions[nodes, 0].mean()
                carried[body] = x[nodes, 0].mean() - rest
    np.testing.assert_allclose(lowest, 0.3, atol=0.015)
    assert (carried > 0.03).all(), "friction carries the balls along with the plate"
    for body in range(3):
        nodes = simulation.node_bodies == body
        assert np.ptp(x[nodes, 0]) < 0.55, "round again"
        assert np.ptp(x[nodes, 2]) > 0.42
