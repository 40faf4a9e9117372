"""The public face of a simulation: arrays, checkpoints, precision, refusals."""

import numpy as np
import pytest

import taichifem as tf
from taichifem import InputError


def dropped(block, **options) -> tf.Simulation:
    pin = tf.Pin(region=tf.NearestRegion(point=(0, 0, 0.3)), until=0.25)
    body = tf.Body(mesh=block, material=tf.Material(youngs=1e5), position=(0, 0, 0.05), pins=[pin])
    ball = tf.SphereCollider(
        center=(0.3, 0.15, -0.15),
        radius=0.2,
        motion=tf.Motion(times=(0, 1), translation=((0, 0, 0), (0, 0, 0.2))),
    )
    return tf.Simulation(tf.Scene(bodies=[body], colliders=[tf.PlaneCollider(), ball]), **options)


def test_example_of_the_readme():
    bar = tf.TetMesh.bar(size=(1.0, 0.25, 0.25), cells=(8, 2, 2))
    rubber = tf.Material(model="corotational", youngs=1e6, poisson=0.4, density=1000.0)
    held = tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))
    scene = tf.Scene(bodies=[tf.Body(mesh=bar, material=rubber, pins=[held])], gravity=(0.0, 0.0, -9.81), fps=60)
    simulation = tf.Simulation(scene, precision="f32")
    simulation.advance(seconds=0.5)
    assert simulation.time == pytest.approx(0.5)
    assert simulation.frame == 30
    assert -0.3 < simulation.positions[:, 2].min() < -0.01
    assert "CG iterations" in str(simulation.stats)
    assert simulation.positions.dtype == np.float64


def test_masses_sum_to_density_times_volume(block):
    simulation = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=block, material=tf.Material(density=700))]))
    assert simulation.masses.sum() == pytest.approx(700 * 0.6 * 0.3 * 0.3, rel=1e-6)


@pytest.mark.parametrize("precision", ["f32", "f64"])
def test_resumed_run_equals_the_uninterrupted_one(block, tmp_path, precision):
    """Bit for bit, with contact, friction, a moving collider and a pin that lets go in the middle."""
    through = dropped(block, precision=precision)
    through.advance(seconds=0.2)
    through.save(tmp_path / "state.npz")
    through.advance(seconds=0.6)
    again = dropped(block, precision=precision)
    again.load(tmp_path / "state.npz")
    assert again.time == pytest.approx(0.2)
    again.advance(seconds=0.6)
    np.testing.assert_array_equal(again.positions, through.positions)
    np.testing.assert_array_equal(again.velocities, through.velocities)


@pytest.mark.parametrize("integrator", ["backward-euler-newton", "bdf2", "newmark", "symplectic-euler", "quasi-static"])
def test_resumed_run_equals_the_uninterrupted_one_for_every_integrator(tmp_path, integrator):
    """Bit for bit; explicit steps, which stiffen with the body here, in the middle of a frame."""
    mesh = tf.TriMesh.rectangle(size=(0.6, 0.3), cells=(6, 3))
    force = tf.Traction(region=tf.BoxRegion(lower=(0.59, -1, -1), upper=(1, 1, 1)), traction=(5e3, 0, 0), ramp=0.2)
    pins = [tf.BoxRegion(lower=(-1, -1, -1), upper=(1e-6, 1, 1))]
    material = tf.Material(model="stvk", youngs=3e4, poisson=0.3, stiffness_damping=1e-3)
    body = tf.Body(mesh=mesh, material=material, pins=pins, tractions=[force])
    explicit = integrator == "symplectic-euler"

    def run():
        return tf.Simulation(tf.Scene(bodies=[body], integrator=integrator, fps=10 if explicit else 60))

    through = run()
    substeps = {through.substeps}
    for _ in range(7):
        through.step()
    through.save(tmp_path / "state.npz")
    again = run()
    again.load(tmp_path / "state.npz")
    for simulation in (through, again):
        for _ in range(10):
            simulation.advance_frame()
            substeps.add(simulation.substeps)
    assert (len(substeps) > 1) == explicit
    assert (again.time, again.substeps) == (through.time, through.substeps)
    np.testing.assert_array_equal(again.positions, through.positions)
    np.testing.assert_array_equal(again.velocities, through.velocities)


def test_damaged_and_foreign_checkpoints_are_refused(block, tmp_path):
    simulation = dropped(block)
    path = tmp_path / "state.npz"
    simulation.save(path)
    good = path.read_bytes()
    for name, data in {
        "cut": good[: len(good) // 2],
        "empty": b"",
        "text": b"not a checkpoint",
        "flipped": good[:600] + bytes(b ^ 255 for b in good[600:700]) + good[700:],
    }.items():
        (tmp_path / name).write_bytes(data)
        with pytest.raises(InputError, match="damaged"):
            simulation.load(tmp_path / name)
    with pytest.raises(InputError, match="no such checkpoint"):
        simulation.load(tmp_path / "missing.npz")
    with pytest.raises(InputError, match="another scene"):
        dropped(block, precision="f64").load(path)
    other = tf.Simulation(tf.Scene(bodies=[tf.Body(mesh=block)]))
    with pytest.raises(InputError, match="another scene"):
        other.load(path)


def test_checkpoint_that_cannot_be_written_says_so(block, tmp_path):
    (tmp_path / "file").write_text("")
    with pytest.raises(InputError, match="cannot be written"):
        dropped(block).save(tmp_path / "file" / "state.npz")


def test_failed_write_keeps_the_older_checkpoint(block, tmp_path, monkeypatch):
    simulation = dropped(block)
    path = tmp_path / "state.npz"
    simulation.save(path)
    before = path.read_bytes()

    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savez", full)
    with pytest.raises(InputError, match="No space left"):
        simulation.save(path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


def test_both_precisions_live_side_by_side(block):
    single, double = dropped(block), dropped(block, precision="f64")
    for _ in range(10):
        single.step()
        double.step()
    difference = np.abs(single.positions - double.positions).max()
    assert 0 < difference < 1e-4


def test_second_simulation_of_the_same_class_compiles_nothing(block):
    from taichifem.integrators import implicit

    first = dropped(block)
    first.step()
    world = first._world
    del first
    kernels = implicit._load._primal.mapper.mapping
    before = len(kernels)
    shorter = tf.TetMesh.bar(size=(0.5, 0.3, 0.3), cells=(5, 3, 3))
    second = dropped(shorter)
    second.step()
    assert second._world is world
    assert len(kernels) == before


@pytest.mark.parametrize(
    ("method", "value", "words"),
    [
        ("set_positions", np.zeros((3, 3)), "shape"),
        ("set_positions", np.full((112, 3), np.nan), "NaN"),
        ("set_velocities", np.zeros(5), "shape"),
    ],
)
def test_bad_arrays_are_named(block, method, value, words):
    with pytest.raises(InputError, match=words):
        getattr(dropped(block), method)(value)


def test_unknown_precision_and_arch(block):
    scene = tf.Scene(bodies=[tf.Body(mesh=block)])
    with pytest.raises(InputError, match="precision"):
        tf.Simulation(scene, precision="f16")
    with pytest.raises(InputError, match="arch"):
        tf.Simulation(scene, arch="abacus")


def test_divergence_is_told_and_the_state_kept(block):
    simulation = dropped(block)
    simulation.step()
    before = simulation.positions
    simulation.set_velocities(np.full((112, 3), 3e38))
    with pytest.raises(tf.Diverged, match="diverged at t"):
        simulation.step()
    np.testing.assert_array_equal(simulation.positions, before)
