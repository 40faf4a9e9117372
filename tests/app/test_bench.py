"""`taichifem bench` on tiny bars: that the figures are there and make sense, not how fast anything is."""

import json

import pytest
from calling import assert_refused, call

from taichifem import InputError
from taichifem.app import bench, bench_worker
from taichifem.app.bench_growth import growth
from taichifem.app.bench_input import BenchOptions, Plan
from taichifem.app.peers.common import spread


def figures(tets=160, median=1.0, **more):
    """What the worker tells of a bar."""
    three = {"median": median, "p10": median, "p90": median}
    row = {"setup_s": 1.0, "first_step_s": 2.0, "tets": tets, "nodes": 81, "steps": 3, "ms": three}
    row |= {"phases_ms": {"solve": three}, "iterations": {"median": 5, "max": 6}, "residual": 1e-3, "capped_steps": 1}
    row |= {"real_time_factor": 16.7, "peak_mib": 200.0, "probe_ms": 5.0, "tips_m": [-0.1, -0.3, -0.2]}
    row |= {"product": {"ms": 0.1, "gb_s": 8.0, "read_gb_s": 10.0}}
    return row | dict.fromkeys(("tip_m", "tip_lowest_m", "timoshenko_m"), -0.1) | more


@pytest.mark.parametrize(("text", "m"), [("1k", 4), ("5k", 6), ("20k", 10), ("100k", 17), ("1m", 37), ("0.5M", 29)])
def test_round_sizes_give_the_standard_bars(text, m):
    assert Plan(BenchOptions(sizes=text)).cubes == {text: m}


def test_figures_of_a_small_bar(tmp_path):
    target = tmp_path / "bench.json"
    options = ("--steps", 3, "--stiffness", "2e6", "--poisson", 0.3, "--no-cold", "--json", target)
    result = call("bench", "--sizes", "160", *options)
    assert result.exit_code == 0, result.output
    content = json.loads(target.read_text())
    assert content["settings"]["precision"] == "f32" and content["machine"]["cores"]
    assert (content["growth"], content["peers"]) == ([], [])
    (row,) = content["rows"]
    assert (row["tets"], row["youngs"], row["steps"], row["cold_setup_s"]) == (160, 2e6, 3, None)
    assert (row["poisson"], row["solver"], row["model"]) == (0.3, "multilevel", "corotational")
    assert row["product"]["gb_s"] > 0 and row["product"]["read_gb_s"] > 0
    assert row["timoshenko_m"] == pytest.approx(-bench_worker.timoshenko(2e6, 0.3))
    assert row["ms"]["p10"] <= row["ms"]["median"] <= row["ms"]["p90"]
    assert {"forces", "assembly", "solve"} <= set(row["phases_ms"])
    assert 0 < row["residual"] <= 1.1e-3 and row["iterations"]["max"] > 0
    assert row["peak_mib"] > 50 and row["first_step_s"] > 0 and row["probe_ms"] > 0
    assert row["real_time_factor"] == pytest.approx(1e3 / 60 / row["ms"]["median"])
    assert len(row["tips_m"]) == 5 + 3
    assert row["tip_lowest_m"] == min(row["tips_m"]) <= row["tip_m"] == row["tips_m"][-1] < row["tips_m"][0] < 0
    for word in ("160", "ms a step", "solve", "E [Pa]", "peak [MiB]", "multilevel"):
        assert word in result.output
    assert "to the power" not in result.output and "other programs" not in result.output


def test_a_bar_that_yields_runs_beside_an_elastic_one(tmp_path):
    target = tmp_path / "bench.json"
    options = ("--steps", 20, "--plasticity", "von-mises", "--no-cold", "--json", target)
    result = call("bench", "--sizes", "160", *options)
    assert result.exit_code == 0, result.output
    (row,) = json.loads(target.read_text())["rows"]
    assert row["plasticity"] == "von-mises" and 0 < row["yielded"] < 1 and row["elastic_ms"]["median"] > 0
    assert "von-mises takes" in result.output


