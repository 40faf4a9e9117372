"""Natural frequencies from `stiffness()` and `masses` against an independent code."""

import json

import numpy as np
import pytest
import scipy.sparse.linalg

import taichifem as tf


@pytest.mark.parametrize("case", [0, 1])
def test_lowest_modes_of_a_clamped_bar(oracles, case):
    """K u = w^2 M u with lumped masses: ten eigenvalues."""
    table = json.loads((oracles / "modes_bar.json").read_text())["cases"][case]
    data = np.load(oracles / "linear_bar12x3x3.npz")
    material = tf.Material(model="linear", youngs=table["E"], poisson=table["nu"], density=table["rho"])
    body = tf.Body(mesh=tf.TetMesh(data["X"], data["T"]), material=material)
    simulation = tf.Simulation(tf.Scene(bodies=[body]), precision="f64")
    free = np.flatnonzero(np.repeat(data["X"][:, 0] > 1e-9, 3))
    K, M = simulation.stiffness()[free][:, free], scipy.sparse.diags(np.repeat(simulation.masses, 3)[free])
    values = scipy.sparse.linalg.eigsh(K.tocsc(), k=10, M=M.tocsc(), sigma=0, return_eigenvectors=False)
    np.testing.assert_allclose(np.sort(values), table["eigenvalues_rad2_lumped"], rtol=1e-6)
