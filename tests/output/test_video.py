"""Videos are decoded again: frame count, size, timing and colours are what was written."""

import resource
import subprocess
import sys
from fractions import Fraction
from pathlib import Path

import av
import numpy as np
import pytest
from PIL import Image

from taichifem.errors import InputError
from taichifem.output.video import open_video

ROOT = Path(__file__).parents[2]
WIDTH, HEIGHT = 96, 64


def picture(k: int, width: int = WIDTH, height: int = HEIGHT) -> np.ndarray:
    """A ramp with a red square that moves right with k."""
    image = np.empty((height, width, 3), np.uint8)
    image[...] = np.linspace(40, 200, width).astype(np.uint8)[None, :, None]
    left = 4 * k % (width - 16)
    image[16:32, left : left + 16] = (220, 30, 30)
    return image


def write(path, fps, count, width=WIDTH, height=HEIGHT):
    with open_video(path, fps, (width, height)) as video:
        for k in range(count):
            video.write(picture(k, width, height))
    return video


def decoded(path, *, cut_short: bool = False) -> list[np.ndarray]:
    """All pictures; of a file that was `cut_short`, those before the cut."""
    frames = []
    with av.open(str(path)) as file:
        coding = "ITU709" if path.suffix == ".mp4" else None
        try:
            for frame in file.decode(video=0):
                frames.append(frame.reformat(format="rgb24", src_colorspace=coding).to_ndarray())
        except av.InvalidDataError:
            assert cut_short
    return frames


def difference(a: np.ndarray, b: np.ndarray) -> float:
    return float(np.abs(a.astype(int) - b.astype(int)).mean())


@pytest.mark.parametrize(
    ("fps", "rate"), [(60, Fraction(60)), (24, Fraction(24)), (29.97, Fraction(2997, 100)), (0.5, Fraction(1, 2))]
)
def test_mp4(tmp_path, fps, rate):
    path = tmp_path / "made" / "v.mp4"
    write(path, fps, 20)
    frames = decoded(path)
    assert len(frames) == 20
    for k in (0, 7, 19):
        assert difference(frames[k], picture(k)) < 4 < difference(frames[k], picture(k + 3))
    with av.open(str(path)) as file:
        stream = file.streams.video[0]
        assert (stream.codec_context.name, stream.pix_fmt) == ("h264", "yuv420p")
        assert float(stream.average_rate) == pytest.approx(float(rate), rel=1e-3)
        assert float(stream.duration * stream.time_base) == pytest.approx(20 / fps, rel=1e-2)
        assert stream.frames == 20  # the index of an ordinary mp4: fragments have none


def test_mp4_of_odd_size_is_padded(tmp_path):
    write(tmp_path / "v.mp4", 30, 3, 97, 63)
    frames = decoded(tmp_path / "v.mp4")
    assert frames[0].shape == (64, 98, 3)
    assert difference(frames[1][:63, :97], picture(1, 97, 63)) < 4


def test_mp4_keeps_colours(tmp_path):
    colors = np.array([(255, 0, 0), (0, 255, 0), (0, 0, 255), (230, 120, 40), (255, 255, 255)], np.uint8)
    image = np.repeat(np.repeat(colors[None], 32, axis=1), 32, axis=0)
    with open_video(tmp_path / "v.mp4", 30, (160, 32)) as video:
        video.write(image)
    assert np.abs(decoded(tmp_path / "v.mp4")[0][16, 16::32].astype(int) - colors).max() <= 4
    with av.open(str(tmp_path / "v.mp4")) as file:
        frame = next(file.decode(video=0))
    assert frame.colorspace == 1 and frame.to_ndarray()[16, 16] == pytest.approx(63, abs=1)  # BT.709 red


