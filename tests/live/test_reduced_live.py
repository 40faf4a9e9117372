"""Bodies of few unknowns, acted upon while they run: over the socket, and without it."""

import dataclasses

import numpy as np
import pytest
from serving import Client, Serving

import taichifem as tf
from taichifem import InputError
from taichifem.live.interactions import Interactions
from taichifem.live.panel import panel, tools_offered
from taichifem.live.replay import Replay
from taichifem.live.stage import Stage
from taichifem.scene.writing import write_scene

BAR = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(6, 2, 2))
WALL = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))
INTEGRATORS = {"bem": "quasi-static", "condensed": "backward-euler", "modal": "backward-euler"}
TIP = int(np.argmax(BAR.points @ (1, 0.01, 0.01)))


def scene_of(model, **changes):
    material = tf.Material(model=model, youngs=2e5, poisson=0.3, **changes)
    return tf.Scene(
        name="bar",
        bodies=[tf.Body(mesh=BAR, material=material, pins=[WALL], name="bar")],
        gravity=(0, 0, 0),
        integrator=INTEGRATORS[model],
        view=tf.View(color="von-mises"),
    )


def far(simulation, node=TIP):
    return (simulation.positions - simulation.rest_positions)[node]


def rows_of(groups):
    return [row["path"] for group in groups for row in group["rows"]]


@pytest.fixture(scope="module", params=list(INTEGRATORS))
def stage(request):
    return Stage(scene_of(request.param, **({} if request.param == "bem" else {"mass_damping": 20.0})))


@pytest.fixture(autouse=True)
def again(request):
    if "stage" in request.fixturenames:
        request.getfixturevalue("stage").reset(parameters_too=True)


def run(stage, steps):
    for _ in range(steps):
        stage.step()


def test_a_spring_pulls_by_its_stiffness_and_lets_go(stage):
    """In balance k (target - x) is what bends the bar: twice as far for twice the offset, and back without."""
    stage.do({"do": "grab", "hand": "a", "node": TIP, "stiffness": 50.0, "radius": 0.0})
    ends = []
    for offset in (0.05, 0.1):
        stage.do({"do": "drag", "hand": "a", "offset": (0, 0, offset)})
        run(stage, 120)
        ends.append(far(stage.simulation)[2])
    assert 0.001 < ends[0] < 0.05 and ends[1] == pytest.approx(2 * ends[0], rel=0.05)
    stage.do({"do": "release", "hand": "a"})
    run(stage, 120)
    assert abs(far(stage.simulation)[2]) < 0.02 * ends[1]


def test_a_pin_holds_where_it_took_hold_and_follows(stage):
    stage.do({"do": "pin", "hand": "a", "node": TIP, "radius": 0.0})
    stage.do({"do": "poke", "node": TIP, "impulse": (0, 0, 2.0), "radius": 0.1})
    run(stage, 30)
    assert np.abs(far(stage.simulation)).max() < 2e-3
    stage.do({"do": "drag", "hand": "a", "offset": (0, 0.01, 0.02)})
    run(stage, 60)
    np.testing.assert_allclose(far(stage.simulation), (0, 0.01, 0.02), atol=1e-3)


def test_a_poke_dents_and_is_forgotten(stage):
    stage.do({"do": "poke", "node": TIP, "impulse": (0, 0, -0.5), "radius": 0.1})
    reached = []
    for _ in range(240):
        stage.step()
        reached.append(far(stage.simulation)[2])
    assert min(reached) < -1e-3
    assert abs(reached[-1]) < 0.03 * max(map(abs, reached))


def test_what_was_done_is_done_again(stage, tmp_path):
    stage.do({"do": "grab", "hand": "a", "node": TIP, "stiffness": 200.0, "radius": 0.1})
    for k in range(10):
        stage.do({"do": "drag", "hand": "a", "offset": (0, 0, 0.01 * k)})
        stage.step()
    stage.do({"do": "set", "path": "body.0.material.youngs", "value": 4e5})
    run(stage, 5)
    stage.do({"do": "poke", "node": TIP, "impulse": (0, 0.3, 0), "radius": 0.1})
    run(stage, 5)
    wanted = stage.simulation.positions
    stage.done.write(tmp_path / "done.json")
    stage.reset(parameters_too=True)
    replay = Replay(stage, Interactions.read(tmp_path / "done.json"))
    while replay.step_count < 20:
        replay.advance_frame()
    # Young's modulus goes there and back by round-off.
    np.testing.assert_allclose(stage.simulation.positions, wanted, atol=1e-9)


def test_twice_as_stiff_gives_way_half_as_far(stage):
    stage.do({"do": "set", "path": "simulation.gravity.z", "value": -9.81})
    sag = []
    for youngs in (4e5, 8e5):
        stage.do({"do": "set", "path": "body.0.material.youngs", "value": youngs})
        run(stage, 240)
        sag.append(far(stage.simulation)[2])
    assert sag[0] < 0 and sag[1] == pytest.approx(sag[0] / 2, rel=0.05)
    assert stage.simulation.scene.bodies[0].material.youngs == 8e5


