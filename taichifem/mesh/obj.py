"""Wavefront's `.obj` text format: the triangles as they are numbered there, without seams of texture or normals."""

from pathlib import Path

import numpy as np

from taichifem.errors import InputError


def read_obj(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), triangles (m, 3) from 0, and regions (m,): 1 for the first group `g` that has triangles, and so
    on; 0 for what stands before any group.

    Raises:
        InputError: a face is no triangle, or there is none.
    """
    points, cells, groups, group = [], [], [], ""
    for line in path.read_text(errors="replace").splitlines():
        keyword, *words = line.split("#")[0].split() or [""]
        if keyword == "v":
            points.append([float(word) for word in words[:3]])
        elif keyword == "g":
            group = " ".join(words)
        elif keyword == "f":
            if len(words) != 3:
                raise InputError(f"holds faces of {len(words)} corners; convert them to triangles")
            corners = [int(word.split("/")[0]) for word in words]
            cells.append([corner - 1 if corner > 0 else len(points) + corner for corner in corners])
            groups.append(group)
    if not cells:
        raise InputError("has no triangles; export a triangulated mesh")
    labels = {name: label for label, name in enumerate(dict.fromkeys(name for name in groups if name), start=1)}
    return np.array(points), np.array(cells), np.array([labels.get(name, 0) for name in groups])
