"""`taichifem compare`: one scene under several choices."""

import json
import math
from types import SimpleNamespace

import av
import numpy as np
import pytest
from calling import assert_refused, call
from PIL import Image

from taichifem import Simulation
from taichifem.app import compare, demos
from taichifem.app.compare_run import Run
from taichifem.app.compare_video import on_one_scale, widened
from taichifem.description import Body, Camera, Scene
from taichifem.errors import Diverged, InputError
from taichifem.mesh import TetMesh
from taichifem.output.frame import Frame

TWO = ["--vary", "model=linear,corotational"]


class FakeSimulation:
    """Counts steps; its energy grows by a joule a step, half of it kinetic. `last`: steps before it diverges."""

    def __init__(self, last: int | None = None, substeps: int = 1, **scene) -> None:
        mesh = TetMesh.bar(size=(1, 1, 1), cells=(1, 1, 1))
        self.substeps = substeps
        self.scene, self.last, self.done = Scene(bodies=[Body(mesh=mesh)], **scene), last, 0
        self.rest_positions, self.cells = mesh.points, mesh.cells

    def step(self) -> None:
        if self.done == self.last:
            raise Diverged("the simulation diverged")
        self.done += 1

    @property
    def frame(self) -> int:
        return self.done // self.substeps

    @property
    def time(self) -> float:
        return self.done / (self.scene.fps * self.substeps)

    def critical_step(self) -> float:
        return math.inf

    @property
    def phases(self) -> dict:
        return {"forces": 1.0, "solve": 100.0 if self.done == 1 else float(self.done)}

    @property
    def report(self) -> SimpleNamespace:
        return SimpleNamespace(iterations=10 * self.done, residual=1e-4, converged=self.done != 2)

    @property
    def stats(self) -> SimpleNamespace:
        return SimpleNamespace(energy={"kinetic": self.done / 2, "elastic": -self.done / 2, "total": float(self.done)})


def test_help():
    result = call("compare", "--help")
    assert result.exit_code == 0 and "--vary KEY=A,B,C" in result.output and "invertible:stvk" in result.output


def test_table_figures_and_video(tiny):
    result = call("compare", tiny, *TWO, "--video", "v.mp4", "--size", "320x180", "--json", "f.json")
    assert result.exit_code == 0, result.output
    for word in ("model = linear", "model = corotational", "ms a step", "energy drift", "moving pins", "wrote v.mp4"):
        assert word in result.output
    content = json.loads((tiny.parent / "f.json").read_text())
    assert content["settings"]["values"] == ["linear", "corotational"] and content["settings"]["precision"] == "f32"
    linear, turning = content["rows"]
    for row in (linear, turning):
        assert (row["state"], row["steps"], row["tets"], row["diverged_at_s"]) == ("ok", 6, 10, None)
        assert row["ms"]["p10"] <= row["ms"]["median"] <= row["ms"]["p90"]
        assert row["iterations"]["median"] > 0 and row["dt_s"] == pytest.approx(1 / 30)
        energy = row["energy"]
        assert energy["drift"] == pytest.approx((energy["end_J"] - energy["start_J"]) / energy["largest_J"])
        assert -1 < energy["drift"] < 0, "backward Euler takes energy away"
    assert linear["energy"]["end_J"] != turning["energy"]["end_J"]
    with av.open("v.mp4") as file:
        pictures = [frame.to_ndarray(format="rgb24").astype(int) for frame in file.decode(video=0)]
    assert len(pictures) == 7 and pictures[0].shape == (180, 320, 3)
    before, after = ((p[:, :159], p[:, -159:]) for p in (pictures[0], pictures[-1]))
    bodies = np.s_[30:140]
    apart = [float(np.abs(a[bodies] - b[bodies]).mean()) for a, b in (before, after)]
    assert apart[0] < 2, "at the start all look alike, from one place"
    assert apart[1] > 1.5 * apart[0]
    assert np.abs(after[0][bodies] - before[0][bodies]).mean() > 3
    foot = np.s_[150:175, 30:130]
    assert np.abs(after[0][foot] - after[1][foot]).mean() > 3, "the labels differ"
    assert all(tile[foot].min() < 100 and tile[foot].max() > 220 for tile in after)


def test_one_that_diverges_leaves_the_others_alone(tiny, monkeypatch):
    step = Simulation.step

    def failing(simulation):
        if simulation.scene.bodies[0].material.model == "linear" and simulation.time > 0.09:
            raise Diverged("the simulation diverged at t = 0.1 s: by order")
        step(simulation)

    monkeypatch.setattr(Simulation, "step", failing)
    result = call("compare", tiny, *TWO, "--video", "d.png", "--size", "160x90", "--json", "f.json")
    assert result.exit_code == 0, result.output
    assert "diverged at t = 0.1 s" in result.output
    linear, turning = json.loads((tiny.parent / "f.json").read_text())["rows"]
    assert (linear["state"], linear["steps"], linear["diverged_at_s"]) == ("diverged", 3, pytest.approx(0.1))
    assert (turning["state"], turning["steps"]) == ("ok", 6)
    pictures = [np.asarray(Image.open(f"d_000{k}.png")).astype(int) for k in range(7)]
    left, right = ([p[:, :79] for p in pictures], [p[:, -79:] for p in pictures])
    assert np.array_equal(left[4], left[6]) and not np.array_equal(right[4], right[6])
    assert np.abs(left[4] - left[3]).mean() > 5, "it is faded, and says why"


