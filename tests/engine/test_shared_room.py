"""Scenes that differ in the lengths of their lists run as one batch, with the same bits as alone."""

import pickle

import numpy as np
import pytest

from tests.engine.test_rows import Springs, hung
from tests.scenes import scene
from tests.sources.fields import fields
from tisim import InputError, Material
from tisim.effects import Granular, Hooke, Walls
from tisim.engine import shared_room
from tisim.engine.batches import Batches
from tisim.engine.shared_room import SharedRooms
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
    assert roomy.rooms() == {"springs": {"springs": ROOMY}}
    assert one.rooms() == {"springs": {"springs": 32}}
    assert roomy == one
    assert pickle.loads(pickle.dumps(roomy)).rooms() == roomy.rooms()
    assert roomy.digest() == one.digest()
    assert roomy.to_toml() == one.to_toml()
    assert roomy.replace({"effects.springs.share": 2.0}).rooms() == one.rooms()
    without = roomy.model_copy(update={"effects": ()})
    assert (without.rooms(), without.acting()) == ({}, ())


def sizes(scenes):
    """Rows of springs in memory, of four numbers each."""
    return [one.room_size() // 4 for one in scenes]


def test_much_empty_memory_is_not_shared(rng, monkeypatch):
    """Scenes are put into groups, in each of which at most half of the memory is empty."""
    short, long = [hung(rng, 5) for _ in range(3)], hung(rng, 200)
    assert sizes([*short, long]) == [32, 32, 32, 256]
    assert set(sizes(SharedRooms().scenes([*short, long]))) == {256}
    monkeypatch.setattr(shared_room, "SPARE_NUMBERS", 400)
    kept = SharedRooms()
    assert sorted(sizes(kept.scenes([*short, long]))) == [32, 32, 256, 256]
    assert set(sizes(kept.scenes([short[0], *[long] * 3]))) == {256}
    # The memory of an earlier batch would be too much for this one.
    assert sizes(kept.scenes(short)) == [32, 32, 32]
    every = [hung(rng, number) for number in (20, 40, 70, 140, 300, 500)]
    assert sizes(every) == [32, 64, 128, 256, 512, 512]
    found = sizes(kept.scenes(every))
    assert len(set(found)) == 2
    for size in set(found):
        group = [own for own, given in zip(sizes(every), found, strict=True) if given == size]
        assert size * len(group) <= max(2 * sum(group), 100)


def test_rooms_are_kept_for_later_batches(rng):
    kept = SharedRooms()
    for number in (200, 5, 70):
        assert sizes(kept.scenes([hung(rng, number)])) == [256]
    assert sizes(kept.scenes([hung(rng, 300)])) == [512]


def test_octrees_count_as_memory(rng):
    """A row of the octree of a fibre has some thousand numbers."""
    few, many = magnet(rng, 10), magnet(rng, 40)
    assert many.room_size() > 1.9 * few.room_size() > 32 * 3000
    assert few.room_size() == len(few.derived_rows()["cells"]) + 32 * sum(n for _, n in Cylinder.columns())


class ShortRows(Springs):
    """Springs with derived rows as long as their list."""

    def derived_rows(self):
        return {"own": [0.0] * len(self.springs)}


def test_own_parts_whose_rows_ignore_the_memory_are_refused(rng):
    springs = [hung(rng, number).effects[0].springs for number in (5, 40)]
    scenes = [
        scene(np.zeros((1, 3)), np.zeros((1, 3)), (ShortRows(springs=one),), mass=1.0, dt=0.5)
        for one in springs
    ]
    with pytest.raises(
        InputError, match=r"^parameters with lists and derived_rows must be \d+ numbers, as in"
    ):
        dict(Batches().run(scenes))


def magnet(rng, number):
    """Random fibres with a sum by cells."""
    cylinders = [
        Cylinder(centre=rng.uniform(-5, 5, 3), axis=rng.normal(size=3), radius=0.2, length=2.0,
                 magnetisation=rng.normal(size=3) * 1e6)
        for _ in range(number)
    ]  # fmt: skip
    return MagneticCylinders(cylinders=cylinders, sum_digits=2)


def test_numbers_bound_the_worlds_of_a_batch(rng, monkeypatch):
    monkeypatch.setattr("tisim.engine.batches.BATCH_NUMBERS", 600)
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

    few, many = magnet(rng, 10), magnet(rng, 200)
    roomy = few.with_room(many.room())
    assert few.structure() != roomy.structure() == many.structure()
    points = rng.uniform(-5, 5, (2, 100, 3))
    together, alone = fields([few, many], points), fields([few], points[:1])
    for a, b in zip(together, alone, strict=True):
        np.testing.assert_array_equal(a[0], b[0])
