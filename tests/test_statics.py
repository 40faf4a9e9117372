"""Static solves against independent codes and closed forms, and what happens where there is no balance."""

import json

import numpy as np
import pytest
from convergence import box

import taichifem as tf
from taichifem.statics import solve_static, static_scene

SLOW = pytest.mark.slow
LAWS = {"linear": "linear", "stvk": "stvk", "corotational": "corotated", "neo-hookean": "stable_neohookean"}
END = box(lower=(1 - 1e-6, -1e3, -1e3))
CUBE = (1, 1, 1)


def relative(got: np.ndarray, expected: np.ndarray) -> float:
    return float(np.abs(got - expected).max() / np.abs(expected).max())


def simulation_of(body: tf.Body, *, gravity=(0.0, 0.0, 0.0), **scene) -> tf.Simulation:
    return tf.Simulation(static_scene(tf.Scene(bodies=[body], gravity=gravity, **scene)), precision="f64")


def on_rollers(cells=CUBE, size=(1.0, 1.0, 1.0), *, pins=(), **body) -> tf.Body:
    """A block that slides along the three planes it stands on: what is uniform stays uniform."""
    rollers = [
        tf.Pin(region=box(upper=tuple(1e-6 if a == k else 1e3 for a in range(3))), axes="xyz"[k]) for k in range(3)
    ]
    return tf.Body(mesh=tf.TetMesh.bar(size=size, cells=cells), pins=[*rollers, *pins], **body)


def bar(*, motion=None, **body) -> tf.Body:
    """Clamped at x = 0; its other end, at x = 1, is moved if there is a motion."""
    pins = [box(upper=(1e-6, 1e3, 1e3))] + ([tf.Pin(region=END, motion=motion)] if motion else [])
    return tf.Body(mesh=tf.TetMesh.bar(size=(1, 0.25, 0.25), cells=(8, 2, 2)), pins=pins, **body)


def shift(x: float, z: float = 0.0) -> tf.Motion:
    return tf.Motion(times=(0, 1), translation=((0, 0, 0), (x, 0, z)))


@pytest.mark.parametrize("case", range(4))
@pytest.mark.parametrize(
    "mesh", ("bar12x3x3", pytest.param("polyfem_bar-651", marks=SLOW), pytest.param("bullet_torus", marks=SLOW))
)
def test_linear_displacement_matches_scikit_fem(oracles, mesh, case):
    data = np.load(oracles / f"linear_{mesh}.npz")
    youngs, poisson, density = (float(data[name][case]) for name in ("E", "nu", "rho"))
    material = tf.Material(model="linear", youngs=youngs, poisson=poisson, density=density)
    held = tf.IndexRegion(indices=data["fixed"].tolist())
    body = tf.Body(mesh=tf.TetMesh(data["X"], data["T"]), material=material, pins=[held])
    simulation = simulation_of(body, gravity=tuple(data["gravity"]))
    result = solve_static(simulation)
    assert result.converged and result.linearisations <= 3
    assert relative(simulation.positions - data["X"], data["u_static"][case]) < 1e-9


def hanging_bar(oracles, case: int, **law) -> tuple[tf.Simulation, dict]:
    data = np.load(oracles / "large_deflection_bar.npz")
    known = json.loads((oracles / "large_deflection_bar.json").read_text())["cases"][case]
    material = tf.Material(youngs=known["E"], poisson=known["nu"], density=known["rho"], **law)
    held = tf.IndexRegion(indices=data["fixed"].tolist())
    body = tf.Body(mesh=tf.TetMesh(data["X"], data["T"]), material=material, pins=[held])
    return simulation_of(body, gravity=tuple(data["gravity"])), data


@pytest.mark.parametrize("case", (0, 1))
@pytest.mark.parametrize("model", LAWS)
def test_large_deflection_matches_independent_codes(oracles, model, case):
    simulation, data = hanging_bar(oracles, case, model=model)
    assert solve_static(simulation).converged
    assert relative(simulation.positions - data["X"], data[f"u_{LAWS[model]}_{case}"]) < 1e-8