def test_a_stiffer_body_is_the_one_made_that_stiff(stage):
    """Nothing of the old modulus is left: shape, stress and energy of a simulation made with the new one."""
    stage.do({"do": "set", "path": "body.0.material.youngs", "value": 6e5})
    stage.do({"do": "set", "path": "simulation.gravity.z", "value": -9.81})
    fresh = Stage(stage.scene)
    run(stage, 3), run(fresh, 3)
    size = np.abs(far(fresh.simulation, slice(None))).max()
    # The last mode kept is one of a pair that the square section has, either of them.
    np.testing.assert_allclose(stage.simulation.positions, fresh.simulation.positions, atol=1e-3 * size)
    stress = fresh.simulation.von_mises()
    np.testing.assert_allclose(stage.simulation.von_mises(), stress, atol=1e-2 * stress.max())
    assert stage.simulation.elastic_energy() == pytest.approx(fresh.simulation.elastic_energy(), rel=1e-3)


def test_what_reduced_bodies_have_not_is_absent_and_refused(stage):
    shown = rows_of(panel(stage.scene, stage.tools))
    assert "throw" not in tools_offered(stage.scene)
    assert "body.0.material.youngs" in shown and "tools.strength" in shown
    assert not {"body.0.material.toughness", "body.0.material.poisson", "simulation.solver", "tools.ball_speed"} & {
        *shown
    }
    actions = [
        {"do": "set", "path": f"body.0.material.{name}", "value": v}
        for name, v in (("toughness", 1e5), ("poisson", 0.1))
    ]
    actions += [{"do": "set", "path": "simulation.substeps", "value": 3}]
    actions += [{"do": "throw", "origin": (0, 0, 1), "velocity": (0, 0, -1), "radius": 0.1}]
    for action in actions:
        with pytest.raises(InputError, match="reduced models") as caught:
            stage.do(action)
        assert "\n" not in str(caught.value)


def test_a_kept_state_comes_back(stage):
    stage.do({"do": "poke", "node": TIP, "impulse": (0, 0, 0.5), "radius": 0.1})
    run(stage, 5)
    kept, wanted = stage.keep(), stage.simulation.positions
    stage.do({"do": "set", "path": "body.0.material.youngs", "value": 4e5})
    run(stage, 5)
    stage.back(kept)
    np.testing.assert_array_equal(stage.simulation.positions, wanted)
    assert stage.scene.bodies[0].material.youngs == 2e5


def test_full_models_still_need_time():
    scene = scene_of("bem")
    body = dataclasses.replace(scene.bodies[0], material=tf.Material())
    with pytest.raises(InputError, match="quasi-static"):
        Stage(dataclasses.replace(scene, bodies=[body]))


@pytest.fixture(scope="module")
def served(tmp_path_factory):
    folder = tmp_path_factory.mktemp("reduced")
    write_scene(scene_of("bem"), folder / "bar.toml")
    made = Serving("bar.toml", folder)
    yield made
    said = made.close()
    assert "Traceback" not in said, said


def test_boundary_elements_over_the_socket(served):
    """Pull, pin, poke, pause, step and reset, with pictures of the stress."""
    with Client(served.url) as client:
        client.until(lambda: client.updates > 2 and "panel" in client.last)
        assert client.last["bar"]["label"] == "von Mises stress"
        assert "body.0.material.toughness" not in rows_of(client.last["panel"]["groups"])
        tip = int(np.flatnonzero(client.topology[1] == TIP)[0])
        rest = client.points[tip].copy()

        def raised():
            return float(client.points[tip, 2] - rest[2])

        client.send(do="grab", hand="a", node=TIP, stiffness=500.0, radius=0.1)
        client.send(do="drag", hand="a", offset=[0, 0, 0.1])
        client.until(lambda: raised() > 0.01)
        client.until(lambda: client.last.get("figures", {}).get("stress", 0) > 100)
        client.send(do="release", hand="a")
        client.until(lambda: abs(raised()) < 1e-6)
        client.send(do="pin", hand="b", node=TIP, radius=0.05)
        client.send(do="drag", hand="b", offset=[0, 0, -0.03])
        client.until(lambda: raised() == pytest.approx(-0.03, abs=1e-5))
        client.send(do="release", hand="b")
        client.until(lambda: abs(raised()) < 1e-6)
        client.send(ask="pause")
        client.send(do="poke", node=TIP, impulse=[0, 0, -3.0], radius=0.1)
        client.until(lambda: client.last["state"]["paused"])
        for _ in range(9):
            client.send(ask="step")
        client.until(lambda: raised() < -0.01)
        client.send(ask="reset")
        client.until(lambda: client.time == 0 and abs(raised()) < 1e-6)
        client.send(do="set", path="body.0.material.toughness", value=1e5)
        client.until(lambda: any("reduced models" in text for text in client.notices))
