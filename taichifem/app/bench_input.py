"""What the command line asks of `taichifem bench`, checked before anything is measured."""

from __future__ import annotations

import math
import os
import shutil
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import TypeVar

from taichifem.app.bench_peers import PEERS
from taichifem.app.bench_plot import need_plot
from taichifem.description.scene import SOLVERS
from taichifem.errors import InputError
from taichifem.files import need_place

MOST_TETS = 5_000_000
UNITS = {"k": 1e3, "m": 1e6}
T = TypeVar("T")


@dataclass(frozen=True, kw_only=True)
class BenchOptions:
    """Options of the command, as given; lists are separated by commas.

    sizes: numbers of tetrahedra.  stiffness: Young's moduli [Pa].  budget: for the timed steps of one bar [s].
    no_cold: no starts with an empty kernel cache.  against: names of peers.  peer_python: as in name=/path/to/python.
    peer_limit: for all a peer does with one bar [s].  json_file, plot: where to write them; None does not.
    """

    sizes: str = "1k,5k,20k,100k"
    stiffness: str = "1e6"
    poisson: float = 0.4
    model: str = "corotational"
    modes: int = 20
    plasticity: str = "none"
    solver: str = SOLVERS[0]
    precision: str = "f32"
    arch: str | None = None
    threads: int | None = None
    steps: int = 60
    budget: float = 45.0
    no_cold: bool = False
    against: str = ""
    peer_python: tuple[str, ...] = ()
    peer_limit: float = 300.0
    json_file: Path | None = None
    plot: Path | None = None


class Plan:
    """What is to be measured: `cubes` across the bar by size as written, moduli, solvers, peers, their interpreters.

    Raises InputError if an option makes no sense, if a file cannot be written or cannot be drawn.
    """

    def __init__(self, options: BenchOptions) -> None:
        for name, seconds in (("--budget", options.budget), ("--peer-limit", options.peer_limit)):
            if not seconds > 0:
                raise InputError(f"{name} is {seconds:g}: give seconds above 0")
        if not -1 < options.poisson < 0.5:
            raise InputError(f"--poisson is {options.poisson:g}: give a number above -1 and below 0.5")
        self.cubes = {text: cubes_across(tets(text)) for text in _listed(options.sizes)}
        self.moduli = _each(options.stiffness, modulus)
        self.solvers = _each(options.solver, lambda text: _known("--solver", text, SOLVERS))
        self.peers = _each(options.against, lambda text: _known("--against", text, PEERS)) if options.against else []
        self.interpreters = interpreters(options.peer_python)
        self.material = {
            "model": options.model,
            "modes": options.modes,
            "plasticity": options.plasticity,
            "poisson": options.poisson,
        }
        self.machine = {"precision": options.precision, "arch": options.arch, "threads": options.threads}
        if options.plot is not None:
            need_plot(options.plot)
        if options.json_file is not None:
            need_place(options.json_file)


def tets(text: str) -> int:
    """A number of tetrahedra, as in 20k, 1m or 1280."""
    number = text.lower()
    try:
        count = float(number.rstrip("km")) * UNITS.get(number[-1:], 1)
    except ValueError:
        count = math.nan
    if not 1 <= count <= MOST_TETS or number[-2:-1] in UNITS:
        raise InputError(f"--sizes: {text!r} is no number of tetrahedra: write 1k,1m or 1280, at most {MOST_TETS:,}")
    return round(count)


def cubes_across(count: int) -> int:
    """Cubes across a bar of about that many tetrahedra."""
    return max(1, round((count / 20) ** (1 / 3)))


def modulus(text: str) -> float:
    """A Young's modulus [Pa]."""
    try:
        value = float(text)
    except ValueError:
        value = math.nan
    if not (value > 0 and math.isfinite(value)):
        raise InputError(f"--stiffness: {text!r} is no Young's modulus [Pa] above 0: write 1e5,1e6")
    return value


def interpreters(given: Iterable[str]) -> dict[str, str]:
    """The Python that runs each peer: of an environment that has it, or this one."""
    named = {}
    for text in given:
        name, _, path = text.partition("=")
        _known("--peer-python", name, PEERS)
        program = shutil.which(os.path.expanduser(path))
        if program is None:
            raise InputError(f"--peer-python {text}: {path or 'nothing'!r} is no program: write {name}=/path/to/python")
        named[name] = os.path.abspath(program)  # not resolved: the link tells the environment
    same = {PEERS[name].script: path for name, path in named.items()}  # what runs newton runs newton-semi-implicit
    return {name: named.get(name, same.get(peer.script, sys.executable)) for name, peer in PEERS.items()}


def _listed(text: str) -> list[str]:
    return [part.strip() for part in text.split(",")]


def _each(text: str, read: Callable[[str], T]) -> list[T]:
    """What a list says, without repetitions."""
    return list(dict.fromkeys(read(part) for part in _listed(text)))


def _known(option: str, text: str, known: Iterable[str]) -> str:
    if text not in known:
        raise InputError(f"{option}: {text!r} is not known: choose from {', '.join(known)}")
    return text