@pytest.mark.slow
@pytest.mark.parametrize("model", ("stvk", "corotational", "neo-hookean"))
def test_invertible_is_the_law_it_wraps_where_nothing_is_crushed(oracles, model):
    simulation, data = hanging_bar(oracles, 0, model="invertible", wraps=model)
    assert solve_static(simulation).converged
    assert relative(simulation.positions - data["X"], data[f"u_{LAWS[model]}_0"]) < 1e-8


@pytest.mark.parametrize("model", ("stvk", "corotational"))
def test_newton_converges_quadratically(oracles, model):
    """The exponent p of e' = c e^p over the last steps above round-off."""
    simulation, _ = hanging_bar(oracles, 0, model=model)
    result = solve_static(simulation, tolerance=1e-11)
    errors = np.array([i.imbalance for i in result.steps[-1].iterations])
    errors = np.log(errors[errors > 1e-10][-3:])
    assert errors[0] < np.log(0.01)
    assert (errors[2] - errors[1]) / (errors[1] - errors[0]) > 1.6


@pytest.mark.parametrize("model", ("stvk", "corotational", "neo-hookean"))
def test_uniaxial_stretch(oracles, model):
    tables = json.loads((oracles / "uniaxial_stress.json").read_text())["tables"]
    checked = 0
    for table in (t for t in tables if t["law"] == LAWS[model]):
        material = tf.Material(model=model, youngs=table["E"], poisson=table["nu"])
        for stretch, lateral, stress, *_ in (r for r in table["rows"] if r[0] in (0.6, 0.8, 1.2, 1.75)):
            pull = tf.Pin(region=END, axes="x", motion=shift(stretch - 1))
            simulation = simulation_of(on_rollers(material=material, pins=[pull]))
            assert solve_static(simulation).converged
            np.testing.assert_allclose(simulation.positions[:, 1:].max(axis=0), lateral, rtol=1e-8)
            force = simulation.reactions()[simulation.rest_positions[:, 0] > 0.5, 0].sum()
            assert force == pytest.approx(stress, rel=1e-8)
            checked += 1
            del simulation
    assert checked == 8


def test_uniaxial_traction():
    """St. Venant-Kirchhoff under the nominal stress E (l^3 - l) / 2 has the stretch l."""
    load = tf.Traction(region=END, traction=(1e5 * (1.4**3 - 1.4) / 2, 0, 0))
    body = on_rollers(material=tf.Material(model="stvk", youngs=1e5, poisson=0.3), tractions=[load])
    simulation = simulation_of(body)
    assert solve_static(simulation).converged
    assert simulation.positions[:, 0].max() == pytest.approx(1.4, rel=1e-8)


def test_reactions_balance_the_loads():
    """Force, traction, pressure on the bent surface and weight: their sums and moments, added up independently."""
    loads = {
        "forces": [tf.Force(region=tf.NearestRegion(point=(1, 0, 0), count=3), force=(3.0, -8.0, 5.0))],
        "tractions": [tf.Traction(region=END, traction=(50.0, 100.0, -200.0))],
        "pressures": [tf.Pressure(region=box(lower=(-1, -1, 0.25 - 1e-6)), pressure=300.0)],
    }
    material = tf.Material(model="stvk", youngs=1e5, poisson=0.3, density=100.0)
    simulation = simulation_of(bar(material=material, **loads), gravity=(0.0, 2.0, -9.81))
    assert solve_static(simulation, tolerance=1e-12).converged
    rest, x = simulation.rest_positions, simulation.positions
    assert np.abs(x - rest).max() > 0.1
    applied = simulation.masses[:, None] * (0.0, 2.0, -9.81)
    applied[np.argsort(np.linalg.norm(rest - (1, 0, 0), axis=1), kind="stable")[:3]] += np.array([3.0, -8.0, 5.0]) / 3
    for face in simulation.surface:
        if (rest[face, 0] > 1 - 1e-6).all():
            applied[face] += np.array([50.0, 100.0, -200.0]) * (0.125**2 / 2) / 3
        if (rest[face, 2] > 0.25 - 1e-6).all():
            a, b, c = x[face]
            applied[face] -= 300.0 * np.cross(b - a, c - a) / 2 / 3
    reactions = simulation.reactions()
    size = np.abs(reactions).sum()
    assert np.abs((reactions + applied).sum(axis=0)).max() < 1e-9 * size
    assert np.abs(np.cross(x, reactions + applied).sum(axis=0)).max() < 1e-9 * size
    assert np.abs(reactions[rest[:, 0] > 1e-6]).max() < 1e-9 * size


