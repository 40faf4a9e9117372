"""`Simulation.show`: what a notebook gets."""

import base64
import io

import numpy as np
import pytest
from PIL import Image

import taichifem as tf


def test_a_picture_and_an_animation_for_a_notebook(block):
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=block)], fps=30))
    shown = simulation.show(size=(160, 90))
    picture = np.asarray(Image.open(io.BytesIO(shown.data)).convert("RGB")).astype(int)
    assert shown.kind == "png" and picture.shape == (90, 160, 3)
    assert (np.ptp(picture, axis=2) > 30).mean() > 0.01, "no coloured body is seen"
    assert simulation.frame == 0
    moving = simulation.show(seconds=0.2, size=(160, 90))
    assert simulation.frame == 6
    html = moving._repr_mimebundle_()["text/html"]
    data = base64.b64decode(html.partition("base64,")[2].partition('"')[0])
    film = Image.open(io.BytesIO(data))
    assert (film.format, film.n_frames, film.size) == ("WEBP", 7, (160, 90))
    with pytest.raises(tf.InputError, match="seconds is -1"):
        simulation.show(seconds=-1)
