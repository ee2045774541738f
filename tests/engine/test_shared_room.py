"""Scenes that differ in the lengths of their lists run as one batch, with the same bits as alone."""

import numpy as np
import pytest

from tests.engine.test_rows import hung
from tests.scenes import scene
from tests.sources.fields import fields
from tisim import Material
from tisim.effects import Granular, Hooke, Walls
from tisim.engine import shared_room
from tisim.engine.batches import Batches
from tisim.engine.shared_room import SharedRooms, rows
from tisim.geometry import Plane, SphericalSurface
from tisim.sources import Cylinder, MagneticCylinders

GRAIN = {"grain": Material(young=1e7, poisson=0.3, stiffness=1e3)}
ROOMY = 64
"""Rows with memory for 40 springs."""


def test_scenes_of_one_batch(rng):
    """One simulation is compiled for none, five and forty springs, for which memory differs; states are those
    of the scenes alone, and results have the scenes as they were given."""
    scenes = [hung(rng, number) for number in (5, 40, 0)]
    assert len({one.structure() for one in scenes}) == 2
    batches = Batches()
    together = dict(batches.run(scenes))
    assert len(batches._idle) == 1
    for index, one in enumerate(scenes):
        alone = Batches()
        ((_, result),) = alone.run([one])
        assert together[index].scene is one
        np.testing.assert_array_equal(together[index].state["force"], result.state["force"])
        alone.close()
    # Later batches without the long list compile nothing.
    assert dict(batches.run(scenes[2:]))[0].status.ok
    assert len(batches._idle) == 1
    batches.close()


def test_room_is_no_part_of_a_scene(rng):
    """A scene with more memory equals itself, and has the same files and digest."""
    one = hung(rng, 5)
    (roomy, _) = SharedRooms().scenes([one, hung(rng, 40)])
    assert roomy.rooms() == ({"springs": ROOMY},)
    assert one.rooms() == ({"springs": 32},)
    assert roomy == one
    assert roomy.digest() == one.digest()
    assert roomy.to_toml() == one.to_toml()
    assert roomy.replace({"effects.springs.share": 2.0}).rooms() == one.rooms()


def test_much_empty_memory_is_not_shared(rng, monkeypatch):
    """Few short lists beside a long one are another batch if more than half of the memory would be empty."""
    short, long = [hung(rng, 5) for _ in range(3)], hung(rng, 200)
    assert [rows(one.rooms()) for one in (*short, long)] == [32, 32, 32, 256]
    assert {rows(one.rooms()) for one in SharedRooms().scenes([*short, long])} == {256}
    monkeypatch.setattr(shared_room, "SPARE_ROWS", 100)
    kept = SharedRooms()
    assert [rows(one.rooms()) for one in kept.scenes([*short, long])] == [32, 32, 32, 256]
    assert {rows(one.rooms()) for one in kept.scenes([short[0], *[long] * 3])} == {256}
    # The memory of an earlier batch would be too much for this one.
    assert [rows(one.rooms()) for one in kept.scenes(short)] == [32, 32, 32]


def test_rows_bound_the_worlds_of_a_batch(rng, monkeypatch):
    monkeypatch.setattr("tisim.engine.batches.BATCH_ROWS", 150)
    batches = Batches()
    results = dict(batches.run([hung(rng, 40)] * 3))
    assert [results[k].status.ok for k in range(3)] == [True] * 3
    assert [each.worlds for each in batches._idle] == [2]
    batches.close()


def test_walls_keep_their_own_memory():
    """Grains remember contacts by the rows of a wall, so that walls with other numbers of planes, or with
    surfaces, are another batch."""
    floor, side = Plane(point=(0, 0, 0), normal=(0, 0, 1)), Plane(point=(-5, 0, 0), normal=(1, 0, 0))
    bowl = SphericalSurface(radius=9.0)

    def made(**walls):
        effects = (Granular(normal=Hooke()), Walls(**walls))
        return scene([(0, 0, 1.0)], [(0, 0, -1.0)], effects, radius=1.0, mass=1.0, dt=1e-4, materials=GRAIN)

    few, many, round_ = made(planes=[floor]), made(planes=[floor, *[side] * 12]), made(spheres=[bowl])
    apart = SharedRooms().scenes([few, many, round_])
    assert [one.rooms() for one in apart] == [one.rooms() for one in (few, many, round_)]
    assert len({one.structure() for one in apart}) == 3


@pytest.mark.slow
def test_sums_by_cells_in_a_larger_memory(rng):
    """The octree of ten fibres is the same beside one of two hundred."""

    def made(number):
        cylinders = [
            Cylinder(centre=rng.uniform(-5, 5, 3), axis=rng.normal(size=3), radius=0.2, length=2.0,
                     magnetisation=rng.normal(size=3) * 1e6)
            for _ in range(number)
        ]  # fmt: skip
        return MagneticCylinders(cylinders=cylinders, sum_digits=2)

    few, many = made(10), made(200)
    roomy = few.with_room(many.room())
    assert few.structure() != roomy.structure() == many.structure()
    points = rng.uniform(-5, 5, (2, 100, 3))
    together, alone = fields([few, many], points), fields([few], points[:1])
    for a, b in zip(together, alone, strict=True):
        np.testing.assert_array_equal(a[0], b[0])
