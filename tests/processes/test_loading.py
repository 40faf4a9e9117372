"""Forces, tractions and pressures: their sums, their times, and what follows the surface."""

import numpy as np
import pytest

import taichifem as tf

BALL, DISK = tf.TetMesh.sphere(radius=0.5, resolution=3), tf.TriMesh.disk(radius=0.5, rings=4)
BLOCK, SHEET = tf.TetMesh.bar(size=(0.6, 0.3, 0.3), cells=(4, 2, 2)), tf.TriMesh.rectangle((0.6, 0.3), cells=(6, 3))
ALL = tf.BoxRegion(lower=(-9, -9, -9), upper=(9, 9, 9))
RIGHT = tf.BoxRegion(lower=(0.599, -1, -1), upper=(1, 1, 1))
THICKNESS = 0.2


def loaded(mesh, *, model="corotational", integrator="backward-euler", body=None, fps=60, **loads) -> tf.Simulation:
    made = tf.Body(mesh=mesh, material=tf.Material(model=model), thickness=THICKNESS, **loads, **(body or {}))
    scene = tf.Scene(bodies=[made], gravity=(0, 0, 0), integrator=integrator, fps=fps)
    return tf.Simulation(scene, precision="f64")


def outside(simulation, time=1.0) -> np.ndarray:
    """The loads on the nodes (n,3) [N] in a step that ends at `time`."""
    simulation._put_loads(time)
    return simulation._read(simulation._world.outside)


@pytest.mark.parametrize("mesh", [BLOCK, SHEET], ids=["3d", "2d"])
def test_a_force_is_shared_equally(mesh):
    simulation = loaded(mesh, forces=[tf.Force(region=RIGHT, force=(1, 0, -5))])
    got, chosen = outside(simulation), RIGHT.select(simulation.rest_positions)
    np.testing.assert_allclose(got[chosen], np.tile(np.array([1, 0, -5]) / len(chosen), (len(chosen), 1)), rtol=1e-12)
    assert np.abs(np.delete(got, chosen, axis=0)).max() == 0


@pytest.mark.parametrize(("mesh", "area"), [(BLOCK, 0.3 * 0.3), (SHEET, 0.3 * THICKNESS)], ids=["3d", "2d"])
def test_a_traction_sums_to_area_times_traction(mesh, area):
    """On the area at rest, also when the face has grown; in the middle of the face, nodes get more than at its rim."""
    simulation = loaded(mesh, tractions=[tf.Traction(region=RIGHT, traction=(100, 0, 30))])
    simulation.set_positions(1.5 * simulation.rest_positions)
    got = outside(simulation)
    np.testing.assert_allclose(got.sum(axis=0), [100 * area, 0, 30 * area], atol=1e-12)
    assert np.abs(np.delete(got, RIGHT.select(simulation.rest_positions), axis=0)).max() == 0
    x, centre = simulation.rest_positions, np.array([0.6, 0.15 * (mesh is BLOCK), 0.15])
    torque = np.cross(x - centre, got).sum(axis=0)
    np.testing.assert_allclose(torque, 0, atol=1e-10)


@pytest.mark.parametrize("mesh", [BALL, DISK, BLOCK, SHEET], ids=["ball", "disk", "block", "sheet"])
def test_a_pressure_all_around_neither_pushes_nor_turns(mesh):
    """For every shape the surface may take; it pushes inward, and its virtual work is minus p times the volume's."""
    simulation = loaded(mesh, pressures=[tf.Pressure(region=ALL, pressure=200.0)])
    axes = [0, 1, 2] if mesh.dimension == 3 else [0, 2]
    x = simulation.rest_positions
    bump = np.zeros_like(x)
    bump[:, axes] = 0.03 * np.random.default_rng(1).normal(size=(len(x), len(axes)))
    for where in (x, x + bump):
        simulation.set_positions(where)
        simulation._loaded = None
        got = outside(simulation)
        size = np.abs(got).max()
        np.testing.assert_allclose(got.sum(axis=0), 0, atol=1e-12 * size)
        np.testing.assert_allclose(np.cross(where, got).sum(axis=0), 0, atol=1e-12 * size)
        corners = where[simulation.cells][:, :, axes]
        edges = corners[:, 1:] - corners[:, :1]
        volume = np.linalg.det(edges).sum() / (6 if mesh.dimension == 3 else 2 / THICKNESS)
        # Growing evenly, a body of dimension d gains d V dx / x.
        assert (got * where).sum() == pytest.approx(-200 * mesh.dimension * volume, rel=1e-10)


