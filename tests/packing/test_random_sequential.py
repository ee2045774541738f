"""Random sequential addition: spheres do not overlap, and the same seed gives the same packing."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tests.scenes import compiled
from tisim import Box, Cloud, InputError, RandomInBall, RandomInBox, RandomInCylinder, Scene
from tisim.engine.batches import Batches
from tisim.packing import RandomSequential, random_sequential
from tisim.packing.random_sequential import SATURATION_FRACTION, place, placed_side_by_side
from tisim.packing.region import box, inside_box, inside_round
from tisim.packing.saturation import fill
from tisim.packing.tried_places import Packing

LOW, HIGH = np.array([-1.0, 0.0, 2.0]), np.array([1.0, 1.0, 3.5])
RADIUS = 0.05
PERIODIC = [(False,) * 3, (True,) * 3, (True, False, True)]


def tree_of(centres, periodic):
    """A search tree of positions; a side of 0 marks an axis that is not periodic."""
    sides = np.where(periodic, HIGH - LOW, 0.0)
    places = np.where(periodic, (centres - LOW) % (HIGH - LOW), centres - LOW)
    return cKDTree(places, boxsize=sides if any(periodic) else None)


@pytest.mark.parametrize("periodic", PERIODIC)
def test_no_two_spheres_overlap_also_across_periodic_faces(periodic):
    for seed in range(5):
        centres = place(np.full(1200, RADIUS), box(LOW, HIGH, periodic), seed)
        assert ((centres >= LOW) & (centres < HIGH)).all()
        assert not tree_of(centres, periodic).query_pairs(2 * RADIUS * (1 - 1e-12))
    if not all(periodic):
        # Without the periodic option spheres overlap across the faces.
        assert tree_of(centres, (True,) * 3).query_pairs(2 * RADIUS * (1 - 1e-12))


def test_the_seed_decides():
    first, again, other = (place(np.full(200, RADIUS), box(LOW, HIGH), seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1


def test_positions_are_uniform():
    centres = np.concatenate([place(np.full(50, 1e-3), box(LOW, HIGH), seed) for seed in range(200)])
    u = (centres - LOW) / (HIGH - LOW)
    assert np.abs(u.mean(axis=0) - 0.5).max() < 4 / np.sqrt(12 * len(u))
    assert np.abs(u.var(axis=0) - 1 / 12).max() < 4 * np.sqrt(1 / 180 / len(u))


def test_an_unreachable_fraction_is_refused():
    with pytest.raises(InputError, match=r"volume fraction must be at most 0.384.*; received 0\.8727"):
        place(np.full(5000, RADIUS), box(LOW, HIGH), 0)


def test_a_failed_packing_reports_the_fraction_reached():
    with pytest.raises(InputError, match=r"at most 0\.\d{4}, where no further sphere fits") as error_info:
        place(np.full(2280, RADIUS), box(LOW, HIGH, periodic=(True,) * 3), 0)
    reached = float(str(error_info.value).split("at most ")[1][:6])
    # One sphere is 0.00017; saturated packings of this size differ by about ten spheres.
    assert reached == pytest.approx(SATURATION_FRACTION, abs=0.006)


PACKINGS = [
    Packing(np.full(300, RADIUS), box(LOW, HIGH), 3),
    Packing(np.full(300, RADIUS), box(LOW, HIGH, (True,) * 3), 3),
    Packing(
        np.repeat([0.004, 0.2, 0.03], [50, 1, 20]), inside_round("ball", (1.0, 0.0, 0.0), (1.0,) * 3, 0.2), 4
    ),
    Packing(np.full(300, RADIUS), box(LOW, HIGH), 3),
    Packing(np.full(1, 0.5), box(LOW, HIGH), 2**63 - 1),
    Packing(np.array([0.3, 0.3, 0.3]), box(LOW, LOW + 0.4), 0),
]
"""Different packings, two identical ones, and one with room for a single sphere."""


@pytest.fixture
def rounds(monkeypatch):
    """The number of packings made together, for each call."""
    made, everywhere = [], random_sequential.everywhere

    def counted(packings):
        made.append(len(packings))
        return everywhere(packings)

    monkeypatch.setattr(random_sequential, "everywhere", counted)
    return made


def made(packing):
    """Centres of a packing, or the message of its failure."""
    try:
        return place(packing.radii, packing.region, packing.seed)
    except InputError as error:
        return str(error)


def test_packings_made_together_equal_those_made_alone(rounds):
    alone = [made(packing) for packing in PACKINGS]
    assert rounds == [1] * 6
    assert "3 were placed" in alone[-1]
    with placed_side_by_side(PACKINGS):
        together = [made(packing) for packing in PACKINGS]
    assert rounds[6:] == [5]
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one, other)
    # After the block nothing is kept.
    made(PACKINGS[0])
    assert rounds[7:] == [1]


def test_many_spheres_are_placed_in_several_rounds(rounds, monkeypatch):
    monkeypatch.setattr(random_sequential, "SPHERES_AT_ONCE", 350)
    with placed_side_by_side(PACKINGS):
        together = [made(packing) for packing in PACKINGS]
    assert rounds == [1, 1, 3]
    for one, other in zip(map(made, PACKINGS), together, strict=True):
        np.testing.assert_array_equal(one, other)


TWO_WALLS = Box(low=(0.0,) * 3, high=(1.0,) * 3, periodic=(False, True, True))


def cloud(number, radius, seed, placement=None):
    """A scene of spheres in a box with two walls."""
    where = {} if placement is None else {"placement": placement}
    return Scene(
        particles=Cloud(number=number, radius=radius, density=1.0, **where),
        domain=TWO_WALLS,
        duration=1.0,
        seed=seed,
    )


def test_spheres_of_a_batch_are_placed_side_by_side(rounds):
    """Impossible scenes fail alone, before any insertion trial: in one no sphere fits, in another the volume
    fraction is too high."""
    scenes = [
        cloud(20, 0.02, 0),
        cloud(20, 0.05, 1),
        cloud(20, 0.6, 2),
        cloud(2000, 0.05, 3),
        cloud(20, 0.08, 4),
    ]
    results = dict(Batches().run(scenes, strict=False))
    assert rounds == [3]
    assert [k for k, result in results.items() if not result.status.ok] == [2, 3]
    for k in (0, 1, 4):
        np.testing.assert_array_equal(results[k].start["position"], scenes[k].start()["position"])


class InASlab(RandomSequential):
    """A user-defined placement."""

    def region(self, radii, domain):
        return inside_box(np.array([0.1, 0.1, 0.1]), np.array([0.9, 0.9, 0.4]), radii.max())


@pytest.mark.parametrize(
    "placement",
    [
        RandomInBox(low=(0.1, 0.2, 0.3), high=(0.5, 0.9, 0.8)),
        RandomInBall(radius=0.3, centre=(0.5, 0.5, 0.5)),
        RandomInCylinder(centre=(0.5, 0.5, 0.5), axis=(1.0, 2.0, 0.5), radius=0.2, length=0.4),
        InASlab(),
    ],
    ids=lambda one: one.kind(),
)
def test_every_kind_of_placement_is_placed_together(placement, rounds):
    scenes = [cloud(20, 0.03, seed, placement) for seed in (5, 6)]
    simulation = compiled(scenes[0], 2, 20)
    rounds.clear()
    simulation.load(scenes)
    assert rounds == [2]
    for start, scene in zip(simulation.starts, scenes, strict=True):
        np.testing.assert_array_equal(start["position"], scene.start()["position"])


def saturated(region, radius, seed=0):
    """Centres of a saturated packing, filled from an empty region."""
    generator = np.random.Generator(np.random.Philox(seed))
    return fill(np.empty((0, 3)), 10**6, 2 * radius, region, generator)


@pytest.mark.parametrize("periodic", PERIODIC)
def test_saturated_packing_has_no_room_left(rng, periodic):
    region = box(LOW, HIGH, periodic)
    centres = saturated(region, RADIUS)
    tree = tree_of(centres, periodic)
    assert not tree.query_pairs(2 * RADIUS * (1 - 1e-12))
    places = rng.uniform(0, 1, (200_000, 3)) * (HIGH - LOW)
    assert tree.query(places)[0].max() < 2 * RADIUS


@pytest.mark.slow
def test_bulk_saturation_equals_zhang_and_torquato():
    """The fraction is 0.38413; a single packing of 700 spheres deviates by about 0.002."""
    region = box(np.zeros(3), np.ones(3), periodic=(True,) * 3)
    radius = (3 * SATURATION_FRACTION / (4 * np.pi * 700)) ** (1 / 3)
    sphere = 4 / 3 * np.pi * radius**3
    fractions = [len(saturated(region, radius, seed)) * sphere for seed in range(12)]
    assert np.mean(fractions) == pytest.approx(SATURATION_FRACTION, abs=0.002)


@pytest.mark.slow
def test_filling_voids_equals_trials_everywhere():
    """Mean number of neighbours within 1.1 diameters at the same volume fraction, with both methods."""
    region = box(np.zeros(3), np.ones(3), periodic=(True,) * 3)
    number, radius = 900, (3 * 0.3 / (4 * np.pi * 900)) ** (1 / 3)

    def neighbours(centres):
        return 2 * len(cKDTree(centres % 1, boxsize=1).query_pairs(2.2 * radius)) / number

    by_trial, by_voids = [], []
    for seed in range(8):
        by_trial.append(neighbours(place(np.full(number, radius), region, seed)))
        generator = np.random.Generator(np.random.Philox(100 + seed))
        by_voids.append(neighbours(fill(np.empty((0, 3)), number, 2 * radius, region, generator)))
    spread = np.hypot(np.std(by_trial), np.std(by_voids)) / np.sqrt(7)
    assert abs(np.mean(by_trial) - np.mean(by_voids)) < 4 * spread
    # The tolerance is small enough to detect a process that favours narrow voids.
    assert spread < 0.03 * np.mean(by_trial)
