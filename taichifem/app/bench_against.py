"""The table of `taichifem bench --against`: the same bars here and in other programs."""

from __future__ import annotations

from taichifem.app.bench_peers import tip_figures
from taichifem.app.console import table

FIGURES = ("tets", "E [Pa]", "frames", "ms a frame", "times ours", "lowest tip", "ours", "mean tip", "ours")


def against(rows: list[dict], peers: list[dict]):
    """For each bar our rows, then those of the peers. Their tips stand beside ours after as many frames."""
    listing = table("program", *FIGURES, "how", right=FIGURES)
    for bar in dict.fromkeys((row["tets"], row["youngs"]) for row in rows):
        here, there = ([row for row in some if (row["tets"], row["youngs"]) == bar] for some in (rows, peers))
        for row in here:
            ratio = row["ms"]["median"] / here[0]["ms"]["median"]
            lowest, mean = tip_figures(row["tips_m"]).values()
            tips = (f"{lowest:.3f}", "", f"{mean:.3f}", "")
            how = f"{row['model']}, implicit, {row['solver']}, {row['precision']}"
            listing.add_row("taichifem", *_bar(row), str(row["steps"]), told(row["ms"]), f"{ratio:.2f}", *tips, how)
        for row in there:
            listing.add_row(row["peer"], *_bar(row), *(_figures(row) if row["status"] == "measured" else _why(row)))
    return listing


def told(ms: dict[str, float]) -> str:
    """Median and spread of times."""
    return f"{ms['median']:.2f} ({ms['p10']:.2f}-{ms['p90']:.2f})"


def _bar(row: dict) -> tuple[str, str]:
    return f"{row['tets']:,}", f"{row['youngs']:g}"


def _figures(row: dict) -> tuple[str, ...]:
    pairs = [f"{row[key]:.3f}" for name in ("tip_lowest_m", "tip_mean_m") for key in (name, f"our_{name}")]
    parts = [row.get("law", ""), row.get("method", ""), row.get("precision", "")]
    if row.get("substeps", 1) > 1:
        parts.append(f"{row['substeps']} steps a frame")
    how = ", ".join(filter(None, parts))
    differs = f"; {row['differs']}" if row.get("differs") else ""
    return str(row["steps"]), told(row["ms"]), f"{row['times_ours']:.2f}", *pairs, how + differs


def _why(row: dict) -> tuple[str, ...]:
    """Nothing but the reason of a row without figures."""
    return *[""] * (len(FIGURES) - 2), f"{row['status']}: {row['reason']}"
