"""Where tables are printed."""

from __future__ import annotations

from rich.console import Console
from rich.table import Table

WIDE = 200


def console() -> Console:
    """Standard output: as wide as the terminal, or wide enough for every table in a file or pipe."""
    plain = Console(highlight=False, markup=False)
    return plain if plain.is_terminal else Console(highlight=False, markup=False, width=WIDE)


def table(*columns: str, right: tuple[str, ...] = ()) -> Table:
    """An empty table without frame; the columns named in `right` are aligned there."""
    made = Table(box=None, pad_edge=False, padding=(0, 2, 0, 0))
    for column in columns:
        made.add_column(column, justify="right" if column in right else "left", overflow="fold")
    return made
