"""Widths of structures and gaps: columns and sheets of grains, seen along the field."""

import numpy as np
import pytest

from tisim.cases.mrf_shear.morphology import PIXEL, shadow, widths
from tisim.cases.mrf_shear.scene import LARGE_RADIUS, scene

R, UM = LARGE_RADIUS, 1e-6
SIDE = 20 * UM
CELL = scene(sides=(SIDE, SIDE, 60 * UM)).domain


def grains(position):
    return {"position": np.array(position), "radius": np.full(len(position), R)}


def test_a_single_chain_is_as_wide_as_a_grain():
    column = [(1 * UM, 10 * UM, z) for z in np.arange(R, 60 * UM, 2 * R)]
    found = widths(grains(column), CELL)
    assert found.structures == pytest.approx(2 * R, abs=2 * PIXEL)
    assert found.covered == pytest.approx(np.pi * R**2 / SIDE**2, rel=0.02)
    # The widest disc in the gap lies between four images of the chain.
    assert SIDE / 2 < found.gaps < np.sqrt(2) * SIDE - 2 * R + PIXEL


def test_a_sheet_and_the_gap_beside_it():
    """Two rows of grains side by side, dense along x, cover a band of two diameters."""
    sheet = [(x, y, 30 * UM) for x in np.arange(0, SIDE, 0.5 * UM) for y in (3 * UM, 3 * UM + 2 * R)]
    found = widths(grains(sheet), CELL)
    assert found.structures == pytest.approx(4 * R, abs=2 * PIXEL)
    assert found.gaps == pytest.approx(SIDE - 4 * R, abs=2 * PIXEL)
    assert found.covered == pytest.approx(4 * R / SIDE, rel=0.02)


def test_only_grains_in_the_slice_cast_a_shadow():
    sides = np.array([SIDE, SIDE, 60 * UM])
    outside = np.array([[10 * UM, 10 * UM, 30 * UM + 5 * UM + 1.01 * R]])
    assert not shadow(outside, np.array([R]), sides, 10 * UM)[0].any()
    # A sphere that reaches into the slice by half its radius shows the section at that height.
    cut = outside - (0, 0, 0.51 * R)
    image, pixel = shadow(cut, np.array([R]), sides, 10 * UM)
    assert pixel <= PIXEL
    assert image.sum() * pixel**2 == pytest.approx(np.pi * R**2 * (1 - 0.5**2), rel=0.02)
