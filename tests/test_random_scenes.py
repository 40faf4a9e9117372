"""A few of the random scenes; the scripts `random_scenes.py`, `violent_scenes.py` and `breaking_scenes.py` run more."""

import breaking_scenes
import pytest
import random_scenes
import violent_scenes


@pytest.mark.parametrize("seed", range(6))
def test_random_scene(seed):
    random_scenes.run(seed)


@pytest.mark.parametrize("seed", [9, 21, *(pytest.param(seed, marks=pytest.mark.slow) for seed in range(10, 20))])
def test_violent_scene_with_plasticity(seed):
    violent_scenes.run(seed)


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(4))
def test_breaking_scene(seed):
    breaking_scenes.run(seed)
