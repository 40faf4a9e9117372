"""The ball dents the bear and never sinks in; without it the bear has its shape again."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    dents, touched = [], 0
    for simulation in frames:
        collider, _, shift = simulation.collider_poses()[0]
        surface = np.unique(simulation.surface)
        moved = (simulation.positions - simulation.rest_positions)[surface]
        away = np.linalg.norm(simulation.positions[surface] - collider.center - shift, axis=1)
        assert away.min() > collider.radius - 1e-5
        dents.append(np.linalg.norm(moved, axis=1).max())
        touched = max(touched, simulation.contacts)
    assert max(dents) > 0.05
    assert touched > 6
    assert dents[-1] < 1e-9
