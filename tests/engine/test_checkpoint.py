"""Checkpoints: a resumed run has the same bits, and an incomplete checkpoint is refused."""

import io

import h5py
import numpy as np
import pytest

from tisim import Box, Cloud, InputError, RunError, Scene, Simulation
from tisim.effects import Agglomeration, Heating, Impact
from tisim.engine.checkpoint import restore, save, snapshot
from tisim.files import checksum
from tisim.operators import Cooling


def flow(seed=3, number=100, heat_capacity=500.0):
    return Scene(
        particles=Cloud(number=number, radius=4e-4, density=3000.0, deviation=(60.0, 60.0, 60.0)),
        effects=(Impact(hardness=2e5), Heating(heat_capacity=heat_capacity), Agglomeration(), Cooling()),
        domain=Box(low=(-5e-3,) * 3, high=(5e-3,) * 3, images=False),
        duration=4e-4,
        seed=seed,
    )


@pytest.fixture(scope="module", params=["world", pytest.param("particle", marks=pytest.mark.slow)])
def simulation(request):
    compiled = Simulation(flow(), worlds=2, schedule=request.param)
    yield compiled
    compiled.close()


def ends(simulation):
    return [(r.state, r.work, r.time, r.status) for r in simulation.results()]


@pytest.mark.long
def test_goes_on_to_the_same_bits(simulation, tmp_path):
    scenes = [flow(3), flow(4)]
    simulation.load(scenes)
    simulation.run()
    whole = ends(simulation)
    assert whole[0][1]["merges"] > 10
    assert whole[0][1]["steps"] > 40

    simulation.load(scenes)
    simulation.run(steps=17)
    save(simulation, tmp_path / "c.h5")
    assert [path.name for path in tmp_path.iterdir()] == ["c.h5"]
    simulation.run(steps=5)  # moves the state away from the saved one
    simulation.load(scenes)
    restore(simulation, tmp_path / "c.h5")
    assert simulation.results()[0].work["steps"] == 17
    simulation.run()
    for (state, *rest), (expected, *others) in zip(ends(simulation), whole, strict=True):
        assert rest == others
        assert state.keys() == expected.keys()
        for name, values in state.items():
            np.testing.assert_array_equal(values, expected[name], err_msg=name)


@pytest.fixture
def checkpoint_file(simulation, tmp_path):
    simulation.load([flow()])
    simulation.run(steps=9)
    save(simulation, tmp_path / "c.h5")
    return tmp_path / "c.h5"


@pytest.mark.parametrize("other", [flow(seed=4), flow(number=99), flow(heat_capacity=501.0)])
def test_refuses_another_scene(simulation, checkpoint_file, other):
    simulation.load([other])
    with pytest.raises(InputError, match="checkpoint must be of the same scenes"):
        restore(simulation, checkpoint_file)
    assert simulation.results()[0].work["steps"] == 0


@pytest.mark.slow
def test_refuses_another_capacity(simulation, checkpoint_file):
    larger = Simulation(flow(), worlds=2, capacity=120)
    larger.load([flow()])
    with pytest.raises(InputError, match=r"checkpoint's capacity must be 120; received .*100"):
        restore(larger, checkpoint_file)
    larger.close()


