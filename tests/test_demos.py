"""Every demo runs and shows what it is there to show."""

import importlib.util
from pathlib import Path

import pytest

import taichifem as tf

DEMOS = Path(__file__).resolve().parents[1] / "demos"
QUICK = {"swelling", "twist"}


def parameters():
    for file in sorted(DEMOS.glob("*.toml")):
        yield pytest.param(file.stem, marks=() if file.stem in QUICK else pytest.mark.slow)


def load_check(name: str):
    spec = importlib.util.spec_from_file_location(f"demo_{name}", DEMOS / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module.check


def frames_of(simulation: tf.Simulation):
    scene = simulation.scene
    for _ in range(round(scene.seconds * scene.fps)):
        simulation.advance_frame()
        yield simulation


@pytest.mark.parametrize("name", list(parameters()))
def test_demo(name):
    scene = tf.Scene.from_file(str(DEMOS / f"{name}.toml"))
    assert scene.description
    load_check(name)(frames_of(tf.simulate(scene)))
