"""Filling closed surfaces with tetrahedra by fTetWild, through the optional package `pytetwild`.

Y. Hu, T. Schneider, B. Wang, D. Zorin, D. Panozzo, "Fast Tetrahedral Meshing in the Wild", ACM Transactions
on Graphics 39(4), 2020.
"""

import contextlib
import hashlib
import importlib.metadata
import json
import os
import subprocess
import sys
import tempfile
from numbers import Integral
from pathlib import Path

import numpy as np

from taichifem.errors import InputError
from taichifem.mesh.surfaces import closed_surface, enclosed_volume

RECIPE = 2  # part of the cache's key: raise it when the way of meshing changes
DEFAULT_EDGE = 0.05  # the library's own: edge length over the diagonal of the bounding box
ENVELOPE = 0.05  # how far the new surface may stray from the old one, in lengths of an edge
LONGEST_EDGE = 0.2  # beyond it only the envelope makes meshes coarser, and long edges cost time
TOLERANCE, TRIES = 0.25, 5


def tetrahedralize(points, triangles, tets: int | None = None) -> tuple[np.ndarray, np.ndarray]:
    """Fill a closed surface with tetrahedra, or fetch the result of an earlier time from the cache.

    Args:
        points: (n, 3) positions [m]; points at the same place are merged.
        triangles: (k, 3) vertex indices.
        tets: how many tetrahedra to aim at, or None for the library's default edge length.

    Returns:
        Points (p, 3) float64 and cells (m, 4) int32.

    Raises:
        InputError: the surface is open or encloses nothing, `tets` is no sensible count, or the extra
            `tetrahedralize` is not installed.
    """
    if tets is not None and (isinstance(tets, bool) or not isinstance(tets, Integral) or tets < 10):
        raise InputError(f"the number of tetrahedra must be a whole number of at least 10, not {tets!r}")
    points, triangles = closed_surface(points, triangles)
    try:
        version = importlib.metadata.version("pytetwild")
    except importlib.metadata.PackageNotFoundError:
        raise InputError(
            'filling a surface needs an extra that is not installed: pip install "taichifem[tetrahedralize]"'
        ) from None
    key = hashlib.sha256(repr((RECIPE, version, tets, points.shape)).encode())
    key.update(points.tobytes()), key.update(triangles.tobytes())
    entry = cache_folder() / f"{key.hexdigest()[:32]}.npz"
    result = _load(entry)
    if result is None:
        result = _search(points, triangles, tets)
        _store(entry, *result)
    return result


def cache_folder() -> Path:
    """Where results are kept: `taichifem/tetrahedra` in XDG_CACHE_HOME, else in ~/.cache."""
    base = os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache"
    return Path(base) / "taichifem" / "tetrahedra"


def _search(points, triangles, tets: int | None) -> tuple[np.ndarray, np.ndarray]:
    """Try edge lengths until the count is near the target; the best try wins.

    Counts jump from one edge length to the next. Where no plain fill is near the target, coarsened ones are tried,
    which have fewer tetrahedra inside and jump elsewhere.
    """
    if tets is None:
        return _fill(points, triangles, DEFAULT_EDGE)
    diagonal = np.linalg.norm(np.ptp(points, axis=0))
    guess = (6 * 2**0.5 * enclosed_volume(points, triangles) / tets) ** (1 / 3) / diagonal
    fills = []
    for coarsen in (False, True):
        edge, tried = guess, []
        for _ in range(TRIES):
            edge = float(np.clip(edge, 1e-3, 1))
            fills.append(_fill(points, triangles, edge, coarsen))
            count = len(fills[-1][1])
            if abs(count / tets - 1) < TOLERANCE:
                return fills[-1]
            tried.append((edge, count))
            edge = _next_edge(tried, tets)
    return min(fills, key=lambda fill: abs(np.log(len(fill[1]) / tets)))


def _next_edge(tried: list[tuple[float, int]], tets: int) -> float:
    """Between the nearest tries on both sides of the target, by a power law; else a step by a typical one."""
    more = [t for t in tried if t[1] > tets]
    less = [t for t in tried if t[1] <= tets]
    if more and less:
        (e1, n1), (e2, n2) = min(more, key=lambda t: t[1]), max(less, key=lambda t: t[1])
        share = np.log(tets / n1) / np.log(n2 / n1)
        return float(e1 * (e2 / e1) ** np.clip(share, 0.1, 0.9))
    edge, count = min(more, key=lambda t: t[1]) if more else max(less, key=lambda t: t[1])
    return edge * (count / tets) ** (1 / 1.5)


# fTetWild runs in a process of its own: it leaves files in the working folder, prints, and may crash.
FILL = """
import json, sys, numpy, pytetwild
surface = numpy.load("surface.npz")
points, cells = pytetwild.tetrahedralize(surface["points"], surface["triangles"], **json.loads(sys.argv[1]))
numpy.savez("filled.npz", points=points, cells=cells)
"""


def _fill(points, triangles, edge: float, coarsen: bool = False) -> tuple[np.ndarray, np.ndarray]:
    """One run of fTetWild. `edge` and the envelope are relative to the diagonal of the bounding box."""
    options = {
        "edge_length_fac": min(edge, LONGEST_EDGE),
        "epsilon": min(max(ENVELOPE * edge, 2e-4), 5e-2),
        "coarsen": coarsen,
        "num_threads": 1,
        "quiet": True,
        "vtk_ordering": True,
    }
    paths = {**os.environ, "PYTHONPATH": os.pathsep.join(path for path in sys.path if path)}
    with tempfile.TemporaryDirectory(prefix="taichifem-") as folder:
        np.savez(Path(folder) / "surface.npz", points=points, triangles=triangles.astype(np.int32))
        command = [sys.executable, "-c", FILL, json.dumps(options)]
        run = subprocess.run(command, cwd=folder, env=paths, capture_output=True, text=True, errors="replace")
        filled = _load(Path(folder) / "filled.npz") if run.returncode == 0 else None
    if filled is None:
        reason = (run.stderr.strip().splitlines() or [f"exit status {run.returncode}"])[-1]
        raise InputError(f"the tetrahedraliser failed ({reason[:120]}); simplify or repair the surface")
    if len(filled[1]) == 0:
        raise InputError("the tetrahedraliser found no inside; check that the surface encloses a volume")
    return filled[0].astype(np.float64), filled[1].astype(np.int32)


def _load(entry: Path) -> tuple[np.ndarray, np.ndarray] | None:
    """A cached result, or None where there is none or it is damaged."""
    try:
        with np.load(entry, allow_pickle=False) as stored:
            points, cells = stored["points"], stored["cells"]
    except Exception:  # a damaged archive can raise nearly anything; it is then made anew
        return None
    fits = points.ndim == cells.ndim == 2 and points.shape[1] == 3 and cells.shape[1] == 4
    return (points, cells) if fits else None


def _store(entry: Path, points: np.ndarray, cells: np.ndarray) -> None:
    """Keep a result; a cache that cannot be written is no reason to stop."""
    with contextlib.suppress(OSError):
        entry.parent.mkdir(parents=True, exist_ok=True)
        with tempfile.TemporaryDirectory(dir=entry.parent) as folder:
            fresh = Path(folder) / entry.name
            np.savez_compressed(fresh, points=points, cells=cells)
            os.replace(fresh, entry)
