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
    assert [_doubled(second, place) for place in (1, 2, 1, 2)] == [20, 40, 20, 40]
    with pytest.raises(TypeError):
        _set(first, 1.5, 2.0)


@ti.kernel
def _added(numbers: ti.template(), times: ti.template(), array: ti.types.ndarray(), offset: ti.i32) -> ti.f64:
    total = ti.cast(offset, ti.f64)
    for k in range(array.shape[0]):
        total += ti.cast(times * array[k], ti.f64)
        array[k] = array[k] + 1
    numbers.values[0] = total
    return total


def test_kernels_launched_again_see_their_arrays_and_constants():
    start()
    numbers = _Numbers()
    for _ in range(3):
        for kind in (np.float32, np.float64, np.int32):
            array = np.array([1, 2, 3], dtype=kind)
            assert _added(numbers, 2, array, 1) == 13 and array.tolist() == [2, 3, 4]
            assert _added(numbers, 3, array[:2], 0) == 15 and array.tolist() == [3, 4, 4]
            assert numbers.values[0] == 15
            # Not in one piece: Taichi copies it, or says that it cannot.
            with pytest.raises(ValueError, match="contiguous"):
                _added(numbers, 3, array[::2], 0)
    with pytest.raises(Exception, match="Invalid type"):
        _added(numbers, 3, [1.0, 2.0], 0)


def test_an_object_in_the_place_of_one_that_ended_is_another():
    start()
    for value in range(20):
        numbers = _Numbers()
        for place in range(3):  # launched at once from the third time on
            _set(numbers, place, value)
        assert numbers.values.to_numpy().tolist() == [value, value, value, 0]
        del numbers