@pytest.mark.parametrize("mesh", [BLOCK, SHEET], ids=["3d", "2d"])
def test_a_pressure_turns_with_the_body(mesh):
    """Where displacements are not small; a purely linear body keeps the direction at rest."""
    turn = tf.Motion(angle=(35.0,), axis=(0, 1, 0)).at(0)[0]
    for model in ("corotational", "linear"):
        simulation = loaded(mesh, model=model, pressures=[tf.Pressure(region=RIGHT, pressure=200.0)])
        area = 0.3 * (0.3 if mesh is BLOCK else THICKNESS)
        np.testing.assert_allclose(outside(simulation).sum(axis=0), [-200 * area, 0, 0], atol=1e-12)
        simulation.set_positions(simulation.rest_positions @ turn.T)
        simulation._loaded = None
        pushed = np.array([-200 * area, 0, 0])
        expected = turn @ pushed if model == "corotational" else pushed
        np.testing.assert_allclose(outside(simulation).sum(axis=0), expected, atol=1e-12)


def test_a_load_grows_stays_and_ends():
    load = tf.Force(region=ALL, force=(0, 0, 1), start=0.1, ramp=0.2, until=0.5)
    shares = [load.share_at(t) for t in (0.0, 0.1, 0.2, 0.3, 0.4, 0.5, 0.5 + 1e-6, 2.0)]
    np.testing.assert_allclose(shares, [0, 0, 0.5, 1, 1, 1, 0, 0], atol=1e-12)
    always = tf.Force(region=ALL, force=(0, 0, 1))
    assert [always.share_at(t) for t in (0.0, 1e-3, 99)] == [0, 1, 1]
    with pytest.raises(tf.InputError, match="until"):
        tf.Force(region=ALL, force=(0, 0, 1), start=2, until=1)


@pytest.mark.parametrize(
    "integrator", ["backward-euler", "backward-euler-newton", "bdf2", "newmark", "symplectic-euler"]
)
@pytest.mark.parametrize("start", [0.0, 0.1])
def test_a_force_gives_its_impulse(integrator, start):
    """A free body gains force times duration, to round-off: every step has the whole of it or nothing."""
    force = tf.Force(region=ALL, force=(3, 0, -6), start=start, until=start + 0.1)
    simulation = loaded(BLOCK, integrator=integrator, forces=[force])
    simulation.advance(seconds=0.3)
    np.testing.assert_allclose(simulation.stats.momentum, [0.3, 0, -0.6], atol=1e-10)


@pytest.mark.parametrize("mesh", [BALL, DISK], ids=["3d", "2d"])
def test_a_pressed_ball_shrinks_by_the_bulk_modulus(mesh):
    """Small pressure all around, static: p = K dV/V in space, (lambda + mu) dA/A in plane strain."""
    pressure = tf.Pressure(region=ALL, pressure=100.0)
    loose = tf.Handle(region=ALL, stiffness=1e-3)
    simulation = loaded(mesh, integrator="quasi-static", pressures=[pressure], body={"handles": [loose]})
    simulation.step()
    material = tf.Material()
    stiffness = material.lame_lambda + material.shear_modulus * (2 / 3 if mesh.dimension == 3 else 1)
    now, rest = (np.ptp(a, axis=0)[[0, 2]] for a in (simulation.positions, simulation.rest_positions))
    assert mesh.dimension * (1 - now / rest) == pytest.approx(100 / stiffness, rel=1e-3)
