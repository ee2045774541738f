"""Figures of capture, drawn from known results."""

from types import SimpleNamespace

import numpy as np
import pytest

from tisim.cases.capture import curves, figures, regions
from tisim.cases.capture import scene as capture
from tisim.cases.capture.curves import TIMES
from tisim.cases.capture.statistics import ANGLES, ASPECTS
from tisim.cases.common.magnetic_fibre import APPLIED_FLUX, SATURATION_MOMENTS


def mean_of(n):
    """Mean captured fraction of particles of size n against time, for the runs of the test below."""
    return 0.5 * np.heaviside(TIMES - n / 20, 1.0) + 0.25 * np.heaviside(TIMES - n / 10, 1.0)


def caught(*times):
    """A run whose particles were captured at these times, s; -1 for never."""
    return SimpleNamespace(state={"captured_at": np.array(times, float)})


def test_captured_fraction_in_time_and_at_the_end():
    """Of two particles of size n, one is caught at n/10 s in one start, and both at n/20 s in the other."""

    def rows(settings):
        return [
            ({**s}, [caught(s["nanometres"] / 10, -1.0), caught(*[s["nanometres"] / 20] * 2)])
            for s in settings
        ]

    def swept(sizes, aspects, parts=("all",)):
        return [
            {"nanometres": n, "angle": a, "aspect": r, "part": p}
            for n in sizes for p in parts for r in aspects for a in ANGLES
        ]  # fmt: skip

    angles = rows(swept((75, 212), (20.0,), ("top", "side")))
    sizes, aspects = rows(swept(SATURATION_MOMENTS, (20.0,))), rows(swept(curves.SOME, ASPECTS))
    axes = curves.captured(angles, sizes, aspects).axes
    for axis, n in zip(axes[:4], (75, 75, 212, 212), strict=True):
        assert len(axis.lines) == len(ANGLES)
        np.testing.assert_allclose(axis.lines[-1].get_ydata(), mean_of(n))
    by_size = {line.get_label(): line.get_ydata() for line in axes[4].lines}
    assert list(by_size) == [f"{n} nm" for n in SATURATION_MOMENTS]
    np.testing.assert_allclose(by_size["50 nm"], mean_of(50))
    assert [line.get_label() for line in axes[5].lines] == [f"L/D = {r:.3g}" for r in ASPECTS]
    np.testing.assert_allclose(axes[5].lines[0].get_ydata(), mean_of(125))
    for axis, x in zip(axes[6:], (ANGLES, ASPECTS), strict=True):
        line = axis.containers[0].lines[0]
        assert list(line.get_xdata()) == list(x)
        assert set(line.get_ydata()) == {0.75}
    assert curves.table(sizes).splitlines()[1].startswith("25,0.0,20.0,all,2,0.75,")


def test_captured_fractions_by_region():
    """A particle of each setting is caught at a time of its own."""
    settings = regions.settings()
    assert len(settings) == 2 * 2 * len(ANGLES)
    axes = regions.drawn([[caught(1.0 + k)] for k in range(len(settings))]).axes
    titles = [axis.get_title("left") for axis in axes]
    assert titles[0].endswith("125 nm, TOP, L/D = 1.67")
    assert titles[3].endswith("125 nm, SIDE, L/D = 6.67")
    for k, axis in enumerate(axes):
        for line, setting, time in zip(axis.lines, settings[7 * k :], range(7 * k + 1, 99), strict=False):
            assert line.get_label() == f"{setting['angle']:.0f}°"
            np.testing.assert_array_equal(line.get_ydata(), np.heaviside(TIMES - time, 1.0))


def test_regions_are_compared_angle_by_angle(monkeypatch):
    """In SIDE the shorter cylinder captures all particles along the field, and half of them at 15 degrees."""
    fewer = {("side", 0.0, 20 / 3): 0, ("side", 15.0, 20 / 3): 1}

    def results(settings, repeats):
        numbers = [fewer.get((one["part"], one["angle"], one["aspect"]), 2) for one in settings]
        return [[caught(*(1.0 if k < number else -1.0 for k in range(2)))] * repeats for number in numbers]

    monkeypatch.setattr(regions, "results", results)
    claims = list(regions.check(2))
    assert [one.mean.value for one in claims] == [0.0, 1.0, 0.5, 0.0]
    assert all(one.ok for one in claims)
    fewer |= {("side", 0.0, 20 / 3): 2, ("side", 0.0, 5 / 3): 1, ("top", 0.0, 5 / 3): 1}
    assert [one.ok for one in regions.check(2)] == [False, False, True, True]


@pytest.mark.slow
def test_pictures_of_the_magnet(monkeypatch):
    """Shorter cylinders have more capture volume over their own (B16 6.4.1), most of it across the field."""
    monkeypatch.setattr(figures, "PLANE", 41)
    monkeypatch.setattr(figures, "SPACE", 40)
    short, *_, long = (
        [figures.capture_volume(capture.scene(nanometres=50, angle=a, aspect=r)) for a in (0.0, 90.0)]
        for r in (5 / 3, 20 / 3)
    )
    assert short[0] > 2 * long[0]
    assert short[1] > 1.1 * long[1]
    titles = [axis.get_title("left") for axis in figures.volume().axes]
    assert titles[3] == f"(d) L/D = 1.67, 90°:\n{short[1]:.1f} times its own volume"
    fixed = capture.scene(nanometres=50, angle=45.0, aspect=5 / 3, magnetised="fixed")
    own = figures.capture_volume(fixed)
    assert titles[2] == f"(c) L/D = 1.67, 45°, M at 45°:\n{own:.1f} times its own volume"
    field = figures.field().axes[2].collections[0]
    # At the edge of the picture |B| is nearly the applied field, 1 T along x.
    assert field.get_array().reshape(41, 41)[0, 0] == pytest.approx(APPLIED_FLUX, rel=0.1)
