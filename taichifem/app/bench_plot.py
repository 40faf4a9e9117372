"""The picture of `taichifem bench --plot`: time of a step over the size of the bar. Matplotlib is an extra."""

from __future__ import annotations

from pathlib import Path

from taichifem.errors import InputError
from taichifem.files import need_place, replacing

SUFFIXES = (".png", ".pdf", ".svg")
# Okabe and Ito's, told apart by the colour-blind too, with wine in place of the pale yellow.
COLORS = ("#0072B2", "#D55E00", "#009E73", "#CC79A7", "#E69F00", "#56B4E9", "#000000", "#882255")
MARKERS = "os^Dv*P"
REAL_TIME = 1e3 / 60  # [ms]
GREY = "#666666"


def need_plot(path: Path) -> None:
    """Tell before anything is measured that a plot cannot be drawn or written. Raises InputError."""
    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"--plot {path}: end the name in {', '.join(SUFFIXES[:-1])} or {SUFFIXES[-1]}")
    try:
        import matplotlib  # noqa: F401
    except ModuleNotFoundError:
        raise InputError('--plot needs an extra that is not installed: pip install "taichifem[plot]"') from None
    need_place(path)


def write_plot(path: Path, rows: list[dict], peers: list[dict]) -> None:
    """Draw a line for each stiffness and solver of ours, and for each peer and stiffness. Raises InputError."""
    from matplotlib.figure import Figure
    from matplotlib.ticker import NullLocator, StrMethodFormatter

    lines = curves(rows, peers)
    sizes = sorted({tets for curve in lines.values() for tets, _ in curve["points"]})
    figure = Figure(figsize=(9, 5), layout="constrained")
    axes = figure.add_subplot(xscale="log", yscale="log", xlabel="tetrahedra", ylabel="time of a frame of 1/60 s [ms]")
    for name, curve in sorted(lines.items(), key=lambda item: -item[1]["points"][-1][1]):  # as they lie at the right
        axes.plot(*zip(*curve["points"], strict=True), label=name, **curve["style"])
    _guides(axes, sizes, next(iter(lines.values()))["points"][-1])
    axes.set_xticks(sizes)
    axes.xaxis.set(major_formatter=StrMethodFormatter("{x:,.0f}"), minor_locator=NullLocator())
    axes.yaxis.set(major_formatter=StrMethodFormatter("{x:,g}"))
    axes.legend(loc="upper left", bbox_to_anchor=(1.01, 1), borderaxespad=0, frameon=False)
    axes.grid(which="major", color="#e4e4e4", linewidth=0.6)
    axes.spines[["top", "right"]].set_visible(False)
    with replacing(path) as part:
        figure.savefig(part, format=path.suffix[1:].lower(), dpi=160)


def curves(rows: list[dict], peers: list[dict]) -> dict[str, dict]:
    """Name of each line, its (tetrahedra, ms) in order of size, and how it is drawn.

    The colour tells the program and its solver, the marker the stiffness.
    """
    measured = [row for row in peers if row["status"] == "measured"]
    programs = [*((f"taichifem, {row['solver']}", row) for row in rows), *((row["peer"], row) for row in measured)]
    names = list(dict.fromkeys(name for name, _ in programs))
    moduli = sorted({row["youngs"] for _, row in programs})
    found: dict[str, dict] = {}
    for name, row in programs:
        label = name if len(moduli) == 1 else f"{name}, {row['youngs'] / 1e6:g} MPa"
        kind = names.index(name)
        style = {
            "color": COLORS[kind % len(COLORS)],
            "marker": MARKERS[moduli.index(row["youngs"]) % len(MARKERS)],
            "linewidth": 2.2 if name.startswith("taichifem") else 1.3,
        }
        found.setdefault(label, {"points": [], "style": style})["points"].append((row["tets"], row["ms"]["median"]))
    for curve in found.values():
        curve["points"].sort()
    return found


def _guides(axes, sizes: list[int], end: tuple[int, float]) -> None:
    """The time of real time, and growth in proportion to the size, through the end of the first line."""
    if len(sizes) > 1:
        ends = [sizes[0], sizes[-1]]
        axes.plot(ends, [end[1] * tets / end[0] for tets in ends], "--", color=GREY, linewidth=1, label="slope 1")
    axes.axhline(REAL_TIME, color=GREY, linewidth=1, label="60 frames a second")
