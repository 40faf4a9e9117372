"""Both bodies wobble, contact only takes energy, and they come to rest on the ground."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    start, most = None, 0.0
    for simulation in frames:
        start = start or simulation.stats.energy["total"]
        assert simulation.stats.energy["total"] < 1.001 * start
        assert simulation.positions[:, 2].min() > -0.03
        most = max(most, *(np.abs(body.displacement).max() for body in simulation.bodies))
    assert most > 0.02, "they deform, and not a little"
    assert all(body.touch.dissipated > 0 for body in simulation.bodies)
    assert np.abs(simulation.velocities).max() < 0.3, "at rest, or nearly so"
    assert simulation.contacts >= 3
