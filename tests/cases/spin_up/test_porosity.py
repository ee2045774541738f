"""Porosity of piles at rest, by number of grains and spacing of the cloud."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.cases.common.test_rubble_pile import state_of
from tisim.cases.spin_up import porosity
from tisim.cases.spin_up.porosity import Piles, by_number_and_spacing, report, settled_at


def block(mass):
    """A result with 27 touching grains, of a mass (kg) each."""
    place = np.argwhere(np.ones((3, 3, 3))).astype(float)
    return SimpleNamespace(state=state_of(place, mass=np.full(27, mass)))


def test_a_porosity_is_the_void_of_the_hull():
    """A cube of 3 x 3 x 3 grains of 1 m: its hull is a cube of 2 m, with six slabs of 1/2, twelve quarters of
    cylinders and eight eighths of a sphere."""
    hull = 8 + 12 + 1.5 * np.pi + np.pi / 6
    (void,) = Piles(27, 1.0, 0.0, [block(3000 * np.pi / 6)]).porosities
    assert void == pytest.approx(1 - 27 * np.pi / 6 / hull, abs=2e-3)


def test_piles_fall_for_the_same_number_of_free_fall_times():
    assert settled_at(1.3) == 7500.0
    assert settled_at(5.2) == pytest.approx(8 * 7500.0)


def test_piles_of_each_number_and_spacing_are_run(monkeypatch):
    made = []

    def grouped(scenes, starts, progress):
        made.extend(scenes)
        return [[block(1000.0 + k), block(1100.0 + k)] for k in range(len(scenes) // starts)]

    monkeypatch.setattr(porosity, "grouped", grouped)
    found = by_number_and_spacing(2, numbers=(20, 40))
    assert [len(one.particles.mass) for one in made[::4]] == [20, 20, 40, 40]
    assert [one.seed for one in made[:4]] == [0, 1, 0, 1]
    assert [one.duration for one in made[::4]] == [settled_at(1.3), settled_at(2.0)] * 2
    # The stiffness of a copy is that of L21's pile, multiplied by the square of the scale.
    softer, stiffer = (made[k].materials["rubble"].young for k in (0, 8))
    assert stiffer / softer == pytest.approx(2 ** (2 / 3))
    text = report(found).splitlines()
    assert len(text) == 1 + 8
    assert text[1].startswith("  20 grains from a lattice of 1.3 m, 0 A/m: 0.")
    assert text[-1].startswith("  40 grains from a lattice of 2 m, 1190 A/m: 0.")