def test_without_a_video_nothing_is_drawn(tiny, monkeypatch):
    monkeypatch.setattr("taichifem.app.compare.SideBySide", None)
    monkeypatch.setattr(demos, "FOLDERS", (tiny.parent,))
    result = call(
        "compare", "tiny", "--vary", "youngs=1e5,2e5", "--seconds", 0.1, "--set", "simulation.gravity=[0,0,0]"
    )
    assert result.exit_code == 0, result.output
    assert "youngs = 2e5" in result.output and "wrote" not in result.output
    assert [file.name for file in tiny.parent.iterdir()] == ["tiny.toml"]


def test_reduced_models_stand_beside_the_full_one(tiny, tmp_path):
    """Condensation leaves nothing out: it loses as much energy as the full model does."""
    file = tmp_path / "figures.json"
    result = call(
        "compare", tiny, "--vary", "model=linear,modal,condensed", "--set", "body.0.material.modes=6", "--json", file
    )
    assert result.exit_code == 0, result.output
    full, modal, condensed = json.loads(file.read_text())["rows"]
    assert [row["choice"] for row in (full, modal, condensed)] == [
        f"model = {m}" for m in ("linear", "modal", "condensed")
    ]
    for part in ("start_J", "end_J"):
        assert condensed["energy"][part] == pytest.approx(full["energy"][part], rel=1e-2)
    assert modal["steps"] == full["steps"] and modal["iterations"]["max"] == 0 < full["iterations"]["max"]


def test_ctrl_c_ends_with_the_table(tiny, monkeypatch):
    def interrupted(*_):
        raise KeyboardInterrupt

    monkeypatch.setattr(Run, "advance_to", interrupted)
    result = call("compare", tiny, *TWO)
    assert result.exit_code == 130 and "model = corotational" in result.output


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ([], ["--vary"]),
        (["--vary", "model"], ["'model'", "KEY=A,B,C"]),
        (["--vary", "model=stvk,"], ["KEY=A,B,C"]),
        (["--vary", "=stvk,linear"], ["KEY=A,B,C"]),
        (["--vary", "model=stvk"], ["1 choice cannot", "2 to 9"]),
        (["--vary", "youngs=1,2,3,4,5,6,7,8,9,10"], ["10 choices", "2 to 9"]),
        (["--vary", "modell=stvk,linear"], ["'modell'", "did you mean 'model'?"]),
        (["--vary", "model=stvk,lienar"], ["'lienar'", "choose one of", "'linear'"]),
        (["--vary", "model=linear:stvk,stvk"], ["only invertible wraps"]),
        (["--vary", "body.bar.scale=1,2"], ["body has no entry bar"]),
        (["--vary", "view.color=speed,sped", "--video", "v.mp4"], ["'sped'"]),
        (["--vary", "camera.fov=30,40", "--video", "v.mp4"], ["camera.fov", "from one place"]),
        ([*TWO, "--set", "body.0.material.yongs=3"], ["yongs", "youngs"]),
        ([*TWO, "--seconds", "0"], ["simulation.seconds"]),
        ([*TWO, "--video", "v.mp4", "--size", "32x17"], ["32x17", "too small for 2 tiles"]),
        ([*TWO, "--json", "tiny.toml/f.json"], ["tiny.toml/f.json"]),
        ([*TWO, "--video", "a.mov"], ["a.mov", ".mp4"]),
        ([*TWO, "--set", "body.0.pin.0={indices=[99]}", "--video", "v.mp4"], ["--vary model=linear", "99"]),
    ],
)
def test_refusals(tiny, arguments, words):
    assert_refused(call("compare", "tiny.toml", *arguments), *words)
    assert [file.name for file in tiny.parent.iterdir()] == ["tiny.toml"]


def test_a_scene_is_a_file_or_a_demo(tiny, monkeypatch):
    monkeypatch.setattr(demos, "FOLDERS", (tiny.parent,))
    assert compare.scene_file("tiny") == tiny and compare.scene_file(str(tiny)) == tiny
    assert_refused(call("compare", "tinny", *TWO), "'tinny'", "did you mean 'tiny'?")
    assert_refused(call("compare", "nowhere.toml", *TWO), "nowhere.toml", "no such scene file")


