"""The top follows the handle, swings back through where it was, and the swing dies away."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    top, energy = [], []
    for simulation in frames:
        at = simulation.rest_positions[:, 2] > 0.39
        top.append((simulation.positions - simulation.rest_positions)[at, 0].mean())
        energy.append(simulation.elastic_energy())
    assert max(top) > 0.03
    assert min(top[72:]) < -0.01, "it swings past its shape at rest"
    assert np.abs(top[-10:]).max() < 0.3 * max(top)
    assert energy[-1] < 0.1 * max(energy)
