"""The tables of `taichifem bench`."""

from __future__ import annotations

from taichifem.app.bench_against import against, told
from taichifem.app.bench_growth import LARGE
from taichifem.app.bench_peers import TAIL
from taichifem.app.console import console, table


def print_report(*, rows: list[dict], peers: list[dict], growth: list[dict]) -> None:
    """Print what a step takes and how that grows, what surrounds it, and how other programs do."""
    screen = console()
    screen.print("Time per step: median (10th to 90th percentile) [ms], of which in each phase", _steps(rows), sep="\n")
    for line in growth:
        screen.print(_growth(line))
    for row in rows:
        if "elastic_ms" in row:
            screen.print(_plastic(row))
        if "full_ms" in row:
            screen.print(_reduced(row))
    screen.print("\nStart, memory, result", _start(rows), sep="\n")
    if any(row["product"] for row in rows):
        screen.print(
            "\nThe matrix product alone, against a plain read of the matrix by the same threads (best of a few)",
            _products([row for row in rows if row["product"]]),
            sep="\n",
        )
    if peers:
        screen.print(
            "\nThe same bar in other programs: time of a frame, median (10th to 90th percentile) [ms], and where the "
            f"tip is [m],\nat the lowest and in the mean of the last {TAIL} frames, beside ours after as many frames",
            against(rows, peers),
            sep="\n",
        )
    probes = ", ".join(f"{row['probe_ms']:.1f}" for row in rows)
    screen.print(f"\nSpeed of the machine meanwhile: a fixed piece of NumPy took {probes} ms.")


def _steps(rows: list[dict]):
    phases = list(dict.fromkeys(name for row in rows for name in row["phases_ms"]))
    right = ("E [Pa]", "steps", "ms a step", *phases, "CG iterations", "residual", "x real time")
    listing = table("tets", "solver", *right, right=("tets", *right))
    for row in rows:
        counts = row["iterations"]
        capped = f", {row['capped_steps']} capped" if row["capped_steps"] else ""
        listing.add_row(
            f"{row['tets']:,}",
            row["solver"],
            f"{row['youngs']:g}",
            str(row["steps"]),
            told(row["ms"]),
            *(f"{row['phases_ms'][name]['median']:.2f}" if name in row["phases_ms"] else "" for name in phases),
            f"{counts['median']:.0f} (most {counts['max']}{capped})",
            f"{row['residual']:.1e}",
            f"{row['real_time_factor']:.2f}",
        )
    return listing


def _products(rows: list[dict]):
    columns = ("tets", "E [Pa]", "solver", "a product [ms]", "GB/s", "plain read [GB/s]", "share")
    listing = table(*columns, right=tuple(c for c in columns if c != "solver"))
    for row in rows:
        product = row["product"]
        listing.add_row(
            f"{row['tets']:,}",
            f"{row['youngs']:g}",
            row["solver"],
            f"{product['ms']:.3f}",
            f"{product['gb_s']:.1f}",
            f"{product['read_gb_s']:.1f}",
            f"{product['gb_s'] / product['read_gb_s']:.0%}",
        )
    return listing


def _growth(line: dict) -> str:
    tets = line["tets"]
    small = "" if tets[0] >= LARGE else "; fixed costs count there"
    return (
        f"E = {line['youngs']:g} Pa, {line['solver']}: the time grows with the number of tetrahedra to the power "
        f"{line['exponent']:.2f} (from {tets[0]:,} to {tets[-1]:,}{small})"
    )


def _plastic(row: dict) -> str:
    ours, elastic = row["ms"]["median"], row["elastic_ms"]["median"]
    return (
        f"{row['tets']:,} tets, E = {row['youngs']:g} Pa: {row['plasticity']} takes {ours / elastic:.2f} times the "
        f"{told(row['elastic_ms'])} ms of the elastic bar beside it; {row['yielded']:.0%} of the elements have yielded"
    )


def _reduced(row: dict) -> str:
    ours, full = row["ms"]["median"], row["full_ms"]["median"]
    what = f"{row['modes']} modes" if row["model"] == "modal" else row["model"]
    return (
        f"{row['tets']:,} tets, E = {row['youngs']:g} Pa: {what} takes 1/{full / ours:.1f} of the "
        f"{told(row['full_ms'])} ms of the full linear bar beside it"
    )


def _start(rows: list[dict]):
    columns = (
        "tets",
        "E [Pa]",
        "nodes",
        "set-up [s]",
        "cold",
        "first step [s]",
        "cold",
        "peak [MiB]",
        "tip, lowest [m]",
        "at the end",
        "static, small strain",
    )
    listing = table(*columns, right=columns)
    for row in rows:
        listing.add_row(
            f"{row['tets']:,}",
            f"{row['youngs']:g}",
            f"{row['nodes']:,}",
            f"{row['setup_s']:.2f}",
            _or_dash(row["cold_setup_s"]),
            f"{row['first_step_s']:.2f}",
            _or_dash(row["cold_first_step_s"]),
            f"{row['peak_mib']:.0f}",
            f"{row['tip_lowest_m']:.4f}",
            f"{row['tip_m']:.4f}",
            f"{row['timoshenko_m']:.4f}",
        )
    return listing


def _or_dash(seconds: float | None) -> str:
    return "-" if seconds is None else f"{seconds:.2f}"
