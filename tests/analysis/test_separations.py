"""Near pairs against a search over all pairs and their images."""

from itertools import combinations, product

import numpy as np
import pytest

from tisim import Box, InputError, ShearedBox
from tisim.analysis import contacts, near, nearest_image, periodic_sides

LEANING = ShearedBox(low=(0, 0, 0), high=(3, 4, 5), rate=0.3, flow="z", gradient="x")


@pytest.mark.parametrize(
    "domain",
    [
        Box(low=(0, 0, 0), high=(3, 4, 5), periodic=(False,) * 3),
        Box(low=(0, 0, 0), high=(3, 4, 5), periodic=(True, False, True)),
        LEANING,
        LEANING.model_copy(update={"flow": "y", "gradient": "z"}),
    ],
)
def test_near_pairs_use_nearest_images(rng, domain):
    """Also for spheres of unlike sizes, and for positions outside the box."""
    sides, position = periodic_sides(domain, time=7.3), rng.uniform(-1, 6, (70, 3))
    shifts = np.array(list(product(*(range(-4, 5) if side.any() else [0] for side in sides)))) @ sides
    apart = (position[None] - position[:, None])[:, :, None] + shifts
    shortest = np.linalg.norm(apart, axis=3).min(axis=2)
    expected = [(i, j) for i, j in combinations(range(70), 2) if shortest[i, j] <= 1.2]
    assert len(expected) > 40
    assert near(position, 1.2, sides).tolist() == [list(pair) for pair in expected]
    radius = rng.choice([0.02, 0.1, 0.6], 70)
    expected = [
        (i, j) for i, j in combinations(range(70), 2) if shortest[i, j] <= radius[i] + radius[j] + 0.1
    ]
    assert contacts(position, radius, 0.1, sides).tolist() == [list(pair) for pair in expected]
    i, j = np.array(expected).T
    vectors = nearest_image(position[j] - position[i], sides)
    np.testing.assert_allclose(np.linalg.norm(vectors, axis=1), shortest[i, j], rtol=1e-12)


def test_a_reach_beyond_the_box_is_refused():
    with pytest.raises(InputError, match="reach must be at most a side of the periodic box, 1 m"):
        near(np.zeros((2, 3)), 1.1, (1.0, 0.0, 0.0))
    with pytest.raises(InputError, match="sides must be three lengths, or three vectors"):
        near(np.zeros((2, 3)), 1.0, (1.0,))
    assert near(np.zeros((0, 3)), 1.0).shape == (0, 2)
