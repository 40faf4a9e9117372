"""The levels of the solver: few iterations whatever the stiffness, and the same answers."""

import numpy as np
import pytest
import scipy.sparse.linalg

import taichifem as tf
from taichifem import transfer
from taichifem.linear_algebra import crew, program
from taichifem.linear_algebra.galerkin import relax
from taichifem.linear_algebra.steps import Limits
from taichifem.structure import elimination

SIZE, CELLS = (1.0, 0.25, 0.25), (20, 5, 5)
HELD = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))


def bar(youngs=1e6, poisson=0.4, pins=(HELD,), **body):
    mesh = tf.TetMesh.bar(size=SIZE, cells=CELLS)
    return tf.Body(mesh=mesh, material=tf.Material(youngs=youngs, poisson=poisson), pins=pins, **body)


@pytest.mark.parametrize("youngs", [1e5, 1e6, 1e7, 1e9])
def test_iterations_hardly_grow_with_stiffness(youngs):
    """Block Jacobi takes about 50, 110, 120 and 130 here."""
    simulation = tf.Simulation(tf.Scene(bodies=[bar(youngs)]))
    simulation.advance(seconds=0.1)
    assert simulation.report.converged
    assert simulation.report.iterations <= 25


def test_nearly_incompressible_bodies_converge():
    simulation = tf.Simulation(tf.Scene(bodies=[bar(1e6, poisson=0.49)]))
    simulation.advance(seconds=0.1)
    assert simulation.report.converged
    assert simulation.report.iterations <= 45


def test_the_solution_is_that_of_a_direct_solver():
    scene = tf.Scene(bodies=[bar(1e6), bar(1e9, position=(0, 0.5, 0))], tolerance=1e-12)
    simulation = tf.Simulation(scene, precision="f64")
    K, m = simulation.stiffness(), np.repeat(simulation.masses, 3)
    free = (np.repeat(simulation.rest_positions[:, 0], 3) > 1e-6).nonzero()[0]
    A = (scipy.sparse.diags_array(m) + simulation.dt**2 * K).tocsc()[free][:, free]
    gravity = np.tile(scene.gravity, len(simulation.masses))
    expected = scipy.sparse.linalg.spsolve(A, (simulation.dt * m * gravity)[free])
    simulation.step()
    assert simulation.velocities.ravel()[free] == pytest.approx(expected, rel=1e-8, abs=1e-9 * abs(expected).max())


def test_block_jacobi_gives_the_same_answer_in_more_iterations():
    ends, iterations = [], []
    for solver in ("multilevel", "block-jacobi"):
        simulation = tf.Simulation(tf.Scene(bodies=[bar()], solver=solver, tolerance=1e-10), precision="f64")
        simulation.step()
        assert simulation.report.converged
        ends.append(simulation.positions)
        iterations.append(simulation.report.iterations)
        del simulation  # the next one takes its world, which is compiled
    assert ends[1] == pytest.approx(ends[0], abs=1e-9)
    assert iterations[1] > 4 * iterations[0]


def test_an_operation_a_launch_gives_the_same_answer(monkeypatch):
    """The way that other devices than the CPU go. (Compiled apart, sums may be rounded otherwise.)"""
    ends = []
    for arch in ("cpu", "any other"):
        monkeypatch.setattr(crew.runtime, "running_arch", lambda arch=arch: arch)
        simulation = tf.Simulation(tf.Scene(bodies=[bar(), bar(1e4, pins=(), position=(0, 1, 0))]))
        simulation.advance(seconds=0.05)
        ends.append((simulation.positions, simulation.report.iterations))
        del simulation  # the next one takes its world, which is compiled
    assert ends[0][0] == pytest.approx(ends[1][0], abs=1e-5) and ends[0][1] == ends[1][1]


