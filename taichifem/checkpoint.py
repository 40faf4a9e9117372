"""Checkpoint files: named arrays and a header, written atomically, refused when damaged or foreign."""

from __future__ import annotations

import hashlib
import json
import os
import zipfile
from collections.abc import Mapping
from pathlib import Path

import numpy as np

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
