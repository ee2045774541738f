"""Brownian particles by B16 (6.24), counted in known results and in a run without a magnet."""

from types import SimpleNamespace

import numpy as np
import pytest
from scipy.stats import chi2

from tisim import run
from tisim.cases.capture import curves, diffusing
from tisim.cases.capture import scene as capture
from tisim.cases.capture.statistics import ANGLES, ASPECTS, FREE_NUMBER, MAGNET
from tisim.cases.common.magnetic_fibre import SATURATION_MOMENTS

BOUND = np.sqrt(12 * 1.380649e-23 * 298.0 / (6 * np.pi * 1e-3 * 125e-9) * 50.0)
"""The distance (m) below which a particle of 125 nm is Brownian after 50 s."""


def ended(moved, captured, far):
    """A run whose particles have started beside the cylinder, or beyond its end if ``far``, and moved by
    fractions of BOUND; at the end they are in the reverse order."""
    scene = capture.scene()
    radius, length = 300e-6, 1000e-6
    start = np.where(
        np.array(far)[:, None], [0.0, 0.0, 0.5 * length + 1e-4], [1.2 * radius, 0.0, 0.2 * length]
    )
    number = len(moved)
    back = slice(None, None, -1)
    end = start + BOUND * np.array(moved)[:, None] * np.array([0.6, 0.0, -0.8])
    return SimpleNamespace(
        scene=scene, time=50.0, start={"position": start, "radius": np.full(number, 125e-9)},
        state={
            "id": np.arange(number)[back], "position": end[back],
            "captured_at": np.array(captured, float)[back],
        },
    )  # fmt: skip


def test_a_particle_is_brownian_if_it_is_free_and_has_not_moved_far():
    """The axis of the cylinder is along z; the third particle has moved too far and the last is captured."""
    result = ended([0.3, 0.99, 1.01, 0.5], [-1, -1, -1, 3.0], [True, False, False, False])
    np.testing.assert_allclose(
        np.sqrt(diffusing.squared_displacement(result)), BOUND * np.array([0.3, 0.99, 1.01, 0.5])
    )
    assert list(diffusing.brownian(result)) == [True, True, False, False]
    assert list(diffusing.brownian(result, free=False)) == [True, True, False, True]
    assert list(diffusing.brownian(result, "top")) == [True]
    assert list(diffusing.brownian(result, "side")) == [True, False, False]


def test_the_fraction_of_a_group_is_a_ratio_of_sums():
    """Starts with one and with three particles in TOP: 3 of 4 particles are Brownian, not the mean of 1 and
    2/3."""
    group = [
        ended([0.5, 2.0], [-1, -1], [True, False]),
        ended([0.5, 0.5, 2.0], [-1, -1, -1], [True, True, True]),
    ]
    mean = diffusing.brownian_fraction(group, "top")
    assert mean.value == 0.75
    # The residuals of the starts are 0.25 and -0.25, over a mean of two particles.
    assert mean.half == pytest.approx(12.706 * 0.25 / 2, rel=1e-3)


def test_without_a_magnet_the_criterion_holds_for_a_part_of_the_particles():
    """r^2/(2 D t) is distributed as chi^2 of three degrees of freedom, and (6.24) asks for less than 6."""
    assert chi2.cdf(6.0, 3) == pytest.approx(diffusing.FREE, rel=1e-12)
    assert pytest.approx(0.888, abs=5e-4) == diffusing.FREE
    free = run(capture.scene(number=FREE_NUMBER, duration=5.0, seed=3).without(*MAGNET))
    spread = np.sqrt(diffusing.FREE * (1 - diffusing.FREE) / FREE_NUMBER)
    assert diffusing.diffuses(free.check()).mean() == pytest.approx(diffusing.FREE, abs=4 * spread)


def test_figure_of_brownian_fractions():
    """Particles of n nm are Brownian in SIDE and not in TOP, for aspect ratios below 6 only if n < 100."""

    slow, gone = ended([0.5, 2.0], [-1, -1], [False, True]), ended([2.0, 2.0], [-1, -1], [False, True])

    def rows(sizes, aspects):
        return [
            ({"nanometres": n, "angle": a, "aspect": r}, [slow if r > 6 or n < 100 else gone] * 2)
            for n in sizes
            for r in aspects
            for a in ANGLES
        ]

    side, top, aspects, sizes = curves.diffusing(
        rows(SATURATION_MOMENTS, (20.0,)), rows(curves.SOME, ASPECTS)
    ).axes
    for axis, fraction in ((side, 1.0), (top, 0.0), (sizes, 0.5)):
        for drawn in axis.containers:
            assert set(drawn.lines[0].get_ydata()) == {fraction}
    found = {one.get_label(): set(one.lines[0].get_ydata()) for one in aspects.containers}
    assert found["50 nm, L/D = 1.67"] == {0.5}
    assert (found["125 nm, L/D = 1.67"], found["125 nm, L/D = 6.67"]) == ({0.0}, {0.5})
