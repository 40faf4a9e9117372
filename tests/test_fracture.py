"""Bodies that break: when, where, and what must stay as it was."""

import numpy as np
import pytest
from convergence import box
from mechanics import tear

import taichifem as tf
from taichifem.mesh.connectivity import boundary_faces, pieces

SIZE = (1.0, 0.25, 0.25)


def notched(cells=(16, 4, 4)) -> tf.TetMesh:
    """A bar with a slot halfway, half through from above."""
    bar = tf.TetMesh.bar(size=SIZE, cells=cells)
    middle = bar.points[bar.cells].mean(axis=1)
    keep = ~((abs(middle[:, 0] - 0.5) < 1 / 16) & (middle[:, 2] > 0.12))
    used, cells = np.unique(bar.cells[keep], return_inverse=True)
    return tf.TetMesh(bar.points[used], cells.reshape(-1, 4))


def stretched(mesh, material: tf.Material, *, axes="xyz", speed=0.05, **options) -> tf.Simulation:
    """Both ends held, one drawn along x."""
    draw = tf.Motion(times=(0, 10), translation=((0, 0, 0), (10 * speed, 0, 0)))
    pins = [tf.Pin(region=box(upper=(1e-6, 1e3, 1e3)), axes=axes)]
    pins += [tf.Pin(region=box(lower=(SIZE[0] - 1e-6, -1e3, -1e3)), axes=axes, motion=draw)]
    if axes == "x":  # what is left of a rigid motion
        pins += [tf.Pin(region=tf.NearestRegion(point=(0, 0, 0)), axes="yz")]
        pins += [tf.Pin(region=tf.NearestRegion(point=(0, SIZE[1], 0)), axes="z")]
    body = tf.Body(mesh=mesh, material=material, pins=pins)
    return tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0), **options))


def material(toughness: float, **changes) -> tf.Material:
    given = dict(youngs=1e6, poisson=0.3, mass_damping=20.0, stiffness_damping=0.01)
    return tf.Material(**given | changes, fracture=tf.Fracture(toughness=toughness))


def assert_sound(simulation: tf.Simulation) -> None:
    """A valid mesh that is the scene's own, cut: closed, oriented, no node without element."""
    cells, n = simulation.cells, len(simulation.positions)
    mesh = simulation.scene.bodies[0].mesh
    np.testing.assert_array_equal(simulation.origins[cells], mesh.cells)
    np.testing.assert_array_equal(np.unique(cells), np.arange(n))
    faces, _ = boundary_faces(cells)
    directed = np.concatenate([faces[:, [a, (a + 1) % 3]] for a in range(3)])
    assert np.array_equal(np.sort(directed @ (n, 1)), np.sort(directed[:, ::-1] @ (n, 1)))
    assert len(simulation.surface) == len(faces) == len(simulation.crack_faces)
    assert len(faces) - simulation.crack_faces.sum() == len(mesh.surface())
    assert simulation.piece_count == pieces(cells, n)[0] == simulation.cell_pieces.max() + 1


def watch(simulation: tf.Simulation, seconds: float) -> int:
    """Run, and look at every split that comes; how many there were."""
    total, reshape = 0, simulation._reshape
    mass = simulation.masses.sum()
    before = {}

    def remember(parent):
        v = simulation.velocities
        before["momentum"] = (simulation.masses[:, None] * v).sum(axis=0)
        before["v"] = v[parent], simulation.positions[parent]
        reshape(parent)

    simulation._reshape = remember
    for _ in range(round(seconds / simulation.dt)):
        simulation.step()
        total += simulation.splits
        if simulation.splits:
            assert_sound(simulation)
            m, v = simulation.masses, simulation.velocities
            assert m.sum() == pytest.approx(mass, rel=1e-6)
            np.testing.assert_array_equal(v, before["v"][0])
            np.testing.assert_array_equal(simulation.positions, before["v"][1])
            moved = (m[:, None] * v).sum(axis=0) - before["momentum"]
            assert abs(moved).max() < 1e-6 * mass * abs(v).max()
    simulation._reshape = reshape
    return total


def test_a_bar_parts_when_the_stress_reaches_its_toughness():
    bar = tf.TetMesh.bar(size=SIZE, cells=(8, 2, 2))
    simulation = stretched(bar, material(1e5), axes="x")
    applied = 0.0
    while not simulation.splits:
        applied = simulation.cauchy_stress()[:, 0, 0].mean()
        simulation.step()
        assert simulation.time < 4
    assert applied == pytest.approx(1e5, rel=0.05)
    for _ in range(60):
        simulation.step()
    assert simulation.piece_count > 1
    assert_sound(simulation)
    assert simulation.von_mises().max() < 1e5


def test_a_notched_bar_breaks_at_the_notch():
    simulation = stretched(notched(), material(1e5))
    assert watch(simulation, 3.5) > 10
    assert simulation.piece_count >= 2
    opened = simulation.surface[simulation.crack_faces]
    where = simulation.rest_positions[np.unique(opened), 0]
    assert abs(where - 0.5).max() < 0.2 and simulation.crack_faces.any()
    left, right = (
        simulation.cell_pieces[np.argmin(simulation.rest_positions[simulation.cells[:, 0], 0] * s)] for s in (1, -1)
    )
    assert left != right


def test_a_tough_bar_stays_whole():
    simulation = stretched(notched(), material(1e9))
    assert watch(simulation, 1.0) == 0
    assert simulation.piece_count == 1 and not simulation.crack_faces.any()


