"""The pig lands on its own feet, keeps the dents, and is broken by the beam alone; its colours stay."""

import numpy as np

from taichifem.output.skin import Skin


def check(frames):
    """`frames` yields the simulation after every frame."""
    skin, lowest, dented, whole = Skin(), 0.0, 0.0, 0
    for simulation in frames:
        if simulation.frame in (20, 54):
            seen = skin.of(simulation)
            height = seen.follow(simulation.positions)[np.unique(seen.triangles[~seen.cracked]), 2]
            lowest = min(lowest, height.min())
            dented, whole = simulation.equivalent_plastic_strain().max(), simulation.piece_count
    assert lowest > -0.01, "the surface stands on the ground"
    assert simulation.positions[:, 2].min() < -0.02, "and the cage in it"
    assert dented > 0.05, "landing leaves dents"
    assert whole == 1, "and the pig in one piece"
    sizes = np.sort(np.bincount(simulation.cell_pieces))[::-1]
    assert len(sizes) > 2 and sizes[0] < 0.8 * len(simulation.cells), "until the beam strikes"
    seen = skin.of(simulation)
    assert seen.cracked.any() and (~seen.cracked).sum() == 6158
    assert np.isfinite(seen.colors[~seen.cracked]).all()
