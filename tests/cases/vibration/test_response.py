"""Resonance, beats and spectrum of vibration, and their figures."""

import numpy as np
import pytest

import tisim
from tisim.cases.vibration import scene as vibration
from tisim.cases.vibration.closed_forms import constants, response
from tisim.cases.vibration.figures import (
    FLOOR,
    exact_histories,
    histories_figure,
    histories_table,
    resonance_figure,
    table,
)
from tisim.cases.vibration.response import (
    FAST,
    SLOW,
    CentreOfGravityHistory,
    Sweep,
    fast_scenes,
    peak,
    recorded,
    slow_scenes,
    vertex,
)
from tisim.cli.inspect import case_spectra
from tisim.effects import Gravity
from tisim.io.reader import frames
from tisim.report import run_report
from tisim.report.viewer_data import ReportOptions

CONSTANTS = {"w": vibration.CYCLOTRON, "k_m": vibration.STIFFNESS / vibration.MASS,
             "push": vibration.CHARGE * vibration.FIELD / vibration.MASS}  # fmt: skip


def history(ratio, duration, number):
    """The closed form as a history of the centre of gravity."""
    t = np.linspace(0.0, duration, number)
    h = 1e-8
    z = response(t, omega=ratio * FAST, **CONSTANTS)
    ahead = response(t + h, omega=ratio * FAST, **CONSTANTS)
    return CentreOfGravityHistory(t, z, (ahead - z) / h)


def test_beat_period_and_spectrum_of_the_closed_form():
    beating = history(0.9, 0.4, 1200)
    assert beating.beat_period() == pytest.approx(2 * np.pi / (0.1 * FAST), rel=3e-4)
    omega, lines = beating.spectrum()
    # Free motion rotates clockwise; the drive has a line at both signs of the frequency.
    for expected in (-FAST, 0.9 * FAST):
        near = np.abs(omega - expected) < 40
        assert omega[near][lines[near].argmax()] == pytest.approx(expected, abs=3.0)
    plus = CONSTANTS["push"] / 2 / abs(CONSTANTS["k_m"] - (0.9 * FAST) ** 2 - CONSTANTS["w"] * 0.9 * FAST)
    assert lines[np.abs(omega - 0.9 * FAST) < 40].max() == pytest.approx(plus, rel=1e-2)
    # Between the lines, side lobes of the window are below the floor of the figure.
    quiet = np.min([np.abs(omega - at) for at in (-FAST, -0.9 * FAST, 0.0, 0.9 * FAST)], axis=0) > 80
    assert lines[quiet].max() < FLOOR * lines.max()


def test_vertex_of_a_parabola_and_peak_of_a_long_time():
    x = np.array([1.0, 2.5, 3.0])
    assert vertex(x, 5 - 2 * (x - 2.1) ** 2) == pytest.approx(2.1)
    t = np.linspace(0, 0.1, 400_001)
    exact = np.abs(response(t, omega=0.8 * FAST, **CONSTANTS)).max()
    assert peak(0.1, omega=0.8 * FAST, **CONSTANTS) == pytest.approx(exact, rel=3e-4)


def test_constants_are_read_from_the_scene_or_are_none():
    array = vibration.scene(0.3, "none", sites=2, flux=0.7, stiffness=30.0)
    parameters = constants(array)
    assert parameters["w"] == pytest.approx(0.7 * vibration.CYCLOTRON)
    assert parameters["k_m"] == pytest.approx(30.0 / vibration.MASS)
    assert parameters["push"] == pytest.approx(CONSTANTS["push"])
    assert parameters["omega"] == pytest.approx(0.3 * vibration.CYCLOTRON)
    assert constants(array.replace({"effects.magnetic_field.constant": [0.1, 0.0, 1.0]})) is None
    assert constants(array.without("tether")) is None
    # Changes that would hardly show in a picture are also detected.
    assert constants(array.replace({"effects.electric_field.phase": [1.0, 0.0, 0.0]})) is None
    assert constants(array.replace({"effects.electric_field.constant": [0.1, 0.0, 0.0]})) is None
    assert constants(array.replace({"effects.magnetic_field.amplitude": [0.0, 0.0, 0.1]})) is None
    falling = array.model_copy(update={"effects": (*array.effects, Gravity())})
    assert constants(falling) is None
    assert constants(array.replace({"particles.mean_velocity": [1.0, 0.0, 0.0]})) is None


