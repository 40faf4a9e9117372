"""Pictures into a video, each written as it comes: what was written stays, whatever happens later."""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager
from fractions import Fraction
from pathlib import Path
from typing import ClassVar

import av
import numpy as np
from PIL import Image

from taichifem.description import check
from taichifem.errors import InputError
from taichifem.files import replacing

GIF_TICK = Fraction(1, 100)  # GIF counts time in 1/100 s ...
GIF_FPS = 50  # ... and viewers slow down delays below two of them

BT709 = 1  # the colours of high definition, and how luma is limited to 16..235, as H.264 numbers them
LIMITED_RANGE = 1


class VideoWriter:
    """Takes pictures of one size, one after another. A context manager: leaving the block closes it.

    path: what is written.  size: (width, height) of the pictures.  frames: how many were written.
    """

    def __init__(self, path: Path, size: tuple[int, int]) -> None:
        self.path, self.size, self.frames = path, size, 0
        self._open = True

    def write(self, image: np.ndarray) -> None:
        """Append a picture (height, width, 3) uint8, sRGB.

        Raises:
            InputError: the picture has another size or type, or it cannot be written (a full disk).
        """
        width, height = self.size
        if image.shape != (height, width, 3) or image.dtype != np.uint8:
            wanted = f"({height}, {width}, 3) uint8"
            raise InputError(f"{self.path}: a picture is {image.shape} {image.dtype}: give {wanted}")
        with self._refusals():
            self._put(np.ascontiguousarray(image))
        self.frames += 1

    def close(self) -> None:
        """Finish the file. Closing again does nothing."""
        if self._open:
            self._open = False
            with self._refusals():
                self._end()

    def __enter__(self) -> VideoWriter:
        return self

    def __exit__(self, *_: object) -> None:
        self.close()

    def _put(self, image: np.ndarray) -> None:
        raise NotImplementedError

    def _end(self) -> None:
        """Nothing to finish, unless a format says otherwise."""

    @contextmanager
    def _refusals(self) -> Iterator[None]:
        try:
            yield
        except (OSError, av.FFmpegError) as error:
            reason = error.strerror or type(error).__name__
            raise InputError(
                f"{self.path}: cannot be written: {reason} (after {self.frames} frames, which stay)"
            ) from None


def open_video(path: str | os.PathLike, fps: float, size: tuple[int, int]) -> VideoWriter:
    """A writer for `path`; its ending says the format. Missing folders are made.

    Args:
        path: `.mp4` (H.264; a side of odd length is padded by a pixel), `.gif` (at most 50 frames a second: of
            more, every second or third is kept), `.webp`, or numbered `.png` files: `name.png` makes
            name_0000.png and so on, `name_%05d.png` says how, a folder (ending in "/") takes frame_0000.png.
        fps: pictures a second, 0.01 to a million.
        size: (width, height) of the pictures [pixels].

    Raises:
        InputError: unknown ending, wrong fps or size, a place that cannot be written.
    """
    place = Path(path)
    rate = Fraction(check.number("fps", fps, at_least=0.01, below=1e6)).limit_denominator(1001)
    size = (check.whole("width", size[0]), check.whole("height", size[1]))
    if place.is_dir() or str(path).endswith(("/", os.sep)):
        return _PngWriter(place / "frame_%04d.png", size)
    writer = _WRITERS.get(place.suffix.lower())
    if writer is None:
        endings = ", ".join(_WRITERS)
        raise InputError(f"{path}: no video format ends in {place.suffix!r}: choose one of {endings}")
    return writer(place, size) if writer is _PngWriter else writer(place, size, rate)


class _PngWriter(VideoWriter):
    """Numbered PNG files; `path` is the pattern of their names."""

    def __init__(self, path: Path, size: tuple[int, int]) -> None:
        if "%" not in path.name:
            path = path.with_name(f"{path.stem}_%04d{path.suffix}")
        try:
            numbered = path.name % 0 != path.name % 1
        except (TypeError, ValueError):
            numbered = False
        if not numbered:
            raise InputError(f"{path}: the pattern must hold one number: write it like frame_%04d.png")
        super().__init__(path, size)

    def _put(self, image: np.ndarray) -> None:
        with replacing(self.path.with_name(self.path.name % self.frames)) as part:
            Image.fromarray(image).save(part, format="png", compress_level=1)


