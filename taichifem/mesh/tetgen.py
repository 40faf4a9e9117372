"""TetGen's pair of text files: `.node` with points and `.ele` with tetrahedra."""

from pathlib import Path

import numpy as np

from taichifem.errors import InputError


def read_tetgen(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), cells (m, 4) from 0, and regions (m,) from the first attribute of the elements.

    Args:
        path: either file of the pair.

    Raises:
        InputError: the other file is missing, or the text is not what the format says.
    """
    node, ele = path.with_suffix(".node"), path.with_suffix(".ele")
    for file in (node, ele):
        if not file.is_file():
            raise InputError(f"needs {file.name} beside it, and it is not there")
    (_, dimension, *_), points = _rows(node, float)
    (_, corners, *_), cells = _rows(ele, float)
    if dimension != 3 or corners != 4:
        raise InputError(f"has {dimension}-dimensional points and {corners}-node elements; 3 and 4 are needed")
    regions = cells[:, 5] if cells.shape[1] > 5 else np.zeros(len(cells))
    return points[:, 1:4], cells[:, 1:5].astype(np.int64) - int(points[0, 0]), regions.astype(np.int32)


def _rows(file: Path, number: type) -> tuple[list[int], np.ndarray]:
    """The numbers of the first line, and the rows that it announces, with their ids."""
    lines = (line.split("#")[0].split() for line in file.read_text(errors="replace").splitlines())
    header, *rows = [words for words in lines if words]
    header = [int(word) for word in header]
    if len(rows) < header[0]:
        raise InputError(f"announces {header[0]} rows in {file.name} but has {len(rows)}")
    table = np.array([[number(word) for word in words] for words in rows[: header[0]]])
    if np.any(np.diff(table[:, 0]) != 1):
        raise InputError(f"has ids in {file.name} that do not count up by one")
    return header, table