def test_refuses_a_file_cut_short_damaged_or_none(simulation, checkpoint_file, tmp_path):
    content, velocity = checkpoint_file.read_bytes(), simulation.s.read("velocity").tobytes()[:200]
    simulation.load([flow()])
    for size in (0, 10, len(content) // 2, len(content) - 1):
        checkpoint_file.write_bytes(content[:size])
        with pytest.raises(
            InputError, match="checkpoint must be a file of tisim, whole and with its checksum"
        ):
            restore(simulation, checkpoint_file)
    at = content.index(velocity) + 100
    checkpoint_file.write_bytes(content[:at] + bytes([content[at] ^ 1]) + content[at + 1 :])
    with pytest.raises(InputError, match="checkpoint must be a file of tisim, whole and with its checksum"):
        restore(simulation, checkpoint_file)
    with pytest.raises(InputError, match="checkpoint must be an existing file"):
        restore(simulation, tmp_path / "none.h5")
    assert simulation.results()[0].work["steps"] == 0


def test_full_disk_keeps_the_checkpoint_before(simulation, checkpoint_file, monkeypatch):
    before = checkpoint_file.read_bytes()

    def full(handle):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("tisim.files.atomic.os.fsync", full)
    with pytest.raises(RunError, match="No space left on device; everything stored before is intact"):
        save(simulation, checkpoint_file)
    assert checkpoint_file.read_bytes() == before
    assert [path.name for path in checkpoint_file.parent.iterdir()] == ["c.h5"]


def forged(path, name, change):
    """Change a column of a checkpoint, and give the file a matching checksum."""
    image = io.BytesIO(checksum.read_image(path, "checkpoint", "a file"))
    with h5py.File(image, "r+") as file:
        values, attributes = np.asarray(file[name]), dict(file[name].attrs)
        del file[name]
        file[name] = change(values)
        file[name].attrs.update(attributes)
    path.write_bytes(checksum.with_checksum(image.getvalue()))


FORGED = {
    "count, far beyond": ("count", lambda a: np.full_like(a, 2**31 - 1), "between 0 and 100"),
    "count, just beyond": ("count", lambda a: np.full_like(a, 101), "between 0 and 100"),
    "count, negative": ("count", lambda a: np.full_like(a, -1), "between 0 and 100"),
    "status": ("status", lambda a: np.full_like(a, 77), "a known status"),
    "failed": ("failed", lambda a: np.full_like(a, 2**20), "a known status"),
    "time": ("time", lambda a: np.full_like(a, -1e30), "between 0 and"),
    "time, not finite": ("time", lambda a: np.full_like(a, np.nan), "between 0 and"),
    "time's rounding": ("time_carry", lambda a: np.full_like(a, 1e-3), "between"),
    "end, later": ("end", lambda a: 2 * a, r"\[0.0004\], or the time at which a world ended before"),
    "end, of a world that goes on": ("end", lambda a: 0.9 * a, r"\[0.0004\]"),
    "end, negative": ("end", lambda a: -a, r"\[0.0004\]"),
    "end, not finite": ("end", lambda a: np.full_like(a, np.nan), r"\[0.0004\]"),
    "seed": ("seed", lambda a: a + 1, r"\[3\]"),
    "steps": ("steps", lambda a: -a, "between 0 and"),
    "a mass": ("mass", lambda a: -a, "within the range of f64"),
    "a radius": ("radius", lambda a: -a, "within the range of f64"),
    "a place": ("position", lambda a: np.full_like(a, np.inf), "within the range of f64"),
    "a temperature": ("temperature", lambda a: -a, "at least 0 K"),
    "single precision": ("velocity", lambda a: a.astype(np.float32), "float64 numbers of shape"),
    "whole numbers": ("position", lambda a: np.zeros(a.shape, np.int64), "float64 numbers of shape"),
}


@pytest.mark.parametrize("case", FORGED)
def test_columns_out_of_range_are_refused(simulation, checkpoint_file, case):
    name, change, rule = FORGED[case]
    forged(checkpoint_file, name, change)
    simulation.load([flow()])
    with pytest.raises(InputError, match=rf"checkpoint('s |\.){name} must be (of )?{rule}"):
        restore(simulation, checkpoint_file)
    assert simulation.results()[0].work["steps"] == 0
    if name == "count":
        with pytest.raises(InputError, match="checkpoint's count must be between 0 and 100"):
            snapshot(checkpoint_file)


def test_columns_of_other_shapes_are_refused(simulation, checkpoint_file):
    whole = checkpoint_file.read_bytes()
    simulation.load([flow()])
    for name in simulation.s.saved():
        checkpoint_file.write_bytes(whole)
        forged(checkpoint_file, name, lambda a: np.zeros([n + 5 for n in a.shape], a.dtype))
        with pytest.raises(InputError, match=f"checkpoint's {name} must be .* numbers of shape"):
            restore(simulation, checkpoint_file)
        if name in ("count", "time", "steps", *(field.name for field in simulation.s.reported)):
            with pytest.raises(InputError, match="checkpoint must be of particles in rows of one length"):
                snapshot(checkpoint_file)
