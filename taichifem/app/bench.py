"""`taichifem bench`: bars of several sizes, each measured in a process of its own, here and in other programs."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import asdict
from pathlib import Path

import click
import numpy as np

from taichifem.app.bench_growth import growth
from taichifem.app.bench_input import BenchOptions, Plan
from taichifem.app.bench_peers import beside, measure_peer
from taichifem.app.bench_plot import write_plot
from taichifem.app.bench_report import print_report
from taichifem.app.bench_worker import DENSITY, GRAVITY, Bar, bar_mesh
from taichifem.app.figures import write_figures
from taichifem.errors import InputError
from taichifem.files import replacing

CACHE = "TI_OFFLINE_CACHE_FILE_PATH"


def run_bench(options: BenchOptions) -> dict[str, list[dict]]:
    """Measure every size with every stiffness and solver, then the peers; print tables, write what is asked for.

    Cold start: with an empty kernel cache; warm: with what the cold start put there. Without cold starts
    the user's own cache is used.
    Raises InputError if an option makes no sense or a bar cannot be simulated; what a peer cannot do stands in its row.
    Returns the `rows`, those of the `peers`, and the `growth` of the time with the size.
    """
    plan = Plan(options)
    found: dict[str, list[dict]] = {"rows": [], "peers": [], "growth": []}
    for label, m in plan.cubes.items():
        with tempfile.TemporaryDirectory(prefix="taichifem-bench-") as folder:
            for kind, row in _one_size(plan, options, label, m, Path(folder)):
                found[kind].append(row)
        found["growth"] = growth(found["rows"])
        if options.json_file is not None:
            _write(options.json_file, {**plan.material, **plan.machine}, **found)
    print_report(**found)
    if options.plot is not None:
        write_plot(options.plot, found["rows"], found["peers"])
    return found


def _one_size(plan: Plan, options: BenchOptions, label: str, m: int, folder: Path) -> Iterator[tuple[str, dict]]:
    """Rows of one size, each with its kind, in the order in which they are measured."""
    settings = {"m": m, **plan.material, **plan.machine}
    caches = {solver: {} if options.no_cold else {CACHE: str(folder / solver)} for solver in plan.solvers}
    cold = {}
    for solver in () if options.no_cold else plan.solvers:
        bar = Bar(youngs=plan.moduli[0], solver=solver, steps=0, **settings)
        cold[solver] = _measure(bar, caches[solver], label)
    for youngs in plan.moduli:
        ours = None
        what = f"{label} tets, E = {youngs:g} Pa"
        for solver in plan.solvers:
            bar = Bar(youngs=youngs, solver=solver, steps=options.steps, budget=options.budget, **settings)
            figures = _measure(bar, caches[solver], what)
            for name in ("setup_s", "first_step_s"):
                figures[f"cold_{name}"] = cold.get(solver, {}).get(name)
            row = {"size": label, **asdict(bar), **figures}
            ours = ours or row
            yield "rows", row
        for name in plan.peers:
            with _telling(f"{what}, {name}"):
                task = {**_task(ours, folder / "bar.npz"), "steps": options.steps}
                figures = measure_peer(name, task, python=plan.interpreters[name], limit=options.peer_limit)
            asked = {key: ours[key] for key in ("size", "tets", "youngs", "poisson")}
            yield "peers", {"peer": name, **asked, **figures, **beside(ours, figures)}


def _task(ours: dict, file: Path) -> dict:
    """What a peer needs to know to do the same; writes the mesh to `file`."""
    if not file.exists():
        mesh = bar_mesh(ours["m"])
        np.savez(file, points=mesh.points, tets=mesh.cells)
    same = {key: ours[key] for key in ("youngs", "poisson", "threads", "budget")}
    return {"mesh": str(file), **same, "density": DENSITY, "gravity": GRAVITY}


def _measure(bar: Bar, environment: dict[str, str], what: str) -> dict:
    """Figures of one bar, from a process of its own."""
    command = [sys.executable, "-m", "taichifem.app.bench_worker", json.dumps(asdict(bar))]
    with _telling(what):
        done = subprocess.run(command, capture_output=True, text=True, env={**os.environ, **environment})
    if done.returncode:
        reason = next(reversed(done.stderr.strip().splitlines()), f"it ended with code {done.returncode}")
        raise InputError(f"bench of {what}: {reason}")
    return json.loads(done.stdout.strip().splitlines()[-1])


@contextmanager
def _telling(what: str) -> Iterator[None]:
    """Say what is being measured, on a terminal, while it is."""
    if sys.stderr.isatty():
        click.echo(f"\r\033[Kmeasuring {what} ...", err=True, nl=False)
    yield
    if sys.stderr.isatty():
        click.echo("\r\033[K", err=True, nl=False)


def _write(path: Path, settings: dict, *, rows: list[dict], **more: list[dict]) -> None:
    """The file of figures, with more kinds of rows in it."""
    with replacing(path) as part:
        write_figures(part, settings, rows)
        content = json.loads(part.read_text(encoding="utf-8")) | more
        part.write_text(json.dumps(content, indent=2, allow_nan=False) + "\n", encoding="utf-8")