@pytest.mark.parametrize(
    ("text", "key", "values"),
    [
        ("model=stvk, linear", "model", ["stvk", "linear"]),
        ("model=invertible:stvk,linear", "model", ["invertible:stvk", "linear"]),
        ("gravity=[0, 0, -9.81],[0,0,-1.6]", "gravity", ["[0, 0, -9.81]", "[0,0,-1.6]"]),
        ("body.0.name=a=b,c", "body.0.name", ["a=b", "c"]),
    ],
)
def test_values_are_separated_by_commas(text, key, values):
    assert compare.parse_vary(text) == (key, values)


def test_runs_of_different_frame_rates_keep_together():
    slow, fast = (Run("x", FakeSimulation(fps=fps, substeps=2, seconds=0.2)) for fps in (10, 30))
    seen = []
    for picture in range(8):
        moved = [run.advance_to(picture / 30) for run in (slow, fast)]
        seen.append((moved, slow.simulation.frame, fast.simulation.frame))
    assert [frames for _, *frames in seen] == [[0, 0], [0, 1], [0, 2], [1, 3], [1, 4], [1, 5], [2, 6], [2, 6]]
    assert [moved for moved, *_ in seen[2:5]] == [[False, True], [True, True], [False, True]]


def test_figures_of_a_run():
    run = Run("x", FakeSimulation(fps=10, substeps=2, seconds=0.5, last=5))
    run.advance_to(0.2)
    assert run.remark == "" and run.words == ("t = 0.20 s", "5.0 ms a step, 40 iterations")
    assert run.advance_to(0.5) and not run.advance_to(0.5)
    figures = run.figures()
    assert figures["ms"] == {"median": 4.5, "p10": 3.0, "p90": 6.0}, "the first step is left out"
    assert figures["phases_ms"] == {"forces": 1.0, "solve": 3.5}
    assert figures["iterations"] == {"median": 30, "max": 50} and figures["capped_steps"] == 1
    assert figures["energy"] == {"start_J": 0.0, "end_J": 5.0, "largest_J": 5.0, "drift": 1.0}
    assert (figures["state"], figures["diverged_at_s"], figures["dt_s"]) == ("diverged", 0.25, 0.05)
    assert run.remark == "diverged at t = 0.25 s"


def test_figures_that_are_not_known_are_none():
    simulation = FakeSimulation(last=0)
    simulation.critical_step = lambda: math.inf
    run = Run("x", simulation)
    run.advance_to(1)
    figures = run.figures()
    for name in ("ms", "iterations", "residual", "dt_s", "critical_step_s"):
        assert figures[name] is None
    assert figures["energy"]["drift"] is None and figures["steps"] == 0
    json.dumps(figures, allow_nan=False)


def test_the_critical_step_is_taken_from_the_simulation(capsys):
    simulation = FakeSimulation()
    simulation.critical_step = lambda: 1.25e-3
    figures = Run("x", simulation).figures()
    assert figures["critical_step_s"] == 1.25e-3
    compare.print_report([figures])
    row = capsys.readouterr().out.splitlines()[1]
    assert row.split()[-2:] == ["1.25", "ok"]


def test_what_cannot_be_simulated_names_the_choice(tiny, monkeypatch):
    def refusing(*_, **__):
        raise InputError("give more substeps")

    monkeypatch.setattr("taichifem.factory.Simulation", refusing)
    assert_refused(call("compare", tiny, *TWO), "--vary model=linear: give more substeps")


def test_one_scale_that_only_grows_with_one_bar():
    def frame(top, what="speed"):
        points = np.zeros((3, 3), np.float32)
        return Frame(
            points=points, triangles=np.zeros((1, 3), int), values=np.array([0, np.nan, top]), value_label=what
        )

    tops = {}
    scaled = on_one_scale([frame(2.0), frame(5.0), frame(3.0, "stress")], [False, False, False], tops)
    assert [f.value_range for f in scaled] == [(0, 5), (0, 5), (0, 3)]
    assert [f.bar for f in scaled] == [True, False, True]
    assert [f.value_range for f in on_one_scale([frame(1.0), frame(0.0)], [False, True], tops)] == [(0, 5), (0, 1)]
    assert on_one_scale([frame(0.0)], [False], {})[0].value_range == (0, 1)
    (plain,) = on_one_scale([Frame(points=np.zeros((3, 3)), triangles=np.zeros((1, 3), int))], [False], {})
    assert plain.values is None


def test_a_narrow_tile_shows_no_less_than_a_wider_one():
    camera = Camera(eye=(0, -4, 1), target=(0, 0, 0), fov=40)
    assert widened(camera, (640, 360)) == camera and widened(Camera(), (100, 400)) == Camera()
    half = widened(camera, (240, 360))
    assert math.tan(math.radians(half.fov) / 2) == pytest.approx(2 * math.tan(math.radians(20)))
    assert widened(Camera(eye=(0, -4, 1), fov=168), (100, 1000)).fov == 168
