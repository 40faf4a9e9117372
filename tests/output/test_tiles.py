"""Tiles: where they lie, and what is written on them."""

import numpy as np
import pytest

from taichifem.errors import InputError
from taichifem.output.overlay import stamp
from taichifem.output.tiles import Grid, label, remark


@pytest.mark.parametrize(
    ("count", "landscape", "portrait"),
    [
        (1, (1, 1), (1, 1)),
        (2, (2, 1), (1, 2)),
        (3, (3, 1), (1, 3)),
        (4, (2, 2), (2, 2)),
        (5, (3, 2), (2, 3)),
        (6, (3, 2), (2, 3)),
        (7, (4, 2), (2, 4)),
        (8, (4, 2), (2, 4)),
        (9, (3, 3), (3, 3)),
    ],
)
def test_the_grid_suits_the_picture(count, landscape, portrait):
    for size, expected in (((1280, 720), landscape), ((720, 1280), portrait)):
        grid = Grid.of(count, size)
        assert (grid.columns, grid.rows) == expected
        assert grid.columns * grid.rows >= count


@pytest.mark.parametrize(("count", "size"), [(2, (160, 90)), (3, (161, 91)), (7, (641, 481)), (9, (1279, 719))])
def test_tiles_are_equal_apart_and_reach_the_border(count, size):
    grid = Grid.of(count, size)
    owner = np.zeros((size[1], size[0], 3), np.uint8)
    for number in range(grid.columns * grid.rows):
        tile = grid.part(owner, number)
        assert tile.shape == (grid.tile[1], grid.tile[0], 3)
        assert not tile.any(), "tiles do not overlap"
        tile[...] = number + 1
    assert owner[0, 0, 0] == 1 and owner[-1, -1, 0] == grid.columns * grid.rows
    divided = (owner[..., 0] == 0).mean()
    assert 0 < divided < 0.06
    blank = grid.blank()
    assert len(np.unique(blank[owner == 0].reshape(-1, 3), axis=0)) == 1, "dividers have one colour"
    assert not np.array_equal(blank[owner == 0][:3], blank[owner == 1][:3])


def test_a_picture_too_small_for_its_tiles_is_refused():
    with pytest.raises(InputError, match="40x40 is too small for 9 tiles: give at least 51x51"):
        Grid.of(9, (40, 40))
    assert min(Grid.of(9, (51, 51)).tile) >= 16


def test_a_label_stands_at_the_foot():
    tile, other = np.full((2, 90, 160, 3), 120, np.uint8)
    label(tile, "model = stvk")
    label(other, "model = linear")
    rows, columns = np.nonzero((tile != 120).any(axis=2))
    assert rows.min() > 50 and columns.mean() == pytest.approx(79.5, abs=2)
    assert tile.min() < 80 < 180 < tile.max(), "dark letters on light ground"
    assert not np.array_equal(tile, other)


def test_a_remark_fades_the_tile():
    tile = np.zeros((120, 200, 3), np.uint8)
    tile[..., 0] = 250
    remark(tile, "diverged at t = 0.35 s")
    corner = tile[0, 0].astype(int)
    assert corner[0] - corner[1] < 150 and corner[1] > 40
    assert (tile[60] != tile[0]).any() and (tile[30] == tile[0]).all()


def test_a_long_line_takes_smaller_letters_and_is_cut_at_last():
    wide, narrow = np.zeros((60, 400, 3), np.uint8), np.zeros((60, 200, 3), np.uint8)
    for picture in (wide, narrow):
        stamp(picture, "body.ball.material.youngs = 1e5", size=18, middle=(0.5, 0.5))
    heights = [int((picture != 0).any(axis=(1, 2)).sum()) for picture in (wide, narrow)]
    assert heights[1] < heights[0]
    assert not narrow[:, 0].any() and not narrow[:, -1].any(), "the whole line is there"
    stamp(np.zeros((20, 20, 3), np.uint8), "much longer than that", size=18, middle=(0.5, 1.0))
