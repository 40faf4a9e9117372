"""Everything lands on the ground, nothing sinks into it, the bar hangs, and all is nearly at rest at the end."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    for simulation in frames:
        x = simulation.positions
        assert np.isfinite(x).all()
        assert x[:, 2].min() > -0.02
    bar = simulation.node_bodies == 3
    assert x[bar, 2].min() < 0.7, "the bar bends under its weight"
    for body in range(3):
        assert x[simulation.node_bodies == body, 2].min() < 0.005, "the body lies on the ground"
    energy = simulation.stats.energy["kinetic"]
    assert energy < 0.02 * abs(simulation.stats.energy["gravity"]), "motion dies out"