def test_no_load_is_balanced_at_once():
    simulation = simulation_of(on_rollers(material=tf.Material(model="stvk")))
    result = solve_static(simulation)
    assert result.converged and result.linearisations == 2
    assert np.abs(simulation.positions - simulation.rest_positions).max() < 1e-12


def test_load_steps_where_one_go_fails():
    """In one go it takes ten linearisations; with fewer allowed, half the way and then the rest."""
    body = bar(material=tf.Material(model="neo-hookean", youngs=1e5, poisson=0.3), motion=shift(-0.4, 0.6))
    told = []
    simulation = simulation_of(body)
    result = solve_static(simulation, max_newton=8, on_step=told.append)
    assert result.converged and told == result.steps
    assert not told[0].converged and told[0].share == 1.0
    assert told[-1].converged and told[-1].share == 1.0 and any(s.converged and s.share < 1 for s in told)
    held = (np.abs(simulation.rest_positions[:, 0] - 0.5) > 0.499).nonzero()
    reactions = simulation.reactions()
    assert np.abs(np.delete(reactions, held, axis=0)).max() < 1e-8 * np.abs(reactions).max()


def test_twist_goes_the_way_the_pin_turns():
    """Three quarters of a turn, and not one back: the middle has turned by half of it."""
    turn = tf.Motion(times=(0, 1), angle=(0, 270), axis=(1, 0, 0), center=(0, 0.125, 0.125))
    simulation = simulation_of(bar(material=tf.Material(model="neo-hookean", youngs=1e5, poisson=0.3), motion=turn))
    assert solve_static(simulation).converged
    rest, x = simulation.rest_positions, simulation.positions
    corner = np.flatnonzero((rest == (0.5, 0.0, 0.0)).all(axis=1)).item()
    before, after = (np.arctan2(p[corner, 2] - 0.125, p[corner, 1] - 0.125) for p in (rest, x))
    assert np.degrees(after - before) % 360 == pytest.approx(135, abs=5)


@pytest.mark.parametrize("load", ("traction", "gravity"))
def test_load_beyond_the_limit(load):
    """St. Venant-Kirchhoff bears E / (3 sqrt 3) in compression and no more; what is left is the last balance."""
    E, wanted = 1e5, 4e4
    material = tf.Material(model="stvk", youngs=E, poisson=0.3, density=1000.0)
    press = [tf.Traction(region=END, traction=(-wanted, 0, 0))] if load == "traction" else []
    body = on_rollers(material=material, tractions=press)
    simulation = simulation_of(body, gravity=(0.0 if press else -wanted / 500, 0, 0))
    result = solve_static(simulation, max_newton=15)
    assert not result.converged and 0 < result.share < 1
    assert result.share == max(step.share for step in result.steps if step.converged)
    x, reactions, total = simulation.positions, simulation.reactions(), wanted * (1 if press else 2) * result.share
    on_floor = simulation.rest_positions[:, 0] < 1e-6
    assert len(simulation.turned_inside_out()) == 0
    assert reactions[on_floor, 0].sum() == pytest.approx(total, rel=1e-8)
    assert np.abs(reactions[~on_floor, 0]).max() < 1e-8 * total
    if press:
        limit = E / (3 * 3**0.5) / wanted
        assert limit - 1 / 512 < result.share < limit
        stretch = x[:, 0].max()
        assert E / 2 * (stretch**3 - stretch) == pytest.approx(-total, rel=1e-8)


def test_body_without_support_is_refused_by_name():
    mesh = tf.TetMesh.bar(size=(1, 0.25, 0.25), cells=(8, 2, 2))
    hinge = tf.Body(mesh=mesh, name="flap", pins=[box(upper=(1e-6, 1e-6, 1e3))])
    for scene in (tf.Scene(bodies=[hinge]), tf.Scene(bodies=[bar(name="held"), tf.Body(mesh=mesh, name="flap")])):
        with pytest.raises(tf.InputError, match=r"body\.flap can shift or turn"):
            tf.Simulation(static_scene(scene), precision="f64")


