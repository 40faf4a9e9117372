"""The rip runs straight down the sheet, from between the hands to near its lower hem, and the halves stay whole."""

import numpy as np


def check(frames):
    """`frames` yields the simulation after every frame."""
    depths = []
    for simulation in frames:
        opened = np.unique(simulation.surface[simulation.crack_faces])
        depths.append(0.5 - simulation.rest_positions[opened, 2].min() if len(opened) else 0.0)
    depths = np.array(depths)
    assert (np.diff(depths) >= 0).all() and depths[-1] > 0.7
    assert len(np.unique(depths)) > 6, "it runs, step by step"
    x, _, z = simulation.rest_positions[opened].T
    assert abs(x[z < 0.4]).max() < 0.06, "straight, but for nicks beside the hands"
    assert np.bincount(simulation.cell_pieces).max() > 0.45 * len(simulation.cells)
    assert simulation.piece_count <= 3
