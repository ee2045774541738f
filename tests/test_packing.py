"""Random sequential addition: spheres that do not overlap, the same for the same seed."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.spatial import cKDTree

from tisim.errors import InputError
from tisim.packing.sequential import sequential_addition

LOW, HIGH = np.array([-1.0, 0.0, 2.0]), np.array([1.0, 1.0, 3.5])
RADIUS = 0.05


@pytest.mark.parametrize("periodic", [False, True])
def test_no_two_spheres_overlap_also_across_periodic_faces(periodic):
    for seed in range(5):
        centres = sequential_addition(1200, RADIUS, LOW, HIGH, seed, periodic)
        assert ((centres >= LOW) & (centres < HIGH)).all()
        tree = cKDTree(centres - LOW, boxsize=HIGH - LOW if periodic else None)
        assert not tree.query_pairs(2 * RADIUS * (1 - 1e-12))
    if not periodic:
        # What the periodic option is for: without it spheres do overlap across the faces.
        assert cKDTree(centres - LOW, boxsize=HIGH - LOW).query_pairs(2 * RADIUS * (1 - 1e-12))


def test_the_seed_decides():
    first, again, other = (sequential_addition(200, RADIUS, LOW, HIGH, seed) for seed in (1, 1, 2))
    np.testing.assert_array_equal(first, again)
    assert np.abs(first - other).max() > 0.1


def test_places_are_uniform():
    centres = np.concatenate([sequential_addition(50, 1e-3, LOW, HIGH, seed) for seed in range(200)])
    u = (centres - LOW) / (HIGH - LOW)
    assert np.abs(u.mean(axis=0) - 0.5).max() < 4 / np.sqrt(12 * len(u))
    assert np.abs(u.var(axis=0) - 1 / 12).max() < 4 * np.sqrt(1 / 180 / len(u))


def test_what_cannot_be_reached_is_refused():
    with pytest.raises(InputError, match=r"volume fraction .* must be within reach"):
        sequential_addition(3000, RADIUS, LOW, HIGH, 0)
