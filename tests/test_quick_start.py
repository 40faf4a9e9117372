"""Taichi's front end with its slow parts replaced."""

import numpy as np
import pytest

from taichifem.runtime import start, ti


@ti.func
def _wrong(x):
    return x.no_such_thing


@ti.kernel
def _calls_wrong():
    for _ in range(3):
        _wrong(ti.Vector([1.0, 2.0]))


def test_what_is_wrong_in_a_kernel_is_still_told_with_its_place():
    start()
    with pytest.raises(Exception, match=r"(?s)test_quick_start.py.*no_such_thing"):
        _calls_wrong()


@ti.data_oriented
class _Numbers:
    def __init__(self):
        self.values = ti.field(ti.f64, 4)


@ti.kernel
def _set(numbers: ti.template(), place: ti.i32, value: ti.f64):
    numbers.values[place] = value


@ti.kernel
def _doubled(numbers: ti.template(), place: ti.i32) -> ti.f64:
    return 2 * numbers.values[place]


def test_kernels_launched_again_see_their_object_and_numbers():
    start()
    first, second = _Numbers(), _Numbers()
    for numbers, scale in ((first, 1.0), (second, 10.0)):
        for place in range(3):
            _set(numbers, np.int32(place), scale * place)
    _set(first, 3, value=7.0)
    _set(first, 0, 5)
    assert first.values.to_numpy().tolist() == [5, 1, 2, 7]
    assert second.values.to_numpy().tolist() == [0, 10, 20, 0]
    assert [_doubled(second, 1), _doubled(second, 2)] == [20, 40]
    with pytest.raises(TypeError):
        _set(first, 1.5, 2.0)
