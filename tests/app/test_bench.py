"""`taichifem bench` on tiny bars: that the figures are there and make sense, not how fast anything is."""

import json

import pytest
from calling import call

from taichifem.app import bench, bench_worker


@pytest.mark.parametrize(("text", "m"), [("1k", 4), ("5k", 6), ("20k", 10), ("100k", 17)])
def test_round_sizes_give_the_standard_bars(text, m):
    assert round((bench._tets(text) / 20) ** (1 / 3)) == m


def test_figures_of_a_small_bar(tmp_path):
    target = tmp_path / "bench.json"
    result = call("bench", "--sizes", "160", "--steps", 3, "--stiffness", "2e6", "--no-cold", "--json", target)
    assert result.exit_code == 0, result.output
    content = json.loads(target.read_text())
    assert content["settings"]["precision"] == "f32" and content["machine"]["cores"]
    (row,) = content["rows"]
    assert (row["tets"], row["youngs"], row["steps"], row["cold_setup_s"]) == (160, 2e6, 3, None)
    assert row["ms"]["p10"] <= row["ms"]["median"] <= row["ms"]["p90"]
    assert {"forces", "assembly", "solve"} <= set(row["phases_ms"])
    assert 0 < row["residual"] <= 1.1e-3 and row["iterations"]["max"] > 0
    assert row["peak_mib"] > 50 and row["first_step_s"] > 0 and row["probe_ms"] > 0
    assert row["real_time_factor"] == pytest.approx(1e3 / 60 / row["ms"]["median"])
    assert row["tip_lowest_m"] <= row["tip_m"] < 0
    for word in ("160", "ms a step", "solve", "E [Pa]", "peak [MiB]"):
        assert word in result.output


def test_a_cold_start_is_measured_in_an_empty_cache(tmp_path, monkeypatch):
    seen = []

    def measured(bar, environment, what):
        folder = environment[bench.CACHE]
        seen.append((bar.steps, folder))
        row = {"setup_s": 1.0, "first_step_s": 2.0 if bar.steps else 9.0, "tets": 160, "nodes": 81, "steps": 3}
        three = {"median": 1.0, "p10": 1.0, "p90": 1.0}
        row |= {"ms": three, "phases_ms": {"solve": three}, "iterations": {"median": 5, "max": 6}, "residual": 1e-3}
        row |= {"capped_steps": 1, "real_time_factor": 16.7, "peak_mib": 200.0, "probe_ms": 5.0}
        return row | dict.fromkeys(("tip_m", "tip_lowest_m", "timoshenko_m"), -0.1)

    monkeypatch.setattr(bench, "_measure", measured)
    rows = bench.run_bench(sizes="160", stiffness="1e5,1e6", steps=3)
    assert [steps for steps, _ in seen] == [0, 3, 3] and len({folder for _, folder in seen}) == 1
    assert [row["cold_first_step_s"] for row in rows] == [9.0, 9.0]


def test_a_bar_that_cannot_be_measured_is_one_line(monkeypatch):
    with pytest.raises(bench.InputError, match="bench of x: arch is 'quantum'"):
        bench._measure(bench.Bar(m=1, arch="quantum", steps=0), {}, "x")


def test_closed_form_and_spread():
    assert bench_worker.timoshenko(1e6) == pytest.approx(0.2515, abs=1e-4)
    assert bench_worker.timoshenko(1e5) == pytest.approx(10 * bench_worker.timoshenko(1e6))
    assert bench_worker.spread([3.0, 1.0, 2.0]) == {"median": 2.0, "p10": 1.0, "p90": 3.0}
