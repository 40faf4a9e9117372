"""Checkpoint files: named arrays and a header, written atomically, refused when damaged or foreign."""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from taichifem.clock import Clock, Timed
from taichifem.errors import InputError
from taichifem.files import replacing

FORMAT = "taichifem-checkpoint"
VERSION = 5


def fingerprint(*arrays: np.ndarray, text: str = "") -> str:
    """A short hash of arrays and a text: tells whether a checkpoint belongs to a scene."""
    digest = hashlib.sha256(text.encode())
    for array in arrays:
        digest.update(str((array.shape, array.dtype.str)).encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:16]


def write(path: str | os.PathLike, arrays: Mapping[str, np.ndarray], header: Mapping) -> None:
    """Write a checkpoint; one that is there already survives every failure.

    Raises InputError if the file cannot be written.
    """
    text = json.dumps({"format": FORMAT, "version": VERSION, **header})
    with replacing(path) as part, open(part, "wb") as file:
        np.savez(file, header=np.frombuffer(text.encode(), dtype=np.uint8), **arrays)
        file.flush()
        os.fsync(file.fileno())


def read(path: str | os.PathLike) -> tuple[dict[str, np.ndarray], dict]:
    """Arrays and header of a checkpoint. Raises InputError if it is missing, damaged or something else."""
    path = Path(path)
    try:
        with np.load(path, allow_pickle=False) as file:
            arrays = {name: file[name] for name in file.files}
        header = json.loads(arrays.pop("header").tobytes())
        if header["format"] != FORMAT:
            raise KeyError("format")
    except FileNotFoundError:
        raise InputError(f"{path}: there is no such checkpoint") from None
    except (OSError, ValueError, KeyError, EOFError, TypeError, AttributeError, zipfile.BadZipFile) as error:
        reason = type(error).__name__
        raise InputError(f"{path}: not a taichifem checkpoint, or a damaged one ({reason})") from None
    if header["version"] != VERSION:
        raise InputError(f"{path}: checkpoint version {header['version']}, this program reads {VERSION}")
    return arrays, header


class Resumable(Timed):
    """What can be written to a checkpoint and go on from it; how it gives and takes its state is its own."""

    def snapshot(self) -> tuple[dict[str, np.ndarray], dict]:
        """Arrays and a header with all that the next steps depend on, for `restore`."""
        raise NotImplementedError

    def restore(self, arrays: dict[str, np.ndarray], header: dict) -> None:
        """Go on from a `snapshot`."""
        raise NotImplementedError

    def _fingerprint(self) -> str:
        raise NotImplementedError

    def save(self, path: str | os.PathLike) -> None:
        """Write everything the next steps depend on; see `load`. Raises InputError if it cannot be written."""
        write(path, *self.snapshot())

    def load(self, path: str | os.PathLike) -> None:
        """Continue from a checkpoint of the same scene, integrator and precision, bit for bit as if never interrupted.

        Raises InputError if the file is missing, damaged, or belongs to another scene; nothing changes then.
        """
        arrays, header = read(path)
        clock = Clock(**header.get("clock", {"fps": 0}))
        same_steps = self.scene.substeps is None or clock.substeps == self.scene.substeps
        if header.get("scene") != self._fingerprint() or clock.fps != self.scene.fps or not same_steps:
            raise InputError(f"{path}: the checkpoint belongs to another scene, time step or precision")
        self.restore(arrays, header)
