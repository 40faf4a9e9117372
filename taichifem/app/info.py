"""`taichifem info`: what is installed, what works on this machine, what will be used and why."""

from __future__ import annotations

import importlib.metadata
import os
import platform
import subprocess
import sys

from taichifem.app.console import console, table
from taichifem.app.options import ARCHES

PACKAGES = ("taichi", "numpy", "scipy", "meshio", "trimesh", "av", "pillow")
EXTRAS = {"tetrahedralize": "pytetwild", "vtk": "pyvista"}
START = "from taichifem import runtime; runtime.start(arch={arch!r}); f = runtime.ti.field(int, 8); f.fill(1); f[0]"
PROBE_SECONDS = 60


def show_info() -> None:
    """Print everything; the probes of arches and renderers take some seconds."""
    screen = console()
    for title, rows in (
        ("Versions", versions()),
        ("Machine", machine()),
        ("Arches (--arch)", arches()),
        ("Renderers (--renderer)", renderers()),
        ("Extras", extras()),
        ("Caches", caches()),
    ):
        listing = table("name", "is")
        listing.show_header = False
        for row in rows:
            listing.add_row(f"  {row[0]}", row[1])
        screen.print(title, listing, sep="\n")


def versions() -> list[tuple[str, str]]:
    """(package, version), this one and Python first."""
    from taichifem import __version__

    rows = [("taichifem", __version__), ("python", platform.python_version())]
    return rows + [(name, _version(name) or "not installed") for name in PACKAGES]


def machine() -> list[tuple[str, str]]:
    """Platform, cores and memory."""
    usable = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count()
    return [
        ("platform", platform.platform()),
        ("processor", _processor()),
        ("cores", f"{usable} of {os.cpu_count()} usable"),
        ("memory", memory()),
    ]


def memory() -> str:
    """Physical memory in GiB, or "unknown"."""
    try:
        pages, size = os.sysconf("SC_PHYS_PAGES"), os.sysconf("SC_PAGE_SIZE")
    except (AttributeError, OSError, ValueError):  # not on Windows
        return "unknown"
    return f"{pages * size / 2**30:.1f} GiB"


def arches() -> list[tuple[str, str]]:
    """Whether each arch works here; those that claim to be there are tried in a process of their own."""
    from taichifem import runtime

    runtime.start()  # Taichi is not quiet about missing drivers before
    rows = [("cpu", "works; used unless --arch says otherwise")]
    for arch in ARCHES[1:]:
        there = bool(getattr(runtime.ti._lib.core, f"with_{arch}")())
        rows.append((arch, _try_arch(arch) if there else "not here: no driver, or no such device for this system"))
    return rows


def _try_arch(arch: str) -> str:
    try:
        tried = subprocess.run(
            [sys.executable, "-c", START.format(arch=arch)], capture_output=True, text=True, timeout=PROBE_SECONDS
        )
    except subprocess.TimeoutExpired:
        return f"does not start within {PROBE_SECONDS} s"
    if tried.returncode == 0:
        return "works"
    return "does not start: " + next(reversed(tried.stderr.strip().splitlines()), f"code {tried.returncode}")


def renderers() -> list[tuple[str, str]]:
    """Whether each renderer works here, and which is the default."""
    from taichifem.output.renderer import available_renderers

    return [
        ("auto", "taichi, which needs no display and no driver"),
        *((name, f"{'works' if works else 'not here'}: {why}") for name, works, why in available_renderers()),
    ]


def extras() -> list[tuple[str, str]]:
    """Whether the optional packages are installed, and how they would be."""
    rows = []
    for extra, package in EXTRAS.items():
        version = _version(package)
        missing = f'not installed: pip install "taichifem[{extra}]"'
        rows.append((extra, f"{package} {version}" if version else missing))
    return rows


def caches() -> list[tuple[str, str]]:
    """Folders that may be deleted at any time: they only save time."""
    from taichifem.mesh.tetrahedralize import cache_folder
    from taichifem.runtime import ti

    config = ti.lang.impl.default_cfg()
    kernels = os.environ.get("TI_OFFLINE_CACHE_FILE_PATH") or config.offline_cache_file_path
    return [("compiled kernels", str(kernels)), ("tetrahedra", str(cache_folder()))]


def _version(package: str) -> str | None:
    try:
        return importlib.metadata.version(package)
    except importlib.metadata.PackageNotFoundError:
        return None


def _processor() -> str:
    """The processor's name; on Linux the platform module only knows the architecture."""
    try:
        with open("/proc/cpuinfo", encoding="utf-8", errors="replace") as file:
            for line in file:
                if line.startswith("model name"):
                    return line.partition(":")[2].strip()
    except OSError:
        pass
    return platform.processor() or platform.machine()
