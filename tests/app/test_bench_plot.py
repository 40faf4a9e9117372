"""The picture of `taichifem bench`: refusals before anything is measured, and which lines are drawn."""

import sys

import pytest
from calling import assert_refused, call

from taichifem.app import bench, bench_plot


def row(tets, ms, *, youngs=1e6, **more):
    return {"tets": tets, "youngs": youngs, "ms": {"median": ms}, **more}


ROWS = [row(tets, tets / 1e3, youngs=E, solver="multilevel") for tets in (20_000, 1_000) for E in (1e5, 1e6)]
PEERS = [
    row(1_000, 3.0, peer="mujoco", status="measured"),
    {"peer": "newton", "tets": 1_000, "youngs": 1e6, "status": "not installed", "reason": "pip install newton"},
]


@pytest.fixture(autouse=True)
def nothing_is_measured(monkeypatch):
    monkeypatch.setattr(bench, "_measure", lambda *_: pytest.fail("measured"))


def test_without_matplotlib_the_remedy_comes_first(tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "matplotlib", None)
    assert_refused(call("bench", "--plot", tmp_path / "b.png"), 'pip install "taichifem[plot]"')


def test_a_place_that_cannot_be_written_is_told_first(tiny):
    pytest.importorskip("matplotlib")
    assert_refused(call("bench", "--plot", "tiny.toml/b.png"), "tiny.toml/b.png")


def test_a_line_for_each_program_and_stiffness():
    lines = bench_plot.curves(ROWS, PEERS)
    assert list(lines) == ["taichifem, multilevel, 0.1 MPa", "taichifem, multilevel, 1 MPa", "mujoco, 1 MPa"]
    soft, stiff, mujoco = lines.values()
    assert soft["points"] == [(1_000, 1.0), (20_000, 20.0)]
    assert soft["style"]["color"] == stiff["style"]["color"] != mujoco["style"]["color"]
    assert soft["style"]["marker"] != stiff["style"]["marker"] == mujoco["style"]["marker"]


@pytest.mark.parametrize("suffix", bench_plot.SUFFIXES)
def test_it_is_drawn(suffix, tmp_path):
    pytest.importorskip("matplotlib")
    path = tmp_path / f"new/bench{suffix}"
    bench_plot.need_plot(path)
    bench_plot.write_plot(path, ROWS, PEERS)
    assert path.stat().st_size > 5_000
    if suffix == ".svg":
        assert "<svg" in path.read_text()
    bench_plot.write_plot(path, ROWS[:1], [])  # one size: nothing grows
