"""Acting on a scene while it runs, and doing the same again."""

import dataclasses
import json

import numpy as np
import pytest

import taichifem as tf
from taichifem import InputError
from taichifem.live.interactions import Interactions
from taichifem.live.replay import Replay
from taichifem.live.stage import Stage

WALL = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))


def scene(**changes):
    bar = tf.TetMesh.bar(size=(0.6, 0.2, 0.2), cells=(6, 2, 2))
    material = tf.Material(youngs=1e5, poisson=0.3, stiffness_damping=0.02)
    ground = tf.PlaneCollider(point=(0, 0, -0.6))
    made = tf.Scene(bodies=[tf.Body(mesh=bar, material=material, pins=[WALL], name="bar")], colliders=[ground])
    return dataclasses.replace(made, **changes)


def tip_of(simulation):
    return int(np.argmax(simulation.rest_positions @ (1, 0.01, 0.01)))


def run(stage, frames):
    for _ in range(frames):
        stage.step()


def set_(stage, path, value):
    stage.do({"do": "set", "path": path, "value": value})


def test_a_change_acts_at_the_next_step_and_sag_follows_stiffness():
    stage = Stage(scene())
    tip = tip_of(stage.simulation)
    sag = []
    for youngs in (2e5, 4e5):
        set_(stage, "body.0.material.youngs", youngs)
        run(stage, 240)
        sag.append(-(stage.simulation.positions - stage.simulation.rest_positions)[tip, 2])
    assert sag[0] / sag[1] == pytest.approx(2.0, rel=0.03)
    set_(stage, "simulation.gravity.z", 0.0)
    run(stage, 240)
    np.testing.assert_allclose(stage.simulation.positions, stage.simulation.rest_positions, atol=1e-4)


