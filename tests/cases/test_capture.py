"""The case capture: its scene, its statistics and its figures."""

import numpy as np
import pytest

from cases import capture, capture_curves, capture_pictures, capture_statistics
from cases.case import Check
from cases.statistics import Claim, Mean
from tisim import Recording, run
from tisim.io.reader import frames


def test_mean_and_its_interval():
    # Student's t for 3 degrees of freedom is 3.18245; the standard error of 1, 2, 3, 4 is sqrt(5/12).
    mean = Mean.of([1.0, 2.0, 3.0, 4.0])
    assert mean.value == 2.5
    assert mean.half == pytest.approx(3.182446 * np.sqrt(5 / 12), rel=1e-6)
    # The error of a ratio, by drawing.
    rng = np.random.default_rng(0)
    a, b = rng.normal(4.0, 0.1, 200_000), rng.normal(2.0, 0.03, 200_000)
    assert Mean(4.0, 0.1).over(Mean(2.0, 0.03)).half == pytest.approx((a / b).std(), rel=0.02)


def test_claim_holds_when_all_of_the_interval_does():
    assert Claim("", Mean(0.5, 0.1), least=0.39).ok
    assert not Claim("", Mean(0.5, 0.1), least=0.41).ok
    assert Claim("", Mean(0.5, 0.1), most=0.61).ok
    assert not Claim("", Mean(0.5, 0.1), most=0.59).ok
    assert Claim("", Mean(0.5, 0.1), most=0.6).cells[:2] == ("0.5 ± 0.1", "below 0.6")


def test_cylinder_lies_at_its_angle_and_is_saturated_along_the_field():
    body = capture.fibre(capture.axis(30.0), 20.0)
    assert np.degrees(np.arccos(body.axis[0])) == pytest.approx(30.0)
    assert np.linalg.norm(body.magnetisation) == pytest.approx(capture.SATURATION)
    # Between the axis of a long cylinder and the field.
    turned = np.degrees(np.arccos(np.dot(body.axis, body.magnetisation) / capture.SATURATION))
    assert 0.0 < turned < 30.0
    across = capture.fibre(capture.axis(90.0), 5 / 3).magnetisation
    np.testing.assert_allclose(across, (capture.SATURATION, 0, 0), atol=1e-6 * capture.SATURATION)


@pytest.mark.long
def test_transverse_captures_more_and_pictures_show_it(tmp_path):
    settings = [{"angle": angle, "number": 40, "duration": 2.0} for angle in (0.0, 90.0)]
    along, across = capture_statistics.results(settings, 16)
    gain = capture_statistics.fractions(across) - capture_statistics.fractions(along)
    assert Claim("", Mean.of(gain), least=0.02).ok
    # The fraction at an earlier time is that of a shorter run from the same start.
    (short,) = capture_statistics.results([{**settings[1], "duration": 1.0}], 16)
    early = [capture_statistics.fraction(r.state, 1.0) for r in across]
    assert early == [capture_statistics.fraction(r.state) for r in short]
    assert capture_statistics.mean(across, 1.0).value < capture_statistics.mean(across).value
    group = [({"nanometres": 125, "angle": 90.0, "aspect": 5 / 3}, across)]
    text = capture_curves.table(group).splitlines()
    assert text[1].startswith("125,90.0,1.666")
    path = tmp_path / "trajectory.h5"
    run(capture.scene(number=40, duration=2.0), record=Recording(path, frames=8))
    with frames(path) as found:
        drawn = capture_pictures.pictures(found)["trajectories.png"]
        last = found[-1].arrays
    curve = drawn.axes[1].lines[0].get_ydata()
    assert curve[-1] == pytest.approx((last["captured_at"] >= 0).mean())
    assert len(drawn.axes[0].collections[0].get_segments()) == 40 * (len(found.times) - 1)


def test_force_towards_a_cylinder():
    body = capture.fibre(capture.axis(90.0), 2.0)
    r, half = body.radius, body.length / 2
    points = np.array([[2 * r, 0, 0], [0, 0, 2 * half], [2 * r, 0, 2 * half], [0.0, 0.0, 0.0]])
    force = np.array([[-3.0, 1, 0], [1.0, 0, 2], [-1.0, 0, -1], [1.0, 0, 0]])
    over, beyond = r, half
    corner = (over + beyond) / np.hypot(over, beyond)
    np.testing.assert_allclose(
        capture_pictures.attraction(force, points, body), [3, -2, corner, 0], atol=1e-12
    )


def test_weights_of_directions():
    flat = np.array([[0.2, 0.4]] * 7)
    np.testing.assert_allclose(capture_statistics.isotropic(flat), [0.2, 0.4])
    # The mean of cos^2 of the angle to the field, over directions, is 1/3.
    squares = np.cos(np.radians(capture_statistics.ANGLES))[:, None] ** 2
    np.testing.assert_allclose(capture_statistics.isotropic(squares), 1 / 3, atol=0.01)
    np.testing.assert_allclose(capture_statistics.even(squares), 0.5, atol=0.01)


@pytest.mark.slow
def test_interval_of_a_mean_over_angles_knows_that_starts_are_shared():
    """Fractions at neighbouring angles rise and fall together, start by start."""
    settings = [{"angle": angle, "number": 20, "duration": 10.0} for angle in (45.0, 50.0)]
    one, other = (capture_statistics.fractions(group) for group in capture_statistics.results(settings, 40))
    assert np.corrcoef(one, other)[0, 1] > 0.4


@pytest.mark.slow
def test_what_b16_concludes():
    failed = [item.name for item in capture.CASE.check() if not item.ok]
    assert failed == []


def test_checks_are_checks():
    assert Check("", 1.0, 1.0, 0.0).cells[3] == "0.0e+00"
