import json

import meshio
import numpy as np
import pytest
from calling import assert_refused, call
from PIL import Image

SCENE = """
[[body]]
mesh = { shape = "bar", size = [0.4, 0.1, 0.1], cells = [4, 1, 1] }
material = { model = "stvk", youngs = 2e5, poisson = 0.3 }

[[body.pin]]
box = { lower = [-1, -1, -1], upper = [1e-6, 1, 1] }

[[body.force]]
box = { lower = [0.3999, -1, -1], upper = [1, 1, 1] }
force = [0, 0, 5]
"""


@pytest.fixture
def bracket(tmp_path, monkeypatch):
    """A scene file in the current folder."""
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "bracket.toml"
    path.write_text(SCENE)
    return path


def test_results_picture_and_figures_are_written(bracket, tmp_path):
    done = call("static", bracket, "--json", "all.json", "--size", "320x180")
    assert done.exit_code == 0, done.stderr
    assert "linearisation" in done.stdout
    assert "balanced" in done.stdout
    figures = json.loads((tmp_path / "all.json").read_text())
    weight = 0.4 * 0.1 * 0.1 * 1000 * 9.81
    assert figures["converged"]
    assert figures["reaction"] == pytest.approx([0, 0, weight - 5], abs=1e-6)
    mesh = meshio.read(tmp_path / "out" / "bracket.vtu")
    assert mesh.point_data["reaction"].sum(axis=0) == pytest.approx([0, 0, weight - 5], abs=1e-6)
    assert np.abs(mesh.point_data["displacement"]).max() == pytest.approx(figures["max_displacement"], rel=0.3)
    assert mesh.cell_data["cauchy_stress"][0].shape == (figures["elements"], 9)
    with Image.open(tmp_path / "out" / "bracket.png") as picture:
        assert picture.size == (320, 180)
        assert np.asarray(picture).std() > 10


def test_a_load_beyond_what_the_body_bears_is_said(bracket, tmp_path):
    """St. Venant-Kirchhoff gives way under pressure: no dead load beyond its limit has a balance."""
    crush = ["--set", "body.0.force.0.force=[-600, 0, 0]"]
    done = call("static", bracket, *crush, "--no-picture", "--tolerance", "1e-6")
    assert done.exit_code == 1, done.stderr
    assert "last good one" in done.stdout
    assert (tmp_path / "out" / "bracket.vtu").exists()
    assert "Traceback" not in done.stderr


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["--tolerance", "2"], "--tolerance"),
        (["-o", "mesh.obj"], ".vtu"),
        (["--picture", "a.png", "--no-picture"], "exclude"),
        (["--set", "body.0.pin=[]"], "shift or turn"),
        (["--set", "body.0.force.0.force=[1, 2]"], "force"),
    ],
)
def test_refusals_are_one_line(bracket, tmp_path, arguments, words):
    done = call("static", bracket, *arguments)
    assert_refused(done, words)
    assert not (tmp_path / "out").exists()
