"""Checks and figures of avalanches, with synthetic slopes and with a few runs."""

from types import SimpleNamespace

import numpy as np
import pytest

from tests.cases.avalanche.slopes import WIDTH, block, leaning
from tisim import Box, InputError
from tisim.cases.avalanche import figures as drawing
from tisim.cases.avalanche.checks import of_avalanches
from tisim.cases.avalanche.figures import STRIP, figures, strips_of
from tisim.cases.avalanche.measures import load_on_walls
from tisim.cases.avalanche.scaling import CONTRAST, moment_eigenvalues
from tisim.cases.avalanche.scene import DEFAULT, DIAMETERS, FLUX, GRAVITY, RELAXATION, SIZES, Cell
from tisim.cases.avalanche.stages import Avalanche, avalanches, of, steeper_by
from tisim.cases.case import Size

CELL = Cell(number=0, column=8.0, width=WIDTH, length=40.0, height=20.0)


def avalanche(d, field, seed, run, top=16):
    """An avalanche that ends as a staircase."""
    state = leaning(top + seed % 2, run, d)
    measures = {"box_force_z": -GRAVITY * state["mass"].sum(), "gate_force_z": 0.0, "kinetic_ratio": 1e-5}
    sides = (CELL.length * d, CELL.width * d, CELL.height * d)
    cell = Box(low=(0.0, 0.0, 0.0), high=sides, periodic=(False, True, False))
    end = SimpleNamespace(state=state, measures=measures, time=0.0, scene=SimpleNamespace(domain=cell))
    # Only columns of small grains become higher when they are magnetised, by a half.
    high = 6 if field and d == DIAMETERS[0] else 4
    return Avalanche(CELL, d, field, seed, block([4] * 8, d), block([high + seed % 2] * 8, d), end)


@pytest.fixture(scope="module")
def staircases():
    """Staircases of all sizes: 45 degrees for the smallest grains in a field, 27 for all others."""
    return [
        avalanche(d, field, seed, 1 if field and d == DIAMETERS[0] else 2)
        for d in DIAMETERS
        for field in (0.0, FLUX)
        for seed in (1, 0)
    ]


def test_steeper_slopes_are_detected_by_pairs_of_starts(staircases):
    d = DIAMETERS[0]
    without, magnetised = of(staircases, d, 0.0), of(staircases, d, FLUX)
    assert [one.seed for one in without] == [0, 1]
    assert steeper_by(magnetised, without) == pytest.approx(45 - 26.57, abs=1.5)
    claims = {check.name: check for check in of_avalanches(staircases)}
    flat = claims["5 mm, without a field: angle, degrees (L21: 37.2)"]
    assert flat.mean.value == pytest.approx(26.57, abs=1.0)
    # The heap is equally high and half as long.
    assert not claims["5 mm: volume with field over volume without (L21: 1.09)"].ok
    assert claims["5 mm: volume magnetised over volume settled"].mean.value == pytest.approx(6.5 / 4)
    assert claims["growth of the volume, 5 mm minus 5 cm"].mean.value == pytest.approx(0.5)
    alike = claims["without a field: angle of 5 mm minus 5 cm, degrees"]
    assert alike.value.value == pytest.approx(0.0, abs=0.1)
    assert alike.beside == "0 for scaled copies; L21: 5.9"
    assert claims["5 mm, settled: growth factor of a relaxed sweep"].ok
    assert claims["load on the walls over weight, largest deviation"].ok


def test_figures_of_a_size_use_its_settings_and_show_each_slope(staircases, monkeypatch):
    calls = []
    monkeypatch.setattr(drawing, "avalanches", lambda *a, **more: calls.append((a, more)) or staircases)
    monkeypatch.setitem(SIZES, "stiff", Size("", {"cell": CELL, "stiffness": 1e6}))
    drawn = figures("stiff", None)
    (((cell, wanted, _), more),) = calls
    assert (cell, len(wanted), more) == (CELL, 18, {"stiffness": 1e6})
    slopes = drawn["slopes.png"]
    assert len(slopes.axes) == 3
    assert [len(axis.lines) for axis in slopes.axes] == [6, 6, 6]
    rows = drawn["slopes.csv"].splitlines()
    assert len(rows) == 1 + len(staircases)
    assert rows[0].startswith("diameter_m,field_T,seed,angle_degrees")
    (_, _, bar) = drawn["density.png"].axes
    assert bar.get_ylabel() == "part of the volume that grains fill"
    assert len(drawn["forces.png"].axes[0].lines) == 8
    # Each of L21's sizes is of one diameter.
    with pytest.raises(
        InputError, match=r"size must be one whose cell holds .* \(default, small, large, stiff\)"
    ):
        figures("l21_1cm", None)


def test_strips_of_a_column():
    state = block([1] * 7)
    strips = strips_of(state, DIAMETERS[0])
    assert sorted(set(strips.values())) == [0, 1, 2]
    assert strips[int(state["id"][0])] == 0
    assert STRIP == 3.0


def test_moments_of_two_grains_have_known_eigenvalues():
    """Two grains touch through the periodic face: +-2 a along the line between them, +-a across."""
    d, a = DIAMETERS[0], CONTRAST / 8
    state = {"position": np.array([[0, 0.3 * d, 0], [0, 5.3 * d, 0]]), "radius": np.full(2, d / 2)}
    found = moment_eigenvalues(state, 6 * d)
    np.testing.assert_allclose(found, a * np.array([-2, -1, -1, 1, 1, 2]))
    assert not moment_eigenvalues(state, 20 * d).any()


@pytest.mark.slow
def test_a_field_loosens_small_grains_and_without_a_field_all_sizes_are_alike():
    """There are two starts of each; without a field gravity alone shapes the slopes of all sizes alike."""
    small, _, large = DIAMETERS
    wanted = [(d, field, seed) for seed in (0, 1) for d, field in ((small, 0.0), (large, 0.0), (small, FLUX))]
    runs = avalanches(DEFAULT, wanted)
    flat, same, loose = (of(runs, *key) for key in ((small, 0.0), (large, 0.0), (small, FLUX)))
    assert abs(np.mean(steeper_by(same, flat))) < 6
    assert all(20 < one.angle < 40 for one in (*flat, *same))
    assert all(1.02 < one.loosened < 1.2 for one in loose)
    assert all(a.volume < b.volume for a, b in zip(flat, loose, strict=True))
    for one in runs:
        assert one.overlap < 0.02
        assert load_on_walls(one.end) == pytest.approx(1.0, abs=0.03)
    # Full sweeps would diverge in the settled bed; the relaxed sweeps converge.
    for one in loose:
        least, most = moment_eigenvalues(one.settled, one.width)[[0, -1]]
        assert least < -1
        assert all(abs(1 - RELAXATION + RELAXATION * value) < 0.9 for value in (least, most))
