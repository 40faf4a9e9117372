"""Several pictures side by side in one, with labels and thin dividers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from taichifem.errors import InputError
from taichifem.output.overlay import stamp

LEAST_SIDE = 16
"""Sides of the smallest tile [pixels]: renderers draw nothing smaller."""

_DIVIDER = (112, 118, 128)
_EMPTY = (236, 238, 240)
_FADED = 0.55  # how much of its colours a tile with a remark keeps


@dataclass(frozen=True, kw_only=True)
class Grid:
    """Equal tiles in rows; the last row may have gaps.

    size: (width, height) of the whole picture [pixels].  tile: of each tile.
    """

    size: tuple[int, int]
    columns: int
    rows: int
    tile: tuple[int, int]

    @classmethod
    def of(cls, count: int, size: tuple[int, int]) -> Grid:
        """The grid for `count` tiles in a picture of `size`: few gaps, tiles nearly square.

        Raises:
            InputError: the tiles would be too small.
        """
        ways = [(columns, -(-count // columns)) for columns in range(1, count + 1)]
        columns, rows = max(ways, key=lambda way: _merit(*way, count, size))
        gap = _gap(size)
        tile = ((size[0] - (columns - 1) * gap) // columns, (size[1] - (rows - 1) * gap) // rows)
        if min(tile) < LEAST_SIDE:
            least = f"{columns * (LEAST_SIDE + gap)}x{rows * (LEAST_SIDE + gap)}"
            raise InputError(f"a picture of {size[0]}x{size[1]} is too small for {count} tiles: give at least {least}")
        return cls(size=size, columns=columns, rows=rows, tile=tile)

    def blank(self) -> np.ndarray:
        """A picture (height,width,3) uint8 with dividers and empty tiles."""
        picture = np.full((self.size[1], self.size[0], 3), _DIVIDER, np.uint8)
        for number in range(self.columns * self.rows):
            self.part(picture, number)[...] = _EMPTY
        return picture

    def part(self, picture: np.ndarray, number: int) -> np.ndarray:
        """The part of `picture` that is tile `number`, row by row from 0: to be written into."""
        row, column = divmod(number, self.columns)
        x = _start(column, self.columns, self.size[0], self.tile[0])
        y = _start(row, self.rows, self.size[1], self.tile[1])
        return picture[y : y + self.tile[1], x : x + self.tile[0]]


def _merit(columns: int, rows: int, count: int, size: tuple[int, int]) -> float:
    """How well a grid suits: 1 without gaps and with square tiles, towards 0 otherwise."""
    shape = (size[0] / columns) / (size[1] / rows)
    return (count / (columns * rows)) ** 3 * min(shape, 1 / shape)


def _gap(size: tuple[int, int]) -> int:
    return max(1, round(min(size) / 360))


def _start(number: int, count: int, whole: int, side: int) -> int:
    """First pixel of a tile: the outer tiles touch the border, what does not divide goes to the dividers."""
    return round(number * (whole - side) / max(1, count - 1))


def label(tile: np.ndarray, text: str) -> None:
    """Write `text` at the foot of `tile` (height,width,3) uint8, in place, as large as a title."""
    size = _letters(tile)
    stamp(tile, text, size=size, middle=(0.5, 1 - 1.6 * size / len(tile)))


def remark(tile: np.ndarray, text: str) -> None:
    """Fade `tile` (height,width,3) uint8, in place, and write `text` across its middle."""
    grey = tile.mean(axis=2, keepdims=True)
    tile[...] = (_FADED * tile + (1 - _FADED) * (0.5 * grey + 110)).astype(np.uint8)
    stamp(tile, text, size=_letters(tile), middle=(0.5, 0.5))


def _letters(tile: np.ndarray) -> int:
    return int(np.clip(round(min(tile.shape[:2]) / 22), 11, 26))
