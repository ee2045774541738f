"""Overlaps of triples of rods by attempt (B16 Fig. 3.4)."""

import numpy as np
import pytest

from tisim.analysis import Mean
from tisim.cases.packing.overlap_removal import (
    DEEPEST_START,
    FOLLOWED,
    METHODS,
    RandomRemoval,
    measured_removal,
    overlaps,
    removal,
    removal_figure,
    removal_table,
    triples,
)
from tisim.steppers.packing.packing_stepper import PackingStepper


def decay(rate, number=5):
    """The total overlap of triples that falls by a factor in each attempt."""
    return np.tile((1 - rate) ** np.arange(FOLLOWED + 1.0)[:, None], (1, number))


def test_measures_of_a_removal():
    found = {"fast": decay(0.5), "slow": decay(0.01)}
    fast, slow = (measured_removal(one) for one in found.values())
    assert fast.early == Mean(0.5**20, 0.0)
    assert (fast.attempts, slow.attempts) == (10, FOLLOWED)
    assert fast.rising == slow.rising == 0
    found["fast"][2] = 1.0
    assert measured_removal(found["fast"]).rising == pytest.approx(0.1)
    name, early, half, attempts, _rising = removal_table(found).splitlines()[2].split(",")
    assert (name, float(early), float(half), float(attempts)) == (
        "slow",
        pytest.approx(0.99**20),
        0,
        FOLLOWED,
    )
    drawn = removal_figure(found).axes
    np.testing.assert_allclose(drawn[1].lines[-1].get_ydata(), decay(0.01)[:, 0])


def test_random_removal_is_for_this_comparison_only():
    assert RandomRemoval not in PackingStepper.known().values()


@pytest.mark.slow
@pytest.mark.long
def test_methods_remove_the_overlaps_of_rods_in_the_order_of_b16(rng):
    places, turns = triples(20, rng)
    deep = overlaps(places, turns)
    assert ((deep > 0.01 * DEEPEST_START) & (deep < DEEPEST_START)).all()
    found = [measured_removal(removal(*one, places, turns)) for one in METHODS.values()]
    early = [one.early.value for one in found]
    assert early == sorted(early)
    assert early[0] < 1e-3 < 0.2 < early[1]
    assert [one.rising > 0.01 for one in found] == [False, False, True, True]