def test_the_seed_tells_which_pieces_come():
    ends = []
    for seed in (1, 1, 2):
        simulation = stretched(notched(), material(4e4), speed=0.1, seed=seed)
        simulation.advance(seconds=1.5)
        assert simulation.piece_count > 1
        ends.append((simulation.cells, simulation.positions))
        del simulation  # the next one takes its world, which is compiled
    np.testing.assert_array_equal(ends[0][0], ends[1][0])
    np.testing.assert_array_equal(ends[0][1], ends[1][1])
    assert ends[2][0].shape != ends[0][0].shape or (ends[2][0] != ends[0][0]).any()


def test_a_checkpoint_holds_the_cracks(tmp_path):
    first, second = (stretched(notched(), material(1e5)) for _ in range(2))
    while not first.splits:
        first.step()
    first.save(tmp_path / "state.npz")
    second.load(tmp_path / "state.npz")
    for simulation in (first, second):
        simulation.advance(seconds=0.5)
    assert len(first.positions) > len(first.scene.bodies[0].mesh.points)
    np.testing.assert_array_equal(first.cells, second.cells)
    np.testing.assert_array_equal(first.positions, second.positions)
    fresh = stretched(notched(), material(1e5))
    fresh.save(tmp_path / "whole.npz")
    first.load(tmp_path / "whole.npz")
    assert len(first.positions) == len(fresh.positions) and first.piece_count == 1


def test_a_ductile_bar_flows_before_it_breaks():
    ductile = material(1.3e5, plasticity="von-mises", yield_stress=6e4, hardening=3e5)
    simulation = stretched(notched(), ductile)
    while not simulation.splits:
        flowed = simulation.equivalent_plastic_strain()
        simulation.step()
        assert simulation.time < 6
    opened = np.unique(simulation.surface[simulation.crack_faces])
    near = np.isin(simulation.cells, opened).any(axis=1)
    assert flowed[near].max() > 0.01 and flowed[near].mean() > 10 * flowed[~near].mean()


def test_loads_keep_their_sum_when_their_nodes_are_split():
    mesh = tf.TetMesh.bar(size=SIZE, cells=(8, 2, 2))
    end = box(lower=(SIZE[0] - 1e-6, -1e3, -1e3))
    loads = dict(
        forces=[tf.Force(region=end, force=(100, 0, 0))],
        tractions=[tf.Traction(region=end, traction=(1e4, 0, 0))],
        pressures=[tf.Pressure(region=end, pressure=-3e4)],
        handles=[tf.Handle(region=end, stiffness=100.0)],
    )
    body = tf.Body(mesh=mesh, material=material(1e9), pins=[box(upper=(1e-6, 1e3, 1e3))], **loads)
    simulation = tf.Simulation(tf.Scene(bodies=[body], gravity=(0, 0, 0)))
    before = simulation._loading.forces(lambda _: 1.0).sum(axis=0)
    for k in range(12):
        at_end = simulation.rest_positions[:, 0] > SIZE[0] - 1e-6
        torn = np.flatnonzero(at_end[simulation.cells].any(axis=1))
        tear(simulation, torn, np.random.default_rng(k).normal(size=3), seed=k)
    assert (simulation.rest_positions[:, 0] > SIZE[0] - 1e-6).sum() > 12
    np.testing.assert_allclose(simulation._loading.forces(lambda _: 1.0).sum(axis=0), before, rtol=1e-12, atol=1e-9)
    (handle,) = simulation._layout.handles
    assert len(handle.nodes) * handle.stiffness == pytest.approx(100.0)


@pytest.mark.parametrize("model", ["corotational", pytest.param("neo-hookean", marks=pytest.mark.slow)])
def test_to_complete_fragmentation(model):
    """So weak that in the end nearly every element is on its own."""
    mesh = tf.TetMesh.bar(size=(0.5, 0.25, 0.25), cells=(4, 2, 2))
    body = tf.Body(mesh=mesh, material=material(1.0, model=model, youngs=1e5), position=(0, 0, 0.5), spin=(0, 9, 0))
    scene = tf.Scene(bodies=[body], colliders=[tf.PlaneCollider()], max_splits=1000)
    simulation = tf.Simulation(scene)
    watch(simulation, 2.0)
    assert simulation.piece_count > 0.9 * len(mesh.cells)
    assert np.isfinite(simulation.positions).all() and simulation.positions[:, 2].min() > -0.05


def test_triangles_break_too():
    mesh = tf.TriMesh.rectangle(size=(1.0, 0.25), cells=(16, 4))
    simulation = stretched(mesh, material(1e5), axes="xz")
    simulation.advance(seconds=3.5)
    assert simulation.piece_count > 1 and np.isfinite(simulation.positions).all()


def test_what_makes_no_sense_is_refused():
    with pytest.raises(tf.InputError, match="toughness is -1"):
        tf.Fracture(toughness=-1.0)
    body = tf.Body(mesh=tf.TetMesh.bar(cells=(4, 1, 1)), material=material(1e5))
    with pytest.raises(tf.InputError, match="quasi-static"):
        tf.Scene(bodies=[body], integrator="quasi-static")
    whole = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=body.mesh)]))
    with pytest.raises(tf.InputError, match="no material of the scene breaks"):
        whole.set_material(0, material(1e5))
