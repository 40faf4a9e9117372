"""`taichifem bench --against` with made-up peers: none of the real ones is needed."""

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from calling import call
from test_bench import figures

from taichifem import TetMesh
from taichifem.app import bench, bench_peers
from taichifem.app.bench_input import interpreters
from taichifem.app.peers import common

# A bar that falls by 1 mm a frame, at 5 steps a frame; it tells the task it was given.
SOUND = f"""
import sys
sys.path.insert(0, {str(Path(common.__file__).parent)!r})
import common
def build(task):
    tip = task.points[task.tip, 2]
    def frame(): tip[:] -= 1e-3
    about = {{"version": "1.0", "law": "butter", "method": "falls", "substeps": 5, "differs": "it melts"}}
    print("a banner")
    return frame, lambda: tip, about | {{"E": task.youngs, "held": len(task.held), "mode": task.mode}}
common.main(build)
print("bye")
"""
LOST = SOUND.replace("-= 1e-3", "-= float('nan')")
SCRIPTS = {
    "sound": SOUND,
    "lost": LOST,
    "far": SOUND.replace("-= 1e-3", "-= 30.0"),
    "missing": "import no_such_module_at_all",
    "crash": "raise RuntimeError('no GPU here')",
    "killed": "import os\nos.kill(os.getpid(), 9)",
    "silent": "print('{not json')",
    "slow": "import time\ntime.sleep(30)",
}


@pytest.fixture
def peers(tmp_path, monkeypatch):
    """The made-up peers by name, in place of the real ones."""
    for name, text in SCRIPTS.items():
        (tmp_path / f"{name}.py").write_text(text)
    made = {name: bench_peers.Peer(script=f"{name}.py", packages=f"{name}-fem", mode="m") for name in SCRIPTS}
    monkeypatch.setattr(bench_peers, "SCRIPTS", tmp_path)
    monkeypatch.setattr(bench_peers, "PEERS", made)
    monkeypatch.setattr("taichifem.app.bench_input.PEERS", made)
    return made


@pytest.fixture
def task(tmp_path):
    mesh = TetMesh.bar(size=(1.0, 0.25, 0.25), cells=(4, 1, 1))
    np.savez(tmp_path / "bar.npz", points=mesh.points, tets=mesh.cells)
    settings = {"youngs": 1e6, "poisson": 0.4, "density": 1000.0, "gravity": 9.81, "threads": 1, "budget": 5.0}
    return {"mesh": str(tmp_path / "bar.npz"), "steps": 3, **settings}


def test_figures_of_a_peer(peers, task):
    row = bench_peers.measure_peer("sound", task, python=sys.executable, limit=60)
    assert (row["status"], row["law"], row["E"], row["held"], row["mode"]) == ("measured", "butter", 1e6, 4, "m")
    assert row["steps"] == 3 and row["ms"]["p10"] <= row["ms"]["median"] <= row["ms"]["p90"]
    assert row["tips_m"] == pytest.approx([-1e-3 * (i + 1) for i in range(5 + 3)])


@pytest.mark.parametrize(
    ("name", "status", "words"),
    [
        ("missing", "not installed", "pip install missing-fem, or --peer-python missing="),
        ("crash", "failed", "RuntimeError: no GPU here"),
        ("killed", "failed", "signal 9"),
        ("silent", "failed", "printed no figures"),
        ("lost", "diverged", "frame 1"),
        ("far", "diverged", "frame 4"),
        ("slow", "too slow", "--peer-limit"),
    ],
)
def test_a_peer_without_figures_says_why(peers, task, name, status, words):
    limit = 0.2 if name == "slow" else 60
    row = bench_peers.measure_peer(name, task, python=sys.executable, limit=limit)
    assert row["status"] == status and words in row["reason"]
    assert bench_peers.beside(figures(), row) == {}


