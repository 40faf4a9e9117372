"""Both blocks part, at about the same pull: the springs' own stress is what is held against their toughness."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    first = {}
    for simulation in frames:
        for body in range(2):
            count = len(np.unique(simulation.cell_pieces[simulation.cell_bodies == body]))
            if count > 1:
                first.setdefault(body, simulation.time)
    assert len(first) == 2 and abs(first[0] - first[1]) < 0.3 * first[1]
    for body in range(2):
        mine = simulation.cell_bodies == body
        sizes = np.sort(np.bincount(simulation.cell_pieces[mine]))[::-1] / mine.sum()
        assert sizes[1] > 0.15, "two large pieces at least"
    assert abs(simulation.velocities).max() < 1.0
