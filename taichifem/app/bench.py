"""`taichifem bench`: bars of several sizes, each measured by `bench_worker` in a process of its own."""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import tempfile
from dataclasses import asdict
from pathlib import Path

import click

from taichifem.app.bench_report import print_report
from taichifem.app.bench_worker import Bar
from taichifem.app.figures import write_figures
from taichifem.errors import InputError

CACHE = "TI_OFFLINE_CACHE_FILE_PATH"
MOST_TETS = 5_000_000


def run_bench(
    *,
    sizes: str = "1k,5k,20k,100k",
    stiffness: str = "1e6",
    model: str = "corotational",
    precision: str = "f32",
    arch: str | None = None,
    threads: int | None = None,
    steps: int = 60,
    budget: float = 45.0,
    no_cold: bool = False,
    json_file: Path | None = None,
) -> list[dict]:
    """Measure every size with every stiffness, print tables, write `json_file`; returns the rows.

    Cold start: with an empty kernel cache; warm: with what the cold start put there. Without cold starts
    the user's own cache is used.
    Raises InputError if an option makes no sense or a bar cannot be simulated.
    """
    settings = {"model": model, "precision": precision, "arch": arch, "threads": threads}
    if not budget > 0:
        raise InputError(f"--budget is {budget:g}: give seconds above 0")
    counts = {text: _tets(text) for text in sizes.split(",")}
    moduli = [_modulus(text) for text in stiffness.split(",")]
    if json_file is not None:
        write_figures(json_file, settings, [])  # a place that cannot be written is told now
    rows = []
    for label, tets in counts.items():
        m = max(1, round((tets / 20) ** (1 / 3)))
        with tempfile.TemporaryDirectory(prefix="taichifem-bench-") as folder:
            cache = {} if no_cold else {CACHE: folder}
            cold = {}
            if not no_cold:
                cold = _measure(Bar(m=m, youngs=moduli[0], steps=0, **settings), cache, label)
            for youngs in moduli:
                bar = Bar(m=m, youngs=youngs, steps=steps, budget=budget, **settings)
                figures = _measure(bar, cache, f"{label} tets, E = {youngs:g} Pa")
                for name in ("setup_s", "first_step_s"):
                    figures[f"cold_{name}"] = cold.get(name)
                rows.append({"size": label.strip(), **asdict(bar), **figures})
        if json_file is not None:
            write_figures(json_file, settings, rows)
    print_report(rows)
    return rows


def _tets(text: str) -> int:
    """A number of tetrahedra, as in 20k or 1280."""
    number = text.strip().lower()
    try:
        count = float(number.removesuffix("k")) * (1000 if number.endswith("k") else 1)
    except ValueError:
        count = math.nan
    if not 1 <= count <= MOST_TETS:
        raise InputError(f"--sizes: {text!r} is no number of tetrahedra: write 1k,5k or 1280, at most {MOST_TETS:,}")
    return round(count)


def _modulus(text: str) -> float:
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (value > 0 and math.isfinite(value)):
        raise InputError(f"--stiffness: {text!r} is no Young's modulus [Pa] above 0: write 1e5,1e6")
    return value


def _measure(bar: Bar, environment: dict[str, str], what: str) -> dict:
    """Figures of one bar, from a process of its own."""
    if sys.stderr.isatty():
        click.echo(f"\r\033[Kmeasuring {what} ...", err=True, nl=False)
    command = [sys.executable, "-m", "taichifem.app.bench_worker", json.dumps(asdict(bar))]
    done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})
    if sys.stderr.isatty():
        click.echo("\r\033[K", err=True, nl=False)
    if done.returncode:
        reason = next(reversed(done.stderr.strip().splitlines()), f"it ended with code {done.returncode}")
        raise InputError(f"bench of {what}: {reason}")
    return json.loads(done.stdout.strip().splitlines()[-1])
