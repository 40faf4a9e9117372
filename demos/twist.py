"""Wound up by 720 degrees without a NaN, and back at the rest shape at the end."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    energies = []
    for simulation in frames:
        assert np.isfinite(simulation.positions).all()
        energies.append(simulation.elastic_energy())
    assert max(energies) > 100, "the wound bar holds energy"
    assert energies[-1] < 1e-3 * max(energies)
    assert np.abs(simulation.positions - simulation.rest_positions).max() < 0.02
