"""Random sequential addition: spheres that do not overlap, the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tisim import Box, Cloud, InputError, Scene
from tisim.engine.batches import Batches
from tisim.packing import random_sequential
from tisim.packing.random_sequential import SATURATION_FRACTION, place, placed_side_by_side
from tisim.packing.region import box, inside_round
from tisim.packing.saturation import fill
from tisim.packing.tried_places import Packing

LOW, HIGH = np.array([-1.0, 0.0, 2.0]), np.array([1.0, 1.0, 3.5])
RADIUS = 0.05
PERIODIC = [(False,) * 3, (True,) * 3, (True, False, True)]


def tree_of(centres, periodic):
    """A tree of places; a side of 0 is that of an axis that is not periodic."""
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
        # What the periodic option is for: without it spheres do overlap across the faces.
        assert tree_of(centres, (True,) * 3).query_pairs(2 * RADIUS * (1 - 1e-12))


def test_the_seed_decides():
    first, again, other = (place(np.full(200, RADIUS), box(LOW, HIGH), seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1


def test_places_are_uniform():
    centres = np.concatenate([place(np.full(50, 1e-3), box(LOW, HIGH), seed) for seed in range(200)])
    u = (centres - LOW) / (HIGH - LOW)
    assert np.abs(u.mean(axis=0) - 0.5).max() < 4 / np.sqrt(12 * len(u))
    assert np.abs(u.var(axis=0) - 1 / 12).max() < 4 * np.sqrt(1 / 180 / len(u))


def test_what_cannot_be_reached_is_refused():
    with pytest.raises(InputError, match=r"volume fraction must be at most 0.384.*; received 0\.8727"):
        place(np.full(5000, RADIUS), box(LOW, HIGH), 0)


def test_what_is_just_beyond_reach_says_what_was_reached():
    with pytest.raises(InputError, match=r"at most 0\.\d{4}, where no further sphere fits") as error_info:
        place(np.full(2280, RADIUS), box(LOW, HIGH, periodic=(True,) * 3), 0)
    reached = float(str(error_info.value).split("at most ")[1][:6])
    # One sphere is 0.00017; saturated packings of this size differ by some ten spheres.
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
"""Unlike ones, two that are the same, and one with room for a single sphere."""


def test_side_by_side_packings_are_those_made_alone(monkeypatch):
    def made(packing):
        try:
            return place(packing.radii, packing.region, packing.seed)
        except InputError as error:
            return str(error)

    alone, rounds = [made(packing) for packing in PACKINGS], []
    everywhere = random_sequential.everywhere
    monkeypatch.setattr(
        random_sequential, "everywhere", lambda some: rounds.append(len(some)) or everywhere(some)
    )
    with placed_side_by_side(PACKINGS):
        together = [made(packing) for packing in PACKINGS]
    assert rounds == [5]
    assert "3 were placed" in alone[-1]
    for one, other in zip(alone, together, strict=True):
        np.testing.assert_array_equal(one, other)
    # Nothing is kept beyond.
    made(PACKINGS[0])
    assert rounds == [5, 1]


def test_spheres_of_a_batch_are_placed_side_by_side(monkeypatch):
    """Also where one scene has no room for a sphere, which then fails alone."""
    rounds, everywhere = [], random_sequential.everywhere
    monkeypatch.setattr(
        random_sequential, "everywhere", lambda some: rounds.append(len(some)) or everywhere(some)
    )
    box_of_two_walls = Box(low=(0.0,) * 3, high=(1.0,) * 3, periodic=(False, True, True))
    scenes = [
        Scene(
            particles=Cloud(number=20, radius=radius, density=1.0),
            domain=box_of_two_walls,
            duration=1.0,
            seed=seed,
        )
        for seed, radius in enumerate((0.02, 0.05, 0.6, 0.08))
    ]
    results = dict(Batches().run(scenes, strict=False))
    assert rounds == [3]
    assert [k for k, result in results.items() if not result.status.ok] == [2]
    for k in (0, 1, 3):
        np.testing.assert_array_equal(results[k].start["position"], scenes[k].start()["position"])


def saturated(region, radius, seed=0):
    """Centres of a packing that has no more room, started from none."""
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
def test_saturation_in_the_bulk_is_that_of_zhang_and_torquato():
    """0.38413; for 700 spheres a single packing is off by about 0.002."""
    region = box(np.zeros(3), np.ones(3), periodic=(True,) * 3)
    radius = (3 * SATURATION_FRACTION / (4 * np.pi * 700)) ** (1 / 3)
    sphere = 4 / 3 * np.pi * radius**3
    fractions = [len(saturated(region, radius, seed)) * sphere for seed in range(12)]
    assert np.mean(fractions) == pytest.approx(SATURATION_FRACTION, abs=0.002)


@pytest.mark.slow
def test_filling_voids_is_the_same_process_as_trying_everywhere():
    """Mean number of neighbours within 1.1 diameters at the same volume fraction, by either way."""
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
    # Tight enough to tell a process that favours narrow voids from one that does not.
    assert spread < 0.03 * np.mean(by_trial)
