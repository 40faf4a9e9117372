"""What is written over a picture: lines of text and a colour bar. Pillow draws, sprites are kept."""

from __future__ import annotations

import functools

import numpy as np
from PIL import Image, ImageDraw, ImageFont

from taichifem.output.colors import color_map
from taichifem.output.frame import Frame

_INK = (38, 44, 54)
_PAPER = (255, 255, 255)
_PAPER_OPACITY = 150
_SMALLEST, _LEGIBLE = 9, 11  # letters [pixels]: where there is no room for more, and where there is

_PREFIXES = ((1e9, "G"), (1e6, "M"), (1e3, "k"), (1.0, ""), (1e-3, "m"), (1e-6, "u"), (1e-9, "n"))


def engineering(value: float, unit: str) -> tuple[float, str]:
    """(factor, unit with prefix) in which numbers of about `value` read well: 12500 Pa -> (1e3, "kPa")."""
    if not unit:
        return 1.0, ""
    if unit == "m" and 1e-3 <= abs(value) < 1:
        return (1e-2, "cm") if abs(value) >= 1e-2 else (1e-3, "mm")
    for factor, prefix in _PREFIXES:
        if abs(value) >= factor * 0.9995:
            # A prefix on "m/s" reads as if it were on the metre alone, which is the same thing.
            return factor, prefix + unit
    return 1.0, unit


def nice_ticks(low: float, high: float, count: int = 5) -> np.ndarray:
    """About `count` round numbers (steps of 1, 2, 2.5 or 5 times a power of ten) from low to high."""
    span = high - low
    if not span > 0 or not np.isfinite(span):
        return np.array([low])
    rough = span / count
    power = 10.0 ** np.floor(np.log10(rough))
    step = next(s * power for s in (1, 2, 2.5, 5, 10) if s * power >= rough * 0.999)
    first = np.ceil(low / step - 1e-6) * step
    ticks = first + step * np.arange(int((high - first) / step + 1e-6) + 1)
    return np.where(np.abs(ticks) < 1e-9 * span, 0.0, ticks)


@functools.cache
def _font(size: int) -> ImageFont.FreeTypeFont:
    return ImageFont.load_default(size=size)


@functools.lru_cache(maxsize=256)
def _line(text: str, size: int) -> Image.Image:
    """A line of text as an opacity mask; all lines of one size are equally high."""
    font = _font(size)
    up, down = font.getmetrics()
    mask = Image.new("L", (int(font.getlength(text)) + 2, up + down))
    ImageDraw.Draw(mask).text((0, 0), text, fill=255, font=font)
    return mask


