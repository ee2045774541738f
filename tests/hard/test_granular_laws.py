"""The hard cases of grains under the other granular laws: adhesion, rolling, twisting, viscous friction."""

from functools import partial

import numpy as np
import pytest

from tests.hard.granular_scenes import ELASTIC, LOSSY, grains, lossy, push, stored
from tests.hard.judging import holds
from tisim.cases.hard.granular import GrainLaw, column_at_rest, friction_at_its_limit
from tisim.cases.hard.ratios import mixture_of_grains, restitution_of_unlike_masses
from tisim.cases.hard.scales import impacts_from_nanometres_to_kilometres

pytestmark = pytest.mark.slow

OTHER_LAWS = ("hooke", "jkr", "dmt")


def law_of(name, two=lossy):
    """Return everything that a hard case must know of a law."""
    return GrainLaw(*(partial(one, name) for one in (grains, push, stored)), ELASTIC[name], two(name))


STRONG = {
    "hooke": {"restitution": 0.1},
    "jkr": {"viscous_time": 1e-2},
    "dmt": {"damping": 100.0},
}
"""Losses that bring a column to rest within seconds."""
GRIPS = {
    "hooke": {"friction": 0.5, "restitution": 0.0},
    "jkr": {"friction": 0.5, "viscous_time": 4e-3, "surface_energy": 20.0},
    "dmt": {"friction": 0.5, "damping": 200.0, "surface_energy": 20.0},
}
"""Friction, damping strong enough that a sticking grain does not oscillate, and adhesion if the law has
it."""
ADHESION = {"hooke": 0.0, "jkr": 6 * np.pi * 20.0, "dmt": 8 * np.pi * 20.0}
"""Pull-off force of both planes, N."""
CREEPS = {"hooke": 0.0, "jkr": 0.0, "dmt": 2 * 0.7 * 200.0}
"""Drag coefficient (N s/m) of both planes, for laws whose friction is a dashpot."""


@pytest.mark.parametrize("name", OTHER_LAWS)
def test_other_laws_keep_the_bounds(name):
    holds(restitution_of_unlike_masses, law_of(name), 0.5 if "restitution" in ELASTIC[name] else 1.0)
    holds(mixture_of_grains, law_of(name, LOSSY.get))
    holds(column_at_rest, law_of(name), STRONG[name])
    holds(friction_at_its_limit, law_of(name), GRIPS[name], ADHESION[name], CREEPS[name])
    holds(impacts_from_nanometres_to_kilometres, law_of(name))
