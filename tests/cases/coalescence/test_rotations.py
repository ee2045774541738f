"""Shapes of asteroids by rotation: the rotations that correspond to L21's, and the text and picture of clouds
that are made up."""

from dataclasses import replace

import numpy as np
import pytest

from tests.cases.coalescence.test_runs import made
from tests.cases.common.test_rubble_pile import state_of
from tisim.cases.coalescence import rotations
from tisim.cases.coalescence.published import MAGNETISATIONS, ROTATIONS
from tisim.cases.coalescence.regime import regime
from tisim.cases.coalescence.rotations import (
    CLOUD_DIAMETER,
    Rotated,
    by_rotation,
    picture,
    published_ratio,
    report,
    rotation_here,
)
from tisim.cases.coalescence.scene import DEFAULT


def test_clouds_end_at_the_same_fraction_of_the_critical_spin_as_those_of_50_cm():
    """In microdegrees, and 4 times as fast, because the cloud of 100 cm is 8 times as dense."""
    shown = {item.name: item.value for item in regime()}
    default = shown["default: final over critical spin"] / 50e-6
    for printed in ROTATIONS:
        here = rotation_here(printed)
        assert here == pytest.approx(np.radians(4 * printed))
        name = f"50 cm, {1e6 * printed:g} urad/s, read as microdegrees: final over critical spin"
        assert here * default == pytest.approx(shown[name])


def test_the_published_ratios():
    assert published_ratio(2000e-6, 0.0) == pytest.approx(2.0475, abs=1e-4)
    assert published_ratio(1000e-6, 1190.0) == pytest.approx(1.3924, abs=1e-4)
    assert np.isnan(published_ratio(500e-6, 1190.0))
    assert published_ratio(1000e-6, 0.0, CLOUD_DIAMETER) == pytest.approx(1.0863, abs=1e-4)


def flat(seed, magnetisation, layers):
    """A cloud that has become a block of 4 x 4 grains with some layers, which spins about z."""
    end = state_of(np.argwhere(np.ones((4, 4, layers))).astype(float), moment=np.ones((16 * layers, 3)))
    spin = np.array([0.0, 0.0, 1e-4])
    middle = end["position"] - end["position"].mean(axis=0)
    end |= {"velocity": np.cross(spin, middle), "spin": np.tile(spin, (16 * layers, 1))}
    return replace(made(magnetisation, 18, seed), end=end)


def rotated(printed, layers):
    return Rotated(printed, [flat(seed, m, layers) for m in MAGNETISATIONS for seed in range(2)])


FOUND = [rotated(printed, layers) for printed, layers in zip(ROTATIONS, (4, 3, 2), strict=True)]


def test_elongations_and_spins_of_each_start():
    ratios = [one.elongations(0.0) for one in FOUND]
    assert [one.shape for one in ratios] == [(2,)] * 3
    assert ratios[0][0] == pytest.approx(1.0, abs=0.01)
    assert ratios[0][0] < ratios[1][0] < ratios[2][0]
    # A block of 4 x 4 x 4 grains is lighter than a solid cube of its hull.
    asteroid = FOUND[0].runs[0].asteroid
    assert FOUND[0].final_spin(119.0)[0] == pytest.approx(
        1e-4 / np.sqrt(4 * np.pi * 6.6743e-11 * asteroid.density / 3)
    )


def test_the_text_and_the_picture_of_clouds(monkeypatch):
    # A picture of a cloud takes seconds; test_runs.py draws one.
    drawn = []
    monkeypatch.setattr(rotations, "close_up", lambda axis, *given: drawn.append(axis))
    text = report(FOUND).splitlines()
    assert sum("bounding" in one for one in text) == 1
    assert text[1].startswith("  34.9 µrad/s (L21: 500), 0 A/m: 1.0")
    assert "(1.12)" in text[1]
    assert "(not run)" in text[3]
    (change,) = [one for one in text if one.startswith("  0 A/m, last minus first rotation")]
    assert change.endswith("(L21: 0.93)")
    assert sum("minus 0 A/m" in one for one in text) == 6
    assert sum("119 minus 0 A/m" in one and "L21: -0.11" in one for one in text) == 1
    axes = picture(FOUND).axes
    assert len(axes) == 9 + 1
    assert drawn == axes[:-1]
    labels = [one.get_text() for one in axes[-1].get_legend().get_texts()]
    assert len(labels) == 6


def test_clouds_run_with_the_rotations(monkeypatch):
    asked = []
    monkeypatch.setattr(
        rotations, "clouds", lambda starts, progress, **settings: asked.append(settings) or []
    )
    found = by_rotation(2)
    assert [one.printed for one in found] == list(ROTATIONS)
    assert [one["rotation"] for one in asked] == [rotation_here(one) for one in ROTATIONS]
    assert all(one["number"] == DEFAULT["number"] for one in asked)