def test_moving_scene_is_refused():
    simulation = tf.Simulation(tf.Scene(bodies=[bar()]), precision="f64")
    with pytest.raises(tf.InputError, match="quasi-static"):
        solve_static(simulation)


def test_linear_scene_is_hooke_throughout():
    mesh = tf.TetMesh.bar(size=(1, 1, 1), cells=(1, 1, 1))
    mesh = tf.TetMesh(mesh.points, mesh.cells, regions=[0, 0, 0, 0, 1])
    springs = tf.Material(model="mass-spring", spring_stiffness=10.0)
    scene = static_scene(tf.Scene(bodies=[tf.Body(mesh=mesh, materials={1: springs})]), linear=True)
    assert scene.integrator == "quasi-static"
    assert [scene.bodies[0].material.model, scene.bodies[0].materials[1].model] == ["linear", "linear"]


def test_linear_elements_never_count_as_inside_out():
    mesh = tf.TetMesh.bar(size=(1, 1, 1), cells=(1, 1, 1))
    mesh = tf.TetMesh(mesh.points, mesh.cells, regions=[0, 1, 0, 0, 0])
    linear, stvk = tf.Material(model="linear"), tf.Material(model="stvk")
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=mesh, material=linear, materials={1: stvk})]))
    assert len(simulation.turned_inside_out()) == 0
    simulation.set_positions(simulation.rest_positions * (1, 1, -1))
    assert simulation.turned_inside_out().tolist() == [1]


@pytest.mark.parametrize(("youngs", "fps"), [(1e5, 60), (2e11, 600)])
def test_plane_presses_a_held_block(youngs, fps):
    """Force of the plane = reaction of the floor = E A times the strain; how stiff or quick it is makes no odds."""
    mesh = tf.TetMesh.bar(size=(0.2, 0.2, 0.4), cells=(2, 2, 4))
    material = tf.Material(model="linear", youngs=youngs, poisson=0.0)
    body = tf.Body(mesh=mesh, material=material, pins=[box(upper=(1e3, 1e3, 1e-6))])
    plane = tf.PlaneCollider(point=(0, 0, 0.4), normal=(0, 0, -1), friction=0, motion=shift(0, -0.01))
    simulation = simulation_of(body, colliders=[plane], fps=fps)
    assert solve_static(simulation).converged
    rest, x, reactions = simulation.rest_positions, simulation.positions, simulation.reactions()
    top, bottom = rest[:, 2] > 0.4 - 1e-6, rest[:, 2] < 1e-6
    assert simulation.contacts == top.sum() == 9
    force = reactions[bottom, 2].sum()
    assert reactions[top, 2].sum() == pytest.approx(-force, rel=1e-8)
    assert np.abs(reactions[~top & ~bottom]).max() < 1e-8 * force
    assert force == pytest.approx(youngs * 0.2**2 * 0.01 / 0.4, rel=0.02)
    assert 0 < (x[top, 2] - 0.39).max() < 2e-4


@pytest.mark.slow
def test_springs_hold_a_hanging_weight():
    points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0.3, 0.3, 1.0]])
    pull = tf.Force(region=tf.IndexRegion(indices=[3]), force=(20.0, -10.0, 60.0))
    body = tf.Body(
        mesh=tf.TetMesh(points, [[0, 1, 2, 3]]),
        material=tf.Material(model="mass-spring", spring_stiffness=100.0),
        pins=[tf.IndexRegion(indices=[0, 1, 2])],
        forces=[pull],
    )
    simulation = simulation_of(body)
    assert solve_static(simulation, tolerance=1e-11).converged
    arms = simulation.positions[3] - points[:3]
    lengths, rest = np.linalg.norm(arms, axis=1), np.linalg.norm(points[3] - points[:3], axis=1)
    np.testing.assert_allclose((100.0 * (lengths - rest) / lengths) @ arms, (20, -10, 60), rtol=1e-8)
