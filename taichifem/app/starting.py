"""Taichi started for a command, its failures told in one line."""

from __future__ import annotations

from taichifem.errors import InputError


def start_taichi(arch: str | None, threads: int | None) -> None:
    """`runtime.start`, with whatever Taichi raises turned into InputError."""
    try:
        from taichifem import runtime

        runtime.ti.set_logging_level(runtime.ti.ERROR)  # a missing driver is told once, by us
        runtime.start(arch=arch, threads=threads)
    except (InputError, ModuleNotFoundError):
        raise
    except Exception as error:  # Taichi raises nearly anything: driver errors, failed assertions
        reason = next(iter(str(error).splitlines()), type(error).__name__)
        raise InputError(f"Taichi does not start on {arch or 'cpu'}: {reason}: try --arch cpu") from None
