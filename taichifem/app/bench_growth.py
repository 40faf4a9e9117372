"""How the time of a step grows with the size of the bar."""

from __future__ import annotations

import math

LARGE = 15_000  # tetrahedra from which on fixed costs hardly count


def growth(rows: list[dict]) -> list[dict]:
    """The exponent p in time ~ tets^p for each stiffness and solver that was measured at several sizes.

    From the large bars alone where there are two of them.
    """
    groups: dict[tuple, dict[int, float]] = {}
    for row in rows:
        groups.setdefault((row["youngs"], row["solver"]), {})[row["tets"]] = row["ms"]["median"]
    found = []
    for (youngs, solver), times in groups.items():
        large = {tets: ms for tets, ms in times.items() if tets >= LARGE}
        used = large if len(large) > 1 else times
        if len(used) > 1:
            found.append({"youngs": youngs, "solver": solver, "exponent": slope(used), "tets": sorted(used)})
    return found


def slope(times: dict[int, float]) -> float:
    """Of the straight line through log(value) over log(key), by least squares."""
    x, y = [math.log(tets) for tets in times], [math.log(ms) for ms in times.values()]
    middle_x, middle_y = sum(x) / len(x), sum(y) / len(y)
    off = [value - middle_x for value in x]
    return sum(a * (b - middle_y) for a, b in zip(off, y, strict=True)) / sum(a * a for a in off)
