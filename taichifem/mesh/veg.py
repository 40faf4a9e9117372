"""VegaFEM's `.veg` text format: vertices, linear tetrahedra, and regions made of sets of elements."""

from pathlib import Path

import numpy as np

from taichifem.errors import InputError


def read_veg(path: Path) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Points (n, 3), cells (m, 4) from 0, and regions (m,): 1 for the set of the first REGION, and so on.

    Raises:
        InputError: the elements are not linear tetrahedra, or the text is not what the format says.
    """
    sections = _sections(path.read_text(errors="replace"))
    points, cells, sets, regions = None, None, {}, []
    for words, lines in sections:
        match words[0].upper():
            case "*VERTICES":
                points, vertex_base = _table(lines[1:], float, 3)
            case "*ELEMENTS":
                kind = lines[0][0].upper() if lines else "nothing"
                if kind == "CUBIC":
                    raise InputError("holds hexahedral (CUBIC) elements; convert them to tetrahedra first")
                if not kind.startswith("TET"):
                    raise InputError(f"holds {kind} elements; only TET is read")
                cells, cell_base = _table(lines[2:], int, 4)
            case "*SET":
                sets[words[1]] = np.array([int(word) for line in lines for word in line])
            case "*REGION":
                regions.append(lines[0][0])
    if points is None or cells is None:
        raise InputError("lacks a *VERTICES or an *ELEMENTS section")
    labels = np.zeros(len(cells), np.int32)
    for label, name in enumerate(regions, start=1):
        if name == "allElements":
            labels[:] = label
        else:
            labels[sets[name] - cell_base] = label
    return points, cells - vertex_base, labels


def _sections(text: str) -> list[tuple[list[str], list[list[str]]]]:
    """Each `*NAME arguments` with the lines below it as words; comments and empty lines are gone."""
    sections = []
    for line in text.splitlines():
        words = line.split("#")[0].replace(",", " ").split()
        if words and words[0].startswith("*"):
            sections.append((words, []))
        elif words and sections:
            sections[-1][1].append(words)
    return sections


def _table(lines: list[list[str]], number: type, width: int) -> tuple[np.ndarray, int]:
    """Rows `id value value ...` as an array without the ids, and the first id; ids count up by one."""
    ids = np.array([int(words[0]) for words in lines])
    if len(ids) == 0 or np.any(np.diff(ids) != 1):
        raise InputError("has ids that do not count up by one")
    return np.array([[number(word) for word in words[1 : width + 1]] for words in lines]), int(ids[0])