def test_ours_and_peers_in_one_table(peers, tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "_measure", lambda bar, *_: figures(20 * bar.m**3, 0.1))
    target = tmp_path / "b.json"
    options = ("--no-cold", "--stiffness", "1e5,1e6", "--against", "sound,lost,missing", "--json", target)
    result = call("bench", "--sizes", "160", *options)
    assert result.exit_code == 0, result.output
    for words in ("butter, falls, 5 steps a frame; it melts", "pip install missing-fem", "diverged: ", "-0.300"):
        assert words in result.output
    rows = json.loads(target.read_text())["peers"]
    assert [(row["youngs"], row["peer"]) for row in rows] == [
        (youngs, name) for youngs in (1e5, 1e6) for name in ("sound", "lost", "missing")
    ]
    sound, lost, _ = rows[:3]
    assert (sound["tets"], sound["size"], sound["E"]) == (160, "160", 1e5) and "ms" not in lost
    assert sound["times_ours"] == pytest.approx(sound["ms"]["median"] / 0.1)
    assert (sound["frames_compared"], sound["our_tip_lowest_m"]) == (3, -0.3)
    assert sound["our_tip_mean_m"] == pytest.approx(-0.2) and sound["tip_lowest_m"] == pytest.approx(-3e-3)


def test_the_tip_is_compared_after_as_many_frames():
    ours = figures(tips_m=[-0.01 * i for i in range(60)])
    peer = {"status": "measured", "ms": {"median": 3.0}, "tips_m": [-1.0] * 30}
    both = bench_peers.beside(ours, peer)
    assert both["frames_compared"] == 30 and both["our_tip_lowest_m"] == pytest.approx(-0.29)
    assert both["our_tip_mean_m"] == pytest.approx(-0.01 * (10 + 29) / 2) and both["times_ours"] == 3.0


def test_the_interpreter_of_a_program_runs_all_its_methods(tmp_path):
    chosen = interpreters([f"newton={sys.executable}"])
    assert chosen["newton"] == chosen["newton-semi-implicit"] == sys.executable == chosen["mujoco"]
    link = tmp_path / "python"
    link.symlink_to(sys.executable)
    assert interpreters([f"newton-semi-implicit={link}", f"newton={sys.executable}"]) == {
        **chosen,
        "newton-semi-implicit": str(link),
    }


def test_every_peer_has_its_script_and_stands_in_the_help():
    assert all((bench_peers.SCRIPTS / peer.script).is_file() for peer in bench_peers.PEERS.values())
    assert ",".join(bench_peers.PEERS) in "".join(call("bench", "--help").output.split())


def test_the_task():
    mesh = TetMesh.bar(size=(1.0, 0.25, 0.25), cells=(8, 2, 2))
    given = {"youngs": 1e6, "poisson": 0.25, "density": 1000.0, "gravity": 9.81, "steps": 1, "budget": 1.0}
    task = common.Task(points=mesh.points, tets=mesh.cells, **given)
    assert len(task.held) == len(task.tip) == 9
    assert task.masses.sum() == pytest.approx(62.5) and task.volumes.min() > 0
    assert task.lame == pytest.approx((4e5, 4e5)) and task.smith_constants == pytest.approx((16e5 / 3, 22e5 / 3))
    # The flattest tetrahedron is the corner of a cube of 0.125 m; waves run at sqrt(1.2e6 / 1000) m/s.
    assert task.explicit_substeps == np.ceil(1200**0.5 * 3**0.5 / 0.125 / (0.8 * 60))


def test_frames_end_with_the_budget_and_with_the_first_alone():
    heights = iter(range(100))
    few = common.drive(lambda: None, lambda: -0.01 * next(heights), steps=60, budget=0.0)
    assert few["steps"] == 1 and len(few["tips_m"]) == 6 and few["tip_lowest_m"] == -0.05
    assert set(common.drive(lambda: None, lambda: 0.0, steps=0, budget=1.0)) == {"first_step_s", "tips_m"}
