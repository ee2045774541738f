"""Fragments of spun-up piles."""

import numpy as np
import pytest

from tests.cases.common.test_rubble_pile import state_of
from tests.cases.spin_up.test_stages import pile, spin_up
from tisim.cases.spin_up.fragments import COMPARED_MAGNETISATIONS, elongation, elongations, fragments

ROW = np.array([[k, 0, 0] for k in range(8)], float)
BLOCK = np.argwhere(np.ones((3, 3, 3))).astype(float)


def broken(*pieces):
    """A state of pieces far apart."""
    return state_of(np.concatenate([one + np.array([0, 0, 100.0 * k]) for k, one in enumerate(pieces)]))


def test_fragments_have_enough_grains():
    found = fragments(broken(BLOCK, ROW, ROW[:7]))
    assert sorted(one.number for one in found) == [8, 27]
    assert [one.number for one in fragments(broken(BLOCK, ROW, ROW[:7]), least=9)] == [27]


def test_the_most_elongated_fragment_of_a_broken_pile_counts():
    """A row of eight is far longer than wide; it does not count before the pile has broken."""
    whole, piece = pile(), broken(BLOCK, ROW)
    longest = max(one.elongation for one in fragments(piece))
    assert longest > 5
    assert elongation(spin_up(whole, piece)) == pytest.approx(longest)
    rounded = broken(BLOCK, BLOCK)
    assert elongation(spin_up(whole, rounded)) < 1.5
    assert elongation(spin_up(whole, rounded, piece)) == pytest.approx(longest)
    assert np.isnan(elongation(spin_up(whole, whole)))


def test_elongations_are_by_magnetisation():
    runs = [spin_up(pile(), broken(BLOCK, ROW), magnetisation=m) for m in (*COMPARED_MAGNETISATIONS, 119.0)]
    found = elongations(runs)
    assert list(found) == list(COMPARED_MAGNETISATIONS)
    assert [len(one) for one in found.values()] == [1, 1]