def test_what_was_done_is_done_again_with_the_same_result(tmp_path):
    stage = Stage(scene())
    tip = tip_of(stage.simulation)
    run(stage, 5)
    stage.do({"do": "grab", "hand": "a", "node": tip, "stiffness": 500.0, "radius": 0.15})
    for k in range(10):
        stage.do({"do": "drag", "hand": "a", "offset": (0.0, 0.02 * k, 0.02 * k)})
        run(stage, 1)
    stage.do({"do": "strength", "hand": "a", "stiffness": 900.0})
    set_(stage, "body.0.material.plasticity", "von-mises")
    set_(stage, "body.0.material.yield_stress", 2e3)
    set_(stage, "simulation.substeps", 2)
    run(stage, 10)
    stage.do({"do": "release", "hand": "a"})
    stage.do({"do": "pin", "hand": "b", "node": tip, "radius": 0.01})
    stage.do({"do": "throw", "origin": (0.3, 0.0, 0.8), "velocity": (0.0, 0.1, -5.0), "radius": 0.1})
    stage.do({"do": "poke", "node": tip // 2, "impulse": (0.0, 0.0, 1.0), "radius": 0.1})
    run(stage, 20)
    stage.finish_frame()
    stage.done.write(tmp_path / "done.json")
    assert stage.simulation.equivalent_plastic_strain().max() > 0.01

    again = Replay(Stage(scene()), Interactions.read(tmp_path / "done.json"))
    while again.frame < stage.simulation.frame:
        again.advance_frame()
    assert again.step_count == stage.simulation.step_count
    np.testing.assert_array_equal(again.positions, stage.simulation.positions)
    np.testing.assert_array_equal(again.plastic_strain(), stage.simulation.plastic_strain())


def test_a_change_of_law_keeps_where_everything_is_and_what_holds():
    stage, told = Stage(scene()), []
    stage.on_rebuild = lambda: told.append("laws")
    tip = tip_of(stage.simulation)
    run(stage, 30)
    stage.do({"do": "grab", "hand": "a", "node": tip, "stiffness": 500.0, "radius": 0.15})
    stage.do({"do": "drag", "hand": "a", "offset": (0.0, 0.0, 0.3)})
    x, v, time = stage.simulation.positions, stage.simulation.velocities, stage.simulation.time
    set_(stage, "body.0.material.model", "neo-hookean")
    assert told == ["laws"] and stage.simulation.time == time
    np.testing.assert_array_equal(stage.simulation.positions, x)
    np.testing.assert_array_equal(stage.simulation.velocities, v)
    force = stage.hands["a"].force(stage.simulation.positions)
    np.testing.assert_allclose(force, (0, 0, 150.0), atol=1e-3)
    run(stage, 60)
    assert stage.simulation.positions[tip, 2] > x[tip, 2] + 0.1
    with pytest.raises(InputError, match="poisson"):
        set_(stage, "body.0.material.poisson", 0.7)
    assert stage.scene.bodies[0].material.poisson == 0.3 and told == ["laws"]


def test_breaking_can_be_switched_on_and_a_pull_breaks_the_bar():
    stage = Stage(scene(gravity=(0.0, 0.0, 0.0)))
    tip = tip_of(stage.simulation)
    set_(stage, "body.0.material.toughness", 5e3)
    stage.do({"do": "grab", "hand": "a", "node": tip, "stiffness": 5e3, "radius": 0.15})
    for k in range(30):
        stage.do({"do": "drag", "hand": "a", "offset": (0.02 * k, 0.0, 0.0)})
        run(stage, 1)
    assert stage.simulation.piece_count > 1
    stage.reset()
    assert stage.simulation.piece_count == 1 and not stage.hands
    np.testing.assert_allclose(stage.simulation.positions, stage.simulation.rest_positions, atol=1e-7)


def test_reset_and_back_restore_state_parameters_and_list():
    stage = Stage(scene())
    set_(stage, "body.0.material.youngs", 3e5)
    run(stage, 10)
    kept = stage.keep()
    there, done = stage.simulation.positions, list(stage.done.entries)
    set_(stage, "body.0.material.youngs", 5e4)
    set_(stage, "simulation.gravity.y", 3.0)
    stage.do({"do": "throw", "origin": (0.3, 0.0, 0.8), "velocity": (0.0, 0.0, -5.0), "radius": 0.1})
    run(stage, 20)
    stage.back(kept)
    assert stage.scene.bodies[0].material.youngs == 3e5 and stage.scene.gravity[1] == 0.0
    assert stage.done.entries == done and stage.simulation.frame == 10
    np.testing.assert_array_equal(stage.simulation.positions, there)
    run(stage, 3)
    ahead = stage.simulation.positions
    stage.back(kept)
    run(stage, 3)
    np.testing.assert_array_equal(stage.simulation.positions, ahead)

    stage.reset()
    assert stage.simulation.time == 0 and stage.scene.bodies[0].material.youngs == 3e5
    assert [action["path"] for _, action in stage.done.entries] == ["body.0.material.youngs"]
    stage.reset(parameters_too=True)
    assert stage.scene == stage.original and stage.done.entries == []


def test_a_ball_pushes_and_is_thrown_back():
    stage = Stage(scene(gravity=(0.0, 0.0, 0.0)))
    tip = tip_of(stage.simulation)
    stage.do({"do": "throw", "origin": (0.55, 0.1, 0.6), "velocity": (0.0, 0.0, -4.0), "radius": 0.1})
    assert len(stage.simulation.scene.colliders) == 2
    lowest = 0.0
    for _ in range(40):
        stage.step()
        lowest = min(lowest, (stage.simulation.positions - stage.simulation.rest_positions)[tip, 2])
    assert lowest < -0.05 and stage._ball.velocity[2] > -3.0
    run(stage, 300)
    assert len(stage.simulation.scene.colliders) == 1


def test_impossible_actions_are_refused_and_nothing_happens():
    stage = Stage(scene())
    for action, words in (
        ({"do": "release", "hand": "x"}, "holds nothing"),
        ({"do": "drag", "hand": "x", "offset": (0, 0, 0)}, "holds nothing"),
        ({"do": "grab", "hand": "x", "node": 10**6, "stiffness": 1.0, "radius": 1.0}, "is not there"),
        ({"do": "set", "path": "body.5.material.youngs", "value": 1e5}, "there is no parameter"),
        ({"do": "set", "path": "body.0.materials.3.youngs", "value": 1e5}, "there is no parameter"),
        ({"do": "set", "path": "body.x.material.youngs", "value": 1e5}, "there is no material"),
    ):
        with pytest.raises(InputError, match=words):
            stage.do(action)
    assert stage.done.entries == [] and not stage.hands
    for k in range(20):
        try:
            stage.do({"do": "pin", "hand": f"p{k}", "node": k, "radius": 1.0})
        except InputError as error:
            assert "let go somewhere" in str(error) and k > 10
            break
    else:
        raise AssertionError("hands hold more than there is room for")


def test_a_saved_state_goes_on_in_the_saved_scene(tmp_path):
    from taichifem.live.keeping import Keeper

    stage = Stage(scene())
    keeper = Keeper(command_line=("run", "bar.toml"), name="bar", folder=tmp_path)
    set_(stage, "body.0.material.youngs", 3e5)
    set_(stage, "simulation.gravity.z", -5.0)
    run(stage, 20)
    lines = keeper.save(stage, tf.Camera(eye=(1, -2, 1), target=(0, 0, 0)))
    assert "bar-live-1.toml" in lines[0] and "--resume" in lines[1]
    saved = tf.Simulation(tf.Scene.from_file(tmp_path / "bar-live-1.toml"))
    start = saved.snapshot()
    saved.load(tmp_path / "bar-live-1.npz")
    run(stage, 5)
    saved.advance(seconds=5 / 60)
    np.testing.assert_array_equal(saved.positions, stage.simulation.positions)
    stage.reset()
    run(stage, 25)
    saved.restore(*start)
    saved.advance(seconds=25 / 60)
    np.testing.assert_array_equal(saved.positions, stage.simulation.positions)
    command = keeper.command(stage)
    assert "--set body.0.material.youngs=300000.0" in command and "simulation.gravity=[0.0, 0.0, -5.0]" in command
    assert "--replay" in keeper.save_interactions(stage)
    assert len(json.loads((tmp_path / "bar-live-1.json").read_text())["actions"]) == 2
