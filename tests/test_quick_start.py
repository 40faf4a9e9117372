"""Taichi's front end with its slow parts replaced."""

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