@pytest.mark.long
def test_histories_of_a_batch_follow_their_closed_forms():
    """One particle each for the eight drives of Z13 Fig. 3; the figure draws runs and closed forms."""
    eight = recorded(fast_scenes(vibration.RATIOS), 40)
    exact = exact_histories(eight)
    peaks = [np.abs(one).max() for one in exact]
    for one, true, largest in zip(eight, exact, peaks, strict=True):
        assert len(one.time) == 41
        np.testing.assert_allclose(one.place, true, atol=1e-3 * largest)
    # The drive at the cyclotron frequency has the largest response.
    assert np.argmax(peaks) == vibration.RATIOS.index(1.0)
    rows = [row.split(",") for row in histories_table(eight).splitlines()[1:]]
    for (ratio, largest, off), expected, one in zip(rows, vibration.RATIOS, eight, strict=True):
        assert float(ratio) == expected
        assert float(largest) == np.abs(one.place).max()
        assert 0 < float(off) < 1e-3 * float(largest)
    panels = histories_figure(eight).axes
    assert len(panels) == 8
    for axis, one, true in zip(panels, eight, exact, strict=True):
        lines = [line.get_ydata() for line in axis.lines]
        for drawn, wanted in zip(lines, (one.place.real, true.real, one.place.imag, true.imag), strict=True):
            np.testing.assert_array_equal(drawn, wanted)


@pytest.mark.slow
def test_resonance_curve_of_runs_follows_the_closed_form():
    """Both resonances agree; the fast one is slightly lower because of the short time."""
    fast = Sweep.of(fast_scenes(np.linspace(0.9, 1.1, 9)))
    slow = Sweep.of(slow_scenes(np.linspace(0.3, 0.7, 9)))
    assert fast.deviation < 2e-4
    assert slow.deviation < 1e-5
    assert fast.top() == pytest.approx(FAST, rel=1e-2)
    assert slow.top() == pytest.approx(SLOW, rel=3e-2)
    figure = resonance_figure(slow, fast, fast, "none", history(0.9, 0.4, 1200))
    left, right, beats, lines = figure.axes
    np.testing.assert_array_equal(left.lines[1].get_ydata(), slow.peaks)
    np.testing.assert_array_equal(right.lines[1].get_ydata(), fast.peaks)
    assert "65.7" in beats.get_title(loc="left")
    assert lines.get_xlabel().startswith("angular frequency")
    rows = table(("one", slow), ("two", fast)).splitlines()
    assert len(rows) == 1 + 9 + 9
    assert rows[1].split(",")[0] == "one"


@pytest.mark.slow
def test_the_spectrum_of_a_report_has_the_lines_of_the_closed_form(tmp_path):
    """Of a recorded run; a page shows it with its units and the expected frequencies."""
    driven = vibration.scene(0.9 * FAST / vibration.CYCLOTRON, "none", 0.4, sites=1, observed=True)
    path = tmp_path / "trajectory.h5"
    tisim.run(driven, record=tisim.Recording(path, frames=600))
    with frames(path) as trajectory:
        (one,) = case_spectra(trajectory)
    for name, expected in (("fast resonance", -FAST), ("drive", 0.9 * FAST)):
        assert one.expected[name] == pytest.approx(expected, rel=1e-6)
        near = np.abs(one.omega - expected) < 40
        assert one.omega[near][one.amplitudes[near].argmax()] == pytest.approx(expected, abs=3.0)
    facts = one.facts()
    values = [value for value in facts["curves"][0]["values"] if value is not None]
    assert len(facts["omega"]) <= 2000
    assert max(values) == pytest.approx(one.amplitudes.max(), rel=1e-6), "thinning keeps the peak"
    assert min(values) >= one.floor
    page = run_report(path, tmp_path / "r.html", options=ReportOptions(spectra=[one])).read_text()
    assert '<div id="spectra">' in page
    assert facts["unit"] == "m"
