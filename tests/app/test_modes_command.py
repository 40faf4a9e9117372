"""`taichifem modes`: frequencies in a table and a file, pictures and videos that loop."""

import json

import av
import numpy as np
from calling import assert_refused, call
from PIL import Image

SCENE = """
[[body]]
name = "bar"
mesh = { shape = "bar", size = [1.0, 0.2, 0.2], cells = [5, 1, 1] }
material = { model = "modal", youngs = 1e6, stiffness_damping = 0.001 }

[[body.pin]]
box = { lower = [-1, -1, -1], upper = [1e-6, 1, 1] }
"""


def test_tables_pictures_and_videos(tmp_path):
    scene = tmp_path / "bar.toml"
    scene.write_text(SCENE)
    result = call(
        "modes", scene, "--modes", "2", "-o", tmp_path / "out", "--size", "160x120", "--json", tmp_path / "m.json"
    )
    assert result.exit_code == 0, result.output
    rows = json.loads((tmp_path / "m.json").read_text())["rows"]
    assert [row["mode"] for row in rows] == [1, 2]
    assert f"{rows[0]['hertz']:.6g}" in result.output
    picture = np.asarray(Image.open(tmp_path / "out" / "bar-01.png"))
    assert picture.shape == (120, 160, 3) and picture.std() > 10
    with av.open(str(tmp_path / "out" / "bar-02.mp4")) as video:
        frames = [frame.to_ndarray(format="rgb24").astype(float) for frame in video.decode(video=0)]
    assert len(frames) == 90
    assert np.abs(frames[0] - frames[45]).mean() < 2, "it loops"
    assert np.abs(frames[0] - frames[11]).mean() > 1, "and moves"


def test_refusals(tmp_path):
    scene = tmp_path / "bar.toml"
    scene.write_text(SCENE)
    assert_refused(call("modes", scene, "--modes", "1000"), "degrees of freedom")
