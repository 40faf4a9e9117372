"""What is elastic comes back; what is plastic stays bent, flows without change of volume, and comes to rest."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    rest = lowest = None
    for simulation in frames:
        tip = tips(simulation)
        rest = tip if rest is None else rest
        lowest = tip if lowest is None else np.minimum(lowest, tip)
    left = (rest - tips(simulation)) / (rest - lowest)
    bodies, plastic = simulation.cell_bodies, simulation.plastic_strain()
    accumulated = simulation.equivalent_plastic_strain()
    assert abs(left[0]) < 0.15, left
    assert (left[1:] > 0.3).all(), left
    assert accumulated[bodies == 0].max() == 0
    assert all(accumulated[bodies == k].max() > 0.05 for k in (1, 2, 3))
    yields = bodies >= 2
    assert abs(np.trace(plastic[yields], axis1=1, axis2=2)).max() < 1e-5 * accumulated.max()
    assert np.abs(simulation.velocities[simulation.node_bodies > 0]).max() < 0.1


def tips(simulation):
    """Height of the end of each bar (bars,) [m]."""
    end = simulation.rest_positions[:, 0] > 0.999
    bodies = simulation.node_bodies
    return np.array([simulation.positions[end & (bodies == k), 2].mean() for k in range(4)])
