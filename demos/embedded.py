"""The surface stays with its cage; the cage keeps a dent, and breaks."""

import numpy as np

from taichifem.output.skin import Skin


def check(frames):
    """`frames` yields the simulation after every frame."""
    skin = Skin()
    for simulation in frames:
        seen = skin.of(simulation)
        points = seen.follow(simulation.positions)[np.unique(seen.triangles)]
        cage = simulation.positions
        assert (points >= cage.min(axis=0) - 0.1).all() and (points <= cage.max(axis=0) + 0.1).all()
    assert simulation.piece_count > 1
    assert simulation.equivalent_plastic_strain().max() > 0.05
    assert seen.cracked.any()
    assert len(seen.triangles) > 2062