class _CodecWriter(VideoWriter):
    """A video file through FFmpeg's libraries (PyAV). Subclasses say which container and codec."""

    container: str
    codec: str
    pixels: str
    container_options: ClassVar[dict[str, str]] = {}
    codec_options: ClassVar[dict[str, str]] = {}

    def __init__(self, path: Path, size: tuple[int, int], rate: Fraction) -> None:
        super().__init__(path, size)
        self.rate = rate
        with self._refusals():
            path.parent.mkdir(parents=True, exist_ok=True)
            path.open("wb").close()  # a place that cannot be written is told now, not at the first frame
            options = {"flush_packets": "1", **self.container_options}
            self._file = av.open(str(path), "w", format=self.container, options=options)
        self._stream = self._file.add_stream(self.codec, rate=rate, options=self.codec_options)
        self._stream.width, self._stream.height = self._coded_size()
        self._stream.pix_fmt = self.pixels
        self._start()

    def _coded_size(self) -> tuple[int, int]:
        return self.size

    def _start(self) -> None:
        """Set what only this format has."""

    def _frame(self, image: np.ndarray) -> av.VideoFrame | None:
        return av.VideoFrame.from_ndarray(image, format="rgb24")

    def _put(self, image: np.ndarray) -> None:
        frame = self._frame(image)
        if frame is not None:
            self._file.mux(self._stream.encode(frame))

    def _end(self) -> None:
        try:
            if self.frames:
                self._file.mux(self._stream.encode(None))
        finally:
            self._file.close()


class _Mp4Writer(_CodecWriter):
    """H.264. The file grows in fragments of 15 frames that play on their own, so a killed program leaves a
    video; closing turns it into an ordinary file that every player seeks in."""

    container, codec, pixels = "mp4", "libx264", "yuv420p"
    container_options: ClassVar = {"movflags": "+hybrid_fragmented+frag_keyframe"}
    codec_options: ClassVar = {"crf": "20", "preset": "veryfast", "g": "15"}

    def _coded_size(self) -> tuple[int, int]:
        width, height = self.size
        return width + width % 2, height + height % 2  # two by two pixels share a colour

    def _start(self) -> None:
        coding = self._stream.codec_context  # said in the file, or players guess by the size and shift colours
        coding.colorspace = coding.color_primaries = coding.color_trc = BT709
        coding.color_range = LIMITED_RANGE

    def _frame(self, image: np.ndarray) -> av.VideoFrame:
        width, height = self.size
        if width % 2 or height % 2:
            image = np.pad(image, ((0, height % 2), (0, width % 2), (0, 0)), mode="edge")
        return super()._frame(image).reformat(format=self.pixels, dst_colorspace="ITU709")


class _WebpWriter(_CodecWriter):
    container, codec, pixels = "webp", "libwebp_anim", "yuv420p"
    container_options: ClassVar = {"loop": "0"}
    codec_options: ClassVar = {"quality": "85", "compression_level": "2"}


class _GifWriter(_CodecWriter):
    """Each picture with its own palette of 256 colours."""

    container, codec, pixels = "gif", "gif", "pal8"
    container_options: ClassVar = {"loop": "0"}

    def _start(self) -> None:
        self._stream.codec_context.time_base = GIF_TICK
        self._every = max(1, math.ceil(self.rate / GIF_FPS))

    def _frame(self, image: np.ndarray) -> av.VideoFrame | None:
        if self.frames % self._every:
            return None
        reduced = Image.fromarray(image).quantize(256, method=Image.Quantize.FASTOCTREE, dither=Image.Dither.NONE)
        colors = np.array(reduced.getpalette("RGB"), np.uint8).reshape(-1, 3)
        palette = np.zeros((256, 4), np.uint8)  # alpha, red, green, blue
        palette[:, 0] = 255
        palette[: len(colors), 1:] = colors
        frame = av.VideoFrame.from_ndarray((np.asarray(reduced), palette), format="pal8")
        frame.pts, frame.time_base = round(self.frames / self.rate / GIF_TICK), GIF_TICK
        return frame


_WRITERS = {".mp4": _Mp4Writer, ".gif": _GifWriter, ".webp": _WebpWriter, ".png": _PngWriter}
