"""What figures of colloids show, of results that are known."""

from types import SimpleNamespace

import numpy as np
import pytest

from cases import capture, capture_curves, capture_pictures, cascade_pictures, concentration_pictures
from cases.capture_curves import TIMES
from cases.capture_statistics import ANGLES, ASPECTS


def mean_of(n):
    """Captured fraction of particles of size n in time, see below."""
    return 0.5 * np.heaviside(TIMES - n / 20, 1.0) + 0.25 * np.heaviside(TIMES - n / 10, 1.0)


def caught(*times):
    """A run in which as many particles were captured at these times, s; -1 for never."""
    return SimpleNamespace(state={"captured_at": np.array(times, float)})


def test_captured_fraction_in_time_and_at_the_end():
    """One of two particles of size n is caught at n/10 s in one start; both, at n/20 s, in the other."""

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
    sizes, aspects = rows(swept(capture.MOMENT, (20.0,))), rows(swept(capture_curves.SOME, ASPECTS))
    axes = capture_curves.captured(angles, sizes, aspects).axes
    for axis, n in zip(axes[:4], (75, 75, 212, 212), strict=True):
        assert len(axis.lines) == len(ANGLES)
        np.testing.assert_allclose(axis.lines[-1].get_ydata(), mean_of(n))
    by_size = {line.get_label(): line.get_ydata() for line in axes[4].lines}
    assert list(by_size) == [f"{n} nm" for n in capture.MOMENT]
    np.testing.assert_allclose(by_size["50 nm"], mean_of(50))
    assert [line.get_label() for line in axes[5].lines] == [f"L/D = {r:.3g}" for r in ASPECTS]
    np.testing.assert_allclose(axes[5].lines[0].get_ydata(), mean_of(125))
    for axis, x in zip(axes[6:], (ANGLES, ASPECTS), strict=True):
        line = axis.containers[0].lines[0]
        assert list(line.get_xdata()) == list(x)
        assert set(line.get_ydata()) == {0.75}
    assert capture_curves.table(sizes).splitlines()[1].startswith("25,0.0,20.0,all,2,0.75,")


@pytest.mark.slow
def test_pictures_of_the_magnet(monkeypatch):
    """A shorter cylinder has more capture volume for its own (B16 6.4.1), and most of it across the field."""
    monkeypatch.setattr(capture_pictures, "PLANE", 41)
    monkeypatch.setattr(capture_pictures, "SPACE", 40)
    short, *_, long = (
        [
            capture_pictures.capture_volume(capture.scene(nanometres=50, angle=a, aspect=r))
            for a in (0.0, 90.0)
        ]
        for r in (5 / 3, 20 / 3)
    )
    assert short[0] > 2 * long[0]
    assert short[1] > 1.1 * long[1]
    titles = [axis.get_title() for axis in capture_pictures.volume().axes]
    assert titles[2] == f"L/D = 1.67, 90°: {short[1]:.1f} times its volume"
    field = capture_pictures.field().axes[2].collections[0]
    # |B| at the edge of the picture is hardly that of the magnet, 1 T along x.
    assert field.get_array().reshape(41, 41)[0, 0] == pytest.approx(capture.FLUX, rel=0.1)


def test_cascades_in_time_and_their_ratio(monkeypatch):
    """Ten particles caught one by one, every second; in random cascades, every two."""

    def known(wanted, repeats, share, progress):
        slow = [1.0 if one.orientation == "optimal" else 2.0 for one in wanted]
        return [s * np.tile(np.arange(1.0, 11.0), (repeats, 1)) for s in slow]

    monkeypatch.setattr(cascade_pictures, "captured_at", known)
    made = cascade_pictures.figures("default", lambda fraction: None)
    large, _, stages, ratios = made["cascade.png"].axes
    optimal, random, *_ = large.lines
    np.testing.assert_allclose(optimal.get_xdata()[::20], np.arange(1.0, 11.0))
    np.testing.assert_allclose(random.get_xdata(), 2 * optimal.get_xdata())
    assert len(stages.lines) == 2 * len(cascade_pictures.STAGES) + 1
    assert {float(c.lines[0].get_ydata()[0]) for c in ratios.containers} == {2.0}
    row = made["cascade.csv"].splitlines()[1].split(",")
    assert row[-2:] == ["9.0", "0.0"]


def test_curves_of_concentrated_samples():
    when = np.linspace(0.0, 0.6, 4)
    curves = {
        (angle, c): (when, c * np.arange(4.0), c * np.arange(4.0) + angle)
        for angle in (0.0, 90.0) for c in concentration_pictures.CONCENTRATIONS
    }  # fmt: skip
    right = concentration_pictures.drawn(curves).axes[1]
    held, touched = right.lines[2:4]
    assert held.get_label() == "500 mg/mL"
    np.testing.assert_allclose(held.get_ydata(), 0.5 * np.arange(4.0) + 90.0)
    np.testing.assert_allclose(touched.get_ydata(), 0.5 * np.arange(4.0))
    assert concentration_pictures.table(curves).splitlines()[2] == f"0.0,0.005,{when[1]},0.005,0.005"


def test_picture_of_a_run_shows_chains_in_colour_and_their_mean_length():
    """Two pairs along the field and one particle by itself, which all were single at the start."""

    class Seen(list):
        times = np.array([0.0, 1e-3])

    def frame(position):
        moment = np.tile([1.0, 0.0, 0.0], (5, 1))
        arrays = {"position": position, "radius": np.full(5, 7.5e-8), "moment": moment}
        return SimpleNamespace(arrays=arrays)

    pairs = 1.5e-7 * np.array([[0, 0, 0], [1, 0, 0], [0, 0, 9], [1, 0, 9], [0, 9, 0.0]])
    found = Seen([frame(10 * pairs), frame(pairs)])
    left, right = concentration_pictures.pictures(found)["chains.png"].axes
    np.testing.assert_allclose(right.lines[0].get_xdata(), [0.0, 1.0])
    np.testing.assert_allclose(right.lines[0].get_ydata(), [1.0, 5 / 3])
    discs = left.collections[0]
    # Drawn from the farthest, the single one, on; places in um, seen along y.
    assert discs.get_array().mask.tolist() == [True, False, False, False, False]
    middle = pairs.mean(axis=0)
    np.testing.assert_allclose(discs.get_offsets()[0], 1e6 * (pairs[4] - middle)[[0, 2]])
