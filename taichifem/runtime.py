"""The only place that starts Taichi. Everywhere else: `from taichifem.runtime import ti`.

One process runs one arch; simulations in single and double precision live side by side in it. Taichi gives
literals in kernels the type `default_fp` at the time a kernel is compiled, so whoever launches kernels on
fields of some precision does it inside `with precision_of(...)`.
"""

from __future__ import annotations

import contextlib
import ctypes
import io
import os
import sys
from collections.abc import Iterator

from taichifem.errors import InputError

os.environ.setdefault("ENABLE_TAICHI_HEADER_PRINT", "0")
if sys.platform.startswith("linux"):
    try:
        ctypes.CDLL("libX11.so.6")
    except OSError:
        raise InputError(
            "Taichi needs the system library libX11.so.6: install it (Debian, Ubuntu: apt-get install libx11-6)"
        ) from None

import taichi as ti
from taichi.lang import impl

from taichifem.quick_start import quicken

quicken()

ARCHES = ("cpu", "cuda", "vulkan", "metal")
PRECISIONS = {"f32": ti.f32, "f64": ti.f64}

OPTIONS = {"make_cpu_multithreading_loop": False, "advanced_optimization": False}
"""Left on, the first has Taichi deal loops out to threads in runs of 512 at least, however long one turn takes; the
second triples the time of compilation, and LLVM optimises as well without it."""

generation = 0
"""Counts the starts of Taichi: fields made under an earlier number are gone."""

_running: tuple[str, int | None] | None = None


def start(*, arch: str | None = None, threads: int | None = None) -> None:
    """Start Taichi on `arch` with `threads` CPU threads, unless it runs like that already.

    None keeps what is running ("cpu" and all cores at the first start). A change of arch or threads restarts
    Taichi, which ends every simulation made before. Raises InputError if the arch is unknown or not there.
    """
    global _running, generation
    if _running is not None and arch in (None, _running[0]) and threads in (None, _running[1]):
        return
    arch = arch or (_running[0] if _running else "cpu")
    if arch not in ARCHES:
        raise InputError(f"arch is {arch!r}: choose one of {', '.join(ARCHES)}")
    if threads is not None and threads < 1:
        raise InputError(f"threads is {threads}: give at least 1")
    if arch != "cpu" and not _has(arch):
        raise InputError(f"arch {arch!r} is not available on this machine: use --arch cpu")
    ti.set_logging_level(ti.ERROR)
    options = {} if threads is None else {"cpu_max_num_threads": threads}
    # Taichi prints what it starts on, whatever the log level.
    with contextlib.redirect_stdout(io.StringIO()):
        ti.init(arch=getattr(ti, arch), log_level=ti.ERROR, offline_cache=True, default_ip=ti.i32, **OPTIONS, **options)
    _running = (arch, threads)
    generation += 1


def threads() -> int:
    """How many CPU threads kernels run on."""
    start()
    return int(impl.current_cfg().cpu_max_num_threads)


def _has(arch: str) -> bool:
    from taichi._lib import core

    return bool(getattr(core, f"with_{arch}")())


def running_arch() -> str:
    """The arch Taichi runs on; starts it on the CPU if it does not run yet."""
    start()
    return _running[0]


@contextlib.contextmanager
def precision_of(precision: str) -> Iterator[None]:
    """Kernels compiled inside give their literals this precision ("f32" or "f64")."""
    runtime = impl.get_runtime()
    before = runtime.default_fp
    runtime.set_default_fp(PRECISIONS[precision])
    try:
        yield
    finally:
        runtime.set_default_fp(before)
