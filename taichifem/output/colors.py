"""Colours: the palette of bodies, the colour map of values, and the film that turns light into sRGB."""

from __future__ import annotations

import numpy as np

from taichifem.errors import InputError

PALETTE = (
    "#5b8fc9",  # blue
    "#e39a5c",  # apricot
    "#6fb58c",  # sage
    "#d0726f",  # rose
    "#9684c4",  # lavender
    "#dcbf62",  # straw
    "#5fb3bb",  # teal
    "#c08aa8",  # mauve
)
"""One colour per body, in order, then again from the start."""

COLLIDER = "#a9adb3"

CRACK = np.array([0.95, 0.93, 0.88], np.float32)
"""What the colour of a body goes towards on faces that fracture has opened."""

# The published anchors of viridis at nine equal steps.
VIRIDIS = (
    "#440154",
    "#472d7b",
    "#3b528b",
    "#2c728e",
    "#21908c",
    "#27ad81",
    "#5dc863",
    "#aadc32",
    "#fde725",
)


def parse_hex(text: str) -> np.ndarray:
    """sRGB colour (3,) float32 in [0, 1] of "#rrggbb". Raises InputError if it is not written like that."""
    digits = text[1:] if isinstance(text, str) and text.startswith("#") else ""
    try:
        if len(digits) != 6:
            raise ValueError
        return np.array([int(digits[k : k + 2], 16) for k in (0, 2, 4)], np.float32) / 255
    except ValueError:
        raise InputError(f'colour {text!r} is not a colour: write it as "#rrggbb"') from None


def body_colors(count: int, chosen: tuple[str, ...] = ()) -> np.ndarray:
    """sRGB colours (count,3) of the bodies: `chosen` first, the palette for the rest."""
    names = [chosen[k] if k < len(chosen) else PALETTE[k % len(PALETTE)] for k in range(count)]
    return np.array([parse_hex(name) for name in names], np.float32).reshape(count, 3)


_ANCHORS = np.array([parse_hex(c) for c in VIRIDIS])
_TABLE = np.stack(
    [np.interp(np.linspace(0, 1, 256), np.linspace(0, 1, len(_ANCHORS)), _ANCHORS[:, k]) for k in range(3)],
    axis=1,
).astype(np.float32)


def color_map(values: np.ndarray, low: float, high: float) -> np.ndarray:
    """sRGB colours (...,3) of `values` (...) between `low` and `high`; outside takes the end, NaN is grey."""
    values = np.asarray(values, dtype=np.float64)
    span = high - low if high > low else 1.0
    share = np.clip((values - low) / span, 0, 1)
    known = np.isfinite(share)
    index = np.where(known, np.rint(np.where(known, share, 0) * (len(_TABLE) - 1)), 0).astype(np.intp)
    return np.where(known[..., None], _TABLE[index], np.float32(0.5))


def to_linear(srgb: np.ndarray) -> np.ndarray:
    """Linear light (...) float32 of sRGB values (...) in [0, 1] (IEC 61966-2-1)."""
    srgb = np.asarray(srgb, np.float32)
    return np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4).astype(np.float32)


def to_srgb(linear: np.ndarray) -> np.ndarray:
    """sRGB values (...) float32 of linear light (...) in [0, 1]."""
    linear = np.clip(np.asarray(linear, np.float32), 0, 1)
    return np.where(linear <= 0.0031308, linear * 12.92, 1.055 * linear ** (1 / 2.4) - 0.055).astype(np.float32)


KNEE = 0.6
"""Light up to here is shown as it is; above, the film saturates: see `developed`."""

ENCODING_SIZE = 4096


def developed(light: np.ndarray) -> np.ndarray:
    """Linear display level (...) in [0, 1) of light (...): straight up to KNEE, then rolling off."""
    over = np.maximum(np.asarray(light, np.float32) - KNEE, 0)
    return np.minimum(light, KNEE) + over / (1 + over / (1 - KNEE))


def light_shown_as(srgb: np.ndarray) -> np.ndarray:
    """The light (...) that the film shows as sRGB value (...) below 1: the inverse of film and encoding."""
    level = to_linear(srgb)
    over = np.maximum(level - KNEE, 0)
    return np.minimum(level, KNEE) + over / (1 - over / (1 - KNEE))


def encoding_table() -> np.ndarray:
    """sRGB levels (ENCODING_SIZE,) float32 in [0, 255] over the square root of the linear level in [0, 1].

    It spares the pixel kernel its powers; the square root spends the entries where the eye sees steps.
    """
    return 255 * to_srgb(np.linspace(0, 1, ENCODING_SIZE) ** 2)
