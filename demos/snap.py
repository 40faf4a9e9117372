"""The bar yields before it breaks, and breaks where it has flowed most; its halves stay crooked."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    flowed = before = near = None
    for simulation in frames:
        if near is None and simulation.crack_faces.any():
            opened = np.unique(simulation.surface[simulation.crack_faces])
            near, before, first = np.isin(simulation.cells, opened).any(axis=1), flowed, simulation.time
        flowed = simulation.equivalent_plastic_strain()
    assert 0.4 < first < 1.5, "it bends for a while first"
    assert before[near].max() > 0.1 and before[near].mean() > 3 * before[~near].mean()
    sizes = np.sort(np.bincount(simulation.cell_pieces))[::-1]
    assert len(sizes) >= 2 and sizes[0] < 0.97 * len(simulation.cells)
    ends = [np.argmin(sign * simulation.rest_positions[simulation.cells[:, 0], 0]) for sign in (1, -1)]
    assert simulation.cell_pieces[ends[0]] != simulation.cell_pieces[ends[1]]
    assert flowed.max() > 0.15
