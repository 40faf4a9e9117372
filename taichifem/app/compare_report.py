"""What `taichifem compare` says in the end: a table, and a file with all figures."""

from __future__ import annotations

from taichifem.app.console import console, table

EXPLANATION = (
    "ms a step, iterations a step: medians, taken in turns on the same machine; the first step, which also compiles, "
    "is not counted.",
    "energy drift: change of the total energy over the run, relative to the largest kinetic + |elastic| energy seen; "
    "damping, contact and moving pins change it as well.",
    "largest explicit dt: beyond it an explicit method (symplectic Euler) is unstable in the state at the start.",
)


def print_report(rows: list[dict]) -> None:
    """Print the table of the choices and what its columns mean."""
    screen = console()
    right = ("ms a step", "steps", "iterations a step", "energy drift", "largest explicit dt [ms]")
    listing = table("choice", *right, "at the end", right=right)
    for row in rows:
        drift, critical = row["energy"]["drift"], row["critical_step_s"]
        listing.add_row(
            row["choice"],
            f"{row['ms']['median']:.2f}" if row["ms"] else "-",
            str(row["steps"]),
            f"{row['iterations']['median']:.0f}" if row["iterations"] else "-",
            "-" if drift is None else f"{100 * drift:+.3g} %",
            "-" if critical is None else f"{1e3 * critical:.3g}",
            "ok" if row["diverged_at_s"] is None else f"diverged at t = {row['diverged_at_s']:.4g} s",
        )
    screen.print(listing)
    screen.print()
    for line in EXPLANATION:
        screen.print(line)