@pytest.mark.parametrize(
    ("suffix", "fps", "count", "kept", "ms"),
    [("gif", 60, 12, 6, 33.3), ("gif", 24, 12, 12, 41.7), ("gif", 50, 6, 6, 20), ("webp", 60, 12, 12, 16.7)],
)
def test_animations(tmp_path, suffix, fps, count, kept, ms):
    path = tmp_path / f"v.{suffix}"
    write(path, fps, count)
    with Image.open(path) as image:
        assert (image.n_frames, image.size, image.info["loop"]) == (kept, (WIDTH, HEIGHT), 0)
        delays = []
        for k in range(image.n_frames):
            image.seek(k)
            image.load()
            delays.append(image.info["duration"])
            assert difference(np.asarray(image.convert("RGB")), picture(k * count // kept)) < 4
        assert np.mean(delays[:-1]) == pytest.approx(ms, rel=0.1)
        assert np.sum(delays) == pytest.approx(1000 * count / fps, rel=0.1)


@pytest.mark.parametrize("suffix", ["gif", "webp"])
def test_animations_of_odd_size(tmp_path, suffix):
    write(tmp_path / f"v.{suffix}", 30, 2, 97, 63)
    with Image.open(tmp_path / f"v.{suffix}") as image:
        assert (image.size, image.n_frames) == ((97, 63), 2)


@pytest.mark.parametrize(
    ("name", "names"),
    [
        ("v.png", "v_0000.png v_0001.png"),
        ("a_%02d.png", "a_00.png a_01.png"),
        ("d/", "d/frame_0000.png d/frame_0001.png"),
    ],
)
def test_png_sequence(tmp_path, name, names):
    video = write(f"{tmp_path}/{name}", 30, 2)
    assert sorted(p.relative_to(tmp_path).as_posix() for p in tmp_path.rglob("*.png")) == names.split()
    with Image.open(tmp_path / names.split()[1]) as image:
        assert np.array_equal(np.asarray(image), picture(1))
    assert video.frames == 2


def test_an_existing_folder_takes_a_png_sequence(tmp_path):
    write(tmp_path, 30, 1)
    assert (tmp_path / "frame_0000.png").exists()


@pytest.mark.parametrize(
    ("name", "fps", "size", "said"),
    [
        ("v.avi", 30, (64, 64), "no video format ends in '.avi': choose one of .mp4"),
        ("v", 30, (64, 64), "no video format ends in ''"),
        ("v.mp4", 0, (64, 64), "fps is 0"),
        ("v.mp4", float("nan"), (64, 64), "fps is nan"),
        ("v.mp4", 30, (0, 64), "width must be"),
        ("a%s_%d.png", 30, (64, 64), "one number"),
        ("a%%.png", 30, (64, 64), "one number"),
        ("file/v.mp4", 30, (64, 64), "cannot be written"),
        ("v.mp4", 1e30, (64, 64), "fps is 1e+30"),
        ("v.gif", 1e-9, (64, 64), "fps is 1e-09"),
    ],
)
def test_refusals_are_one_line(tmp_path, name, fps, size, said):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError) as caught, open_video(tmp_path / name, fps, size) as video:
        video.write(np.zeros((size[1], size[0], 3), np.uint8))
    assert said in str(caught.value) and len(str(caught.value).splitlines()) == 1


def test_a_picture_of_another_size_is_refused_and_the_rest_stays(tmp_path):
    with open_video(tmp_path / "v.mp4", 30, (WIDTH, HEIGHT)) as video:
        video.write(picture(0))
        with pytest.raises(InputError, match=r"\(32, 32, 3\) uint8: give \(64, 96, 3\)"):
            video.write(np.zeros((32, 32, 3), np.uint8))
        with pytest.raises(InputError, match="float"):
            video.write(picture(0) / 255)
        video.write(picture(1))
    assert len(decoded(tmp_path / "v.mp4")) == 2


@pytest.mark.parametrize("suffix", ["mp4", "gif", "webp", "png"])
def test_closing_at_once_and_twice(tmp_path, suffix):
    video = open_video(tmp_path / f"v.{suffix}", 30, (64, 64))
    video.close()
    video.close()


KILLED = """
import os, signal, sys
import numpy as np
from taichifem.output.video import open_video
blocks = np.random.default_rng(0).integers(0, 255, (4, 6, 3), np.uint8).repeat(16, 0).repeat(16, 1)
video = open_video(sys.argv[1], 60, (96, 64))
for k in range(120):
    video.write(np.roll(blocks, k, axis=1))
os.kill(os.getpid(), signal.SIGKILL)
"""


@pytest.mark.parametrize(("suffix", "least"), [("mp4", 90), ("gif", 55)])
def test_a_killed_process_leaves_a_video(tmp_path, suffix, least):
    path = tmp_path / f"v.{suffix}"
    ended = subprocess.run([sys.executable, "-c", KILLED, str(path)], cwd=ROOT, env={"PYTHONPATH": str(ROOT)})
    assert ended.returncode == -9
    frames = decoded(path, cut_short=True)
    assert least <= len(frames) <= 120
    blocks = np.random.default_rng(0).integers(0, 255, (4, 6, 3), np.uint8).repeat(16, 0).repeat(16, 1)
    step = 2 if suffix == "gif" else 1
    assert difference(frames[50], np.roll(blocks, 50 * step, axis=1)) < 12 < difference(frames[50], blocks)


FULL = """
import sys, resource
import numpy as np
from taichifem.errors import InputError
from taichifem.output.video import open_video
resource.setrlimit(resource.RLIMIT_FSIZE, (200_000, 200_000))
rng = np.random.default_rng(0)
video = open_video(sys.argv[1], 60, (96, 64))
try:
    for k in range(400):
        video.write(rng.integers(0, 255, (64, 96, 3), np.uint8))
    video.close()
except InputError as error:
    print(error)
try:
    video.close()
except InputError as error:
    pass
"""


@pytest.mark.skipif(not hasattr(resource, "RLIMIT_FSIZE"), reason="needs a limit on the size of files")
def test_a_full_disk_is_one_line_and_the_video_stays(tmp_path):
    path = tmp_path / "v.mp4"
    command = [sys.executable, "-c", FULL, str(path)]
    ended = subprocess.run(command, cwd=ROOT, env={"PYTHONPATH": str(ROOT)}, capture_output=True, text=True)
    assert ended.returncode == 0 and ended.stderr == ""
    assert "cannot be written: File too large" in ended.stdout and len(ended.stdout.splitlines()) == 1
    assert len(decoded(path, cut_short=True)) > 10