def _panel(width: int, height: int) -> Image.Image:
    panel = Image.new("RGBA", (width, height), (*_PAPER, 0))
    ImageDraw.Draw(panel).rounded_rectangle(
        (0, 0, width - 1, height - 1), radius=max(4, height // 16), fill=(*_PAPER, _PAPER_OPACITY)
    )
    return panel


def _write(sprite: Image.Image, x: int, y: int, text: str, size: int, opacity: float = 1.0) -> None:
    mask = _line(text, size)
    if opacity < 1:
        mask = mask.point([int(k * opacity) for k in range(256)])
    ink = Image.new("RGBA", mask.size, (*_INK, 0))
    ink.putalpha(mask)
    sprite.alpha_composite(ink, (x, y))


@functools.lru_cache(maxsize=32)
def _text_panel(lines: tuple[str, ...], size: int) -> np.ndarray:
    pad, pitch = int(0.7 * size), int(1.35 * size)
    widest = max(_line(line, size).width for line in lines)
    sprite = _panel(widest + 2 * pad, len(lines) * pitch + 2 * pad - (pitch - size))
    for k, line in enumerate(lines):
        _write(sprite, pad, pad + k * pitch - size // 8, line, size, 1.0 if k == 0 else 0.8)
    return np.asarray(sprite, np.uint8)


@functools.lru_cache(maxsize=8)
def _bar_panel(low: float, high: float, label: str, unit: str, length: int, size: int) -> np.ndarray:
    factor, unit = engineering(max(abs(low), abs(high)), unit)
    ticks = nice_ticks(low / factor, high / factor)
    digits = 0 if len(ticks) < 2 else max(0, int(np.ceil(-np.log10(ticks[1] - ticks[0]) - 1e-6)))
    if len(ticks) > 1 and round((ticks[1] - ticks[0]) * 10**digits, 6) % 1:
        digits += 1
    names = [f"{tick:.{digits}f}" for tick in ticks]
    title = f"{label} [{unit}]" if unit else label

    pad, bar = int(0.7 * size), int(1.1 * size)
    head = int(1.9 * size) if title else size // 2
    widest = max([bar + size + max(_line(n, size).width for n in names), _line(title, size).width])
    sprite = _panel(widest + 2 * pad, length + head + pad + size)
    _write(sprite, pad, pad - size // 8, title, size)
    top = pad + head
    column = color_map(np.linspace(high, low, length), low, high)
    strip = np.repeat((255 * column).astype(np.uint8)[:, None, :], bar, axis=1)
    sprite.paste(Image.fromarray(strip), (pad, top))
    draw = ImageDraw.Draw(sprite)
    for tick, name in zip(ticks, names, strict=True):
        y = top + round((high - tick * factor) / (high - low) * (length - 1))
        draw.line((pad + bar, y, pad + bar + size // 3, y), fill=(*_INK, 255))
        _write(sprite, pad + bar + int(0.6 * size), y - int(0.62 * size), name, size, 0.85)
    return np.asarray(sprite, np.uint8)


def _blend(picture: np.ndarray, sprite: np.ndarray, x: int, y: int) -> None:
    """Lay `sprite` (h,w,4) over `picture` (H,W,3) at column x, row y; what hangs over is cut."""
    height, width = picture.shape[:2]
    sprite = sprite[: max(0, height - y), : max(0, width - x)]
    part = picture[y : y + sprite.shape[0], x : x + sprite.shape[1]]
    opacity = sprite[..., 3:].astype(np.uint16)
    mixed = sprite[..., :3] * opacity + part * (255 - opacity) + 127
    part[:] = (mixed // 255).astype(np.uint8)


def stamp(picture: np.ndarray, text: str, *, size: int, middle: tuple[float, float]) -> None:
    """Write a line of text into `picture` (height,width,3) uint8, in place.

    size: of the letters [pixels]; smaller ones are taken where the line is wider than the picture.
    middle: of the line, as parts of the picture's width and height, 0 to 1; the line stays inside.
    """
    height, width = picture.shape[:2]
    while size > _SMALLEST and _text_panel((text,), size).shape[1] > width:
        size -= 1
    sprite = _text_panel((text,), size)
    x, y = (
        round(min(max(0, part * room - side / 2), max(0, room - side)))
        for part, room, side in zip(middle, (width, height), sprite.shape[1::-1], strict=True)
    )
    _blend(picture, sprite, x, y)


def annotate(picture: np.ndarray, frame: Frame) -> np.ndarray:
    """Write the frame's text and colour bar into `picture` (height,width,3) uint8, in place."""
    height, width = picture.shape[:2]
    size = int(np.clip(round(min(height, 0.75 * width) / 42), _LEGIBLE, 40))
    margin = size
    if frame.hud:
        _blend(picture, _text_panel(tuple(frame.hud), size), margin, margin)
    if frame.values is not None and frame.bar:
        low, high = (float(f"{v:.4g}") for v in frame.value_range)
        if low < high:
            sprite = _bar_panel(low, high, frame.value_label, frame.value_unit, int(0.42 * height), size)
            x, y = width - sprite.shape[1] - margin, (height - sprite.shape[0]) // 2
            _blend(picture, sprite, max(0, x), max(0, y))
    return picture