def coarse_matrix(simulation, level=1):
    """The Galerkin matrix of a level as the world has it, and as Z^T A Z with Z written out."""
    w, found, levels = simulation._world, simulation._layout.aggregates, simulation._plan.levels
    n, first, end = simulation._counts.nodes, found.first[level - 1], found.first[level]
    pattern = simulation._plan.pattern
    with simulation._kernels():
        relaxed = transfer.read(w, w.relaxed, n)
        blocks = transfer.read(w, w.block, len(levels.column))
        free = transfer.read(w, w.free, n)
    start = levels.row_start[n + 2 * first : n + 2 * end + 1]
    inside = slice(start[0], start[-1])
    gathered = scipy.sparse.bsr_array((blocks[inside], levels.column[inside] - n - 2 * first, start - start[0]))
    A = np.zeros((n, n, 3, 3))
    j = pattern.column[pattern.upper]
    A[pattern.row, j] = blocks[pattern.upper]
    A[j, pattern.row] = blocks[pattern.upper].transpose(0, 2, 1)
    places, reach, nodes = list(relaxed), [0.0] * n, [np.array([i]) for i in range(n)]
    for step in range(level):  # centres, reaches and nodes of the aggregates of every level, from those below
        groups = [np.arange(found.begin[g], found.end[g]) for g in range(found.first[step], found.first[step + 1])]
        low = found.first[step - 1] if step else 0
        below = places, reach, nodes
        places = [np.mean([below[0][k - low] for k in group], axis=0) for group in groups]
        reach = [
            np.sqrt(np.mean([((below[0][k - low] - c) ** 2).sum() + below[1][k - low] ** 2 for k in group]))
            for group, c in zip(groups, places, strict=True)
        ]
        nodes = [np.concatenate([below[2][k - low] for k in group]) for group in groups]
    Z = np.zeros((n, 3, 6 * (end - first)))
    for g in range(end - first):
        arm = (relaxed[nodes[g]] - places[g]) / reach[g]
        Z[nodes[g], :, 6 * g : 6 * g + 3] = np.eye(3)
        Z[nodes[g], :, 6 * g + 3 : 6 * g + 6] = np.cross(np.eye(3)[None], arm[:, None]).transpose(0, 2, 1)
    Z *= free[:, :, None]
    Z = Z.reshape(3 * n, -1)
    return gathered.toarray(), Z.T @ A.transpose(0, 2, 1, 3).reshape(3 * n, 3 * n) @ Z


@pytest.mark.parametrize("level", [1, 2])
@pytest.mark.parametrize("ground", [False, True])
def test_the_coarse_matrices_are_those_of_the_rigid_motions_of_aggregates(monkeypatch, level, ground):
    """On the ground, the last solve of several has changed the springs only."""
    if level == 2:
        monkeypatch.setattr(elimination, "most_changes", lambda blocks: 0)
    colliders = [tf.PlaneCollider(friction=0.5)] if ground else []
    simulation = tf.Simulation(tf.Scene(bodies=[bar()], colliders=colliders), precision="f64")
    simulation.step()
    assert simulation._plan.elimination.level == level and (simulation.report.contact_passes > 1) == ground
    gathered, expected = coarse_matrix(simulation, level)
    assert gathered == pytest.approx(expected, abs=1e-12 * abs(expected).max())


@pytest.mark.parametrize("bodies", [1, 3, "a strip that flies"])
def test_the_level_that_is_eliminated_is_solved(bodies):
    """Errors of round-off must not grow from one aggregate to the next, along the strip."""
    if strip := isinstance(bodies, str):
        mesh, glass = tf.TetMesh.bar(size=(1.8, 0.04, 0.04), cells=(90, 2, 2)), tf.Material(youngs=5e7, poisson=0.25)
        several, bodies = [tf.Body(mesh=mesh, material=glass)], 1
    else:
        several = [bar(10.0 ** (6 + k), position=(0, 0.3 * k, 0)) for k in range(bodies)]
    simulation = tf.Simulation(tf.Scene(bodies=several, fps=30), precision="f64")
    simulation.step()
    w, n, plan = simulation._world, simulation._counts.nodes, simulation._plan
    last, operations = plan.elimination, plan.program.operations
    rows = slice(n + 2 * int(last.order.min()), n + 2 * int(last.order.max()) + 2)
    matrix, _ = coarse_matrix(simulation, last.level)
    right = np.random.default_rng(0).normal(size=(rows.stop - rows.start, 3))
    at = int(np.flatnonzero(operations[:, 0] == program.LAST)[0])
    assert len(last.order) > 10 and (operations[at, 2] > 1) == (bodies > 1), "in parts"
    with simulation._kernels():
        before = transfer.read(w, w.residual, rows.stop)
        before[rows] = right
        transfer.write(w, w.residual, before)
        crew.run(w, n, operations, Limits(0.0, 1), opening=(at, at + 1))
        found = transfer.read(w, w.z, rows.stop)[rows]
    exact = np.linalg.solve(matrix, right.ravel())
    assert np.linalg.norm(found.ravel() - exact) < (1e-5 if strip else 1e-7) * np.linalg.norm(exact)


