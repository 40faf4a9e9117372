"""Which points of a modal body may touch: none that does is missed, and few others are looked at."""

from types import SimpleNamespace

import numpy as np

from taichifem.reduced.modal_skin import ClusteredSkin
from taichifem.reduced.vectors import cross, skew


def test_no_point_below_a_plane_is_missed():
    rng = np.random.default_rng(3)
    places = rng.uniform(-1, 1, size=(5000, 3))
    x, y, z = places.T
    waves = [np.stack([np.sin(k * x), np.cos(k * y), np.sin(k * z + k)], axis=1) for k in (1, 2, 3)]
    skin = ClusteredSkin(places, np.stack(waves, axis=2), np.float64)
    for height in (-4.0, -0.9, -0.3):
        frame = SimpleNamespace(rotation=np.linalg.qr(rng.normal(size=(3, 3)))[0], origin=rng.normal(size=3) * 0.1)
        now, then = (SimpleNamespace(frame=frame, q=0.05 * rng.normal(size=3)) for _ in range(2))

        def below(before, after, radius, height=height):
            return np.minimum(before[:, 2], after[:, 2]) - radius < height

        near = skin.near(now, then, below)
        inside = np.flatnonzero(np.minimum(skin.all.at(now)[:, 2], skin.all.at(then)[:, 2]) < height)
        assert np.isin(inside, near).all()
        assert len(near) < len(inside) + 2500
    assert height == -0.3 and len(inside) > 100


def test_parts_levers_and_velocities_agree_with_differences():
    """How points move with the modes is the slope of where they are; their velocity that with the rates."""
    rng = np.random.default_rng(4)
    skin = ClusteredSkin(rng.normal(size=(200, 3)), rng.normal(size=(200, 3, 5)), np.float64).all
    still = SimpleNamespace(
        rotation=np.linalg.qr(rng.normal(size=(3, 3)))[0],
        origin=rng.normal(size=3),
        levers=lambda points: np.zeros((len(points), 3, 0)),
        velocity_at=np.zeros_like,
    )
    q, v = rng.normal(size=(2, 5))
    which = np.array([7, 3, 150])
    part, state = skin.part(which), SimpleNamespace(frame=still, q=q, v=v)
    np.testing.assert_allclose(part.at(state), skin.at(state)[which], rtol=1e-12)
    moved = part.at(SimpleNamespace(frame=still, q=q + v)) - part.at(state)
    np.testing.assert_allclose(part.levers(state) @ v, moved, rtol=1e-9, atol=1e-12)
    np.testing.assert_allclose(part.velocities(state), moved, rtol=1e-9, atol=1e-12)


def test_cross_products():
    a, b = np.random.default_rng(5).normal(size=(2, 10, 3))
    np.testing.assert_allclose(cross(a, b), np.cross(a, b), rtol=1e-12, atol=1e-14)
    np.testing.assert_allclose(b @ skew(a[0]).T, np.cross(a[0], b), rtol=1e-12, atol=1e-14)
