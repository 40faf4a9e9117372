"""The pair of text files of TetGen and Triangle: `.node` with points, `.ele` with tetrahedra or triangles."""

from pathlib import Path

import numpy as np

from taichifem.errors import InputError


def read_tetgen(path: Path, dimension: int = 3) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, d), cells (m, d + 1) from 0, and regions (m,) from the first attribute of the elements.

    Args:
        path: either file of the pair.
        dimension: d, 3 for tetrahedra and 2 for triangles.

    Raises:
        InputError: the other file is missing, or the text is not what the format says.
    """
    node, ele = path.with_suffix(".node"), path.with_suffix(".ele")
    for file in (node, ele):
        if not file.is_file():
            raise InputError(f"needs {file.name} beside it, and it is not there")
    (_, axes, *_), points = _rows(node, float)
    (_, corners, *_), cells = _rows(ele, float)
    if (axes, corners) != (dimension, dimension + 1):
        raise InputError(
            f"has {axes}-dimensional points and {corners}-node elements; {dimension} and {dimension + 1} are needed"
        )
    numbers, attribute = cells[:, 1 : corners + 1].astype(np.int64) - int(points[0, 0]), corners + 1
    regions = cells[:, attribute] if cells.shape[1] > attribute else np.zeros(len(cells))
    return points[:, 1 : dimension + 1], numbers, regions.astype(np.int32)


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