def test_a_cold_start_of_each_solver_is_measured_in_an_empty_cache(monkeypatch):
    seen = []

    def measured(bar, environment, what):
        seen.append((bar.solver, bar.youngs, bar.steps, environment[bench.CACHE]))
        return figures(first_step_s=2.0 if bar.steps else 9.0)

    monkeypatch.setattr(bench, "_measure", measured)
    solvers = ("multilevel", "block-jacobi")
    found = bench.run_bench(BenchOptions(sizes="160", stiffness="1e5,1e6", steps=3, solver=",".join(solvers)))
    assert [(solver, steps) for solver, _, steps, _ in seen] == [(s, n) for n in (0, 3, 3) for s in solvers]
    assert len({(solver, folder) for solver, *_, folder in seen}) == len({folder for *_, folder in seen}) == 2
    assert [row["cold_first_step_s"] for row in found["rows"]] == [9.0] * 4
    assert [(row["youngs"], row["solver"]) for row in found["rows"]] == [(E, s) for E in (1e5, 1e6) for s in solvers]


def test_a_bar_that_cannot_be_measured_is_one_line():
    with pytest.raises(InputError, match="bench of x: arch is 'quantum'"):
        bench._measure(bench.Bar(m=1, arch="quantum", steps=0), {}, "x")


def test_growth_is_that_of_the_large_bars():
    made = [
        {"youngs": youngs, "solver": "multilevel", **figures(tets, ms * youngs)}
        for youngs in (1.0, 2.0)
        for tets, ms in [(1_000, 50.0), *((tets, tets**1.2) for tets in (20_000, 100_000, 1_000_000))]
    ]
    one, two = growth(made)
    assert one["exponent"] == pytest.approx(1.2) and two["exponent"] == pytest.approx(1.2)
    assert one["tets"] == [20_000, 100_000, 1_000_000] and two["youngs"] == 2.0


def test_growth_of_small_bars_and_of_one():
    small = [{"youngs": 1.0, "solver": "a", **figures(tets, tets**0.5)} for tets in (1_000, 5_000, 20_000)]
    assert growth(small)[0]["exponent"] == pytest.approx(0.5)
    assert growth(small[:1] * 2) == []


def test_growth_is_printed_and_written(tmp_path, monkeypatch):
    monkeypatch.setattr(bench, "_measure", lambda bar, *_: figures(20 * bar.m**3, 0.1 * bar.m**3))
    result = call("bench", "--sizes", "20k,100k", "--no-cold", "--json", tmp_path / "b.json")
    assert result.exit_code == 0, result.output
    assert "to the power 1.00 (from 20,000 to 98,260)" in result.output
    (line,) = json.loads((tmp_path / "b.json").read_text())["growth"]
    assert line["exponent"] == pytest.approx(1) and line["solver"] == "multilevel"


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (["--sizes", "1km"], ["--sizes", "'1km'"]),
        (["--sizes", "6m"], ["--sizes", "5,000,000"]),
        (["--sizes", ""], ["--sizes"]),
        (["--stiffness", ""], ["--stiffness"]),
        (["--solver", ""], ["--solver", "multilevel"]),
        (["--solver", "multilevel,magic"], ["--solver", "'magic'", "block-jacobi"]),
        (["--poisson", "0.5"], ["--poisson", "0.5"]),
        (["--peer-limit", "0"], ["--peer-limit"]),
        (["--against", "abacus"], ["--against", "'abacus'", "mujoco", "taichi-example"]),
        (["--peer-python", "abacus=python"], ["--peer-python", "'abacus'"]),
        (["--peer-python", "mujoco"], ["--peer-python", "mujoco=/path/to/python"]),
        (["--peer-python", "mujoco=/no/such/python"], ["--peer-python", "/no/such/python"]),
        (["--plot", "b.jpeg"], ["--plot", "b.jpeg", ".png"]),
    ],
)
def test_options_that_make_no_sense(options, words, tiny, monkeypatch):
    monkeypatch.setattr(bench, "_measure", lambda *_: pytest.fail("measured"))
    assert_refused(call("bench", *options), *words)


def test_closed_form_and_spread():
    assert bench_worker.timoshenko(1e6, 0.4) == pytest.approx(0.2515, abs=1e-4)
    assert bench_worker.timoshenko(1e5, 0.4) == pytest.approx(10 * bench_worker.timoshenko(1e6, 0.4))
    assert spread([3.0, 1.0, 2.0]) == {"median": 2.0, "p10": 1.0, "p90": 3.0}