@pytest.mark.parametrize("model", ["linear", "corotational", "stvk"])
def test_turns_of_a_strained_splinter_are_those_that_cost_nothing(model):
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1.0]])
    material = tf.Material(youngs=1e6, poisson=0.3, model=model)
    body = tf.Body(mesh=tf.TetMesh(points, np.array([[0, 1, 2, 3]])), material=material)
    simulation = tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)), precision="f64")
    w, n = simulation._world, 4
    turn = np.array([[0.8, -0.6, 0], [0.6, 0.8, 0], [0, 0, 1.0]]) if model == "corotational" else np.eye(3)
    strained = (points * (1.2, 1.0, 0.9)) @ turn.T
    simulation.set_positions(strained)
    K = simulation.stiffness()
    with simulation._kernels():
        relax(w, n, 1)
    relaxed = simulation._given(transfer.read(w, w.relaxed, n))
    if model == "stvk":  # its stress turns with it, so that the strained shape is the one that counts
        assert relaxed == pytest.approx(strained, abs=1e-12)
        return
    assert relaxed == pytest.approx((points - points.mean(axis=0)) @ turn.T + strained.mean(axis=0), abs=1e-12)
    for axis in np.eye(3):
        forces = [abs(K @ np.cross(axis, x).ravel()).max() for x in (relaxed, strained)]
        assert forces[0] < 1e-9 * forces[1]


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_smoothing_converges_for_every_spread_of_the_spectrum(precision):
    """D^-1 A has no eigenvalue above 4, so that the weight below 1/2 is safe: near-incompressible, deformed, held."""
    simulation = tf.Simulation(tf.Scene(bodies=[bar(1e9, poisson=0.499)]), precision=precision)
    simulation.advance(seconds=0.05)
    K = simulation.stiffness().tobsr((3, 3))
    n, row = len(simulation.masses), np.repeat(np.arange(K.shape[0] // 3), np.diff(K.indptr))
    half = [np.linalg.inv(np.linalg.cholesky(block)) for block in K.data[row == K.indices]]
    D = scipy.sparse.block_diag(half).tocsr()
    largest = scipy.sparse.linalg.eigsh(D @ K @ D.T, k=1, which="LA", return_eigenvectors=False)[0]
    assert n and 2 < largest < 4


def test_bodies_of_very_different_stiffness_on_the_ground():
    soft = [tf.TetMesh.bar(size=(0.3, 0.3, 0.3), cells=(4, 4, 4))] * 5
    bodies = [
        tf.Body(mesh=mesh, material=tf.Material(youngs=10.0 ** (4 + k)), position=(0.5 * k, 0, 0.05))
        for k, mesh in enumerate(soft)
    ]
    simulation = tf.Simulation(tf.Scene(bodies=bodies, colliders=[tf.PlaneCollider(friction=0.5)]))
    most = 0
    for _ in range(60):
        simulation.step()
        assert simulation.report.converged
        most = max(most, simulation.report.iterations / max(1, simulation.report.contact_passes))
    assert most <= 40
    assert np.isfinite(simulation.positions).all()


def test_the_product_is_timed_and_leaves_no_trace():
    simulations = [tf.Simulation(tf.Scene(bodies=[bar()])) for _ in range(2)]
    for simulation in simulations:
        simulation.step()
    found = simulations[0].product_bandwidth()
    assert min(found.achieved, found.limit) > 0
    for simulation in simulations:
        simulation.step()
    assert np.array_equal(*(simulation.positions for simulation in simulations))


@pytest.mark.parametrize("axes", ["yz", "z", "xyz"])
def test_pins_may_take_motions_from_whole_aggregates(axes):
    """Guided sideways, or held altogether, nodes leave coarse motions that nothing can follow."""
    everywhere = tf.BoxRegion(lower=(-9, -9, -9), upper=(9, 9, 9))
    half = tf.BoxRegion(lower=(-9, -9, -9), upper=(0.5, 9, 9))
    guided = bar(pins=[tf.Pin(region=half if axes == "xyz" else everywhere, axes=axes)], velocity=(1.0, 0.0, 0.0))
    simulation = tf.Simulation(tf.Scene(bodies=[guided]))
    simulation.advance(seconds=0.1)
    assert simulation.report.converged
    moved = simulation.positions - simulation.rest_positions
    if axes == "xyz":
        free = simulation.rest_positions[:, 0] > 0.5
        assert moved[free][:, 2].min() < -1e-3 and abs(moved[~free]).max() < 1e-6
    else:
        assert moved[:, 0].mean() == pytest.approx(0.1, abs=0.02)
        assert abs(moved[:, 2]).max() < 1e-6
