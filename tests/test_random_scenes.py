"""A few of the random scenes; `python tests/random_scenes.py` runs a hundred."""

import pytest
import random_scenes


@pytest.mark.parametrize("seed", range(6))
def test_random_scene(seed):
    random_scenes.run(seed)
