"""The case capture: its scene, its statistics and its figures."""

import subprocess
import sys

import numpy as np
import pytest

from tisim import Recording, run
from tisim.analysis import Mean
from tisim.cases.capture import CASE, curves, figures, statistics
from tisim.cases.capture import scene as capture
from tisim.cases.case import Claim
from tisim.cases.common.magnetic_fibre import SATURATION_MAGNETISATION, fibre
from tisim.io.reader import frames


def test_cylinder_lies_at_its_angle_and_is_saturated_along_the_field():
    body = fibre(30.0, 20.0)
    assert np.degrees(np.arccos(body.axis[0])) == pytest.approx(30.0)
    assert np.linalg.norm(body.magnetisation) == pytest.approx(SATURATION_MAGNETISATION)
    # The angle is between the axis of a long cylinder and the field.
    turned = np.degrees(np.arccos(np.dot(body.axis, body.magnetisation) / SATURATION_MAGNETISATION))
    assert 0.0 < turned < 30.0
    across = fibre(90.0, 5 / 3).magnetisation
    np.testing.assert_allclose(across, (SATURATION_MAGNETISATION, 0, 0), atol=1e-6 * SATURATION_MAGNETISATION)
    assert fibre(30.0, 20.0, "fixed") == body.model_copy(
        update={"magnetisation": (SATURATION_MAGNETISATION, 0.0, 0.0)}
    )


@pytest.mark.slow
def test_transverse_captures_more_and_pictures_show_it(tmp_path):
    settings = [{"angle": angle, "number": 40, "duration": 2.0} for angle in (0.0, 90.0)]
    along, across = statistics.results(settings, 16)
    gain = statistics.fractions(across) - statistics.fractions(along)
    assert Claim("", Mean.of(gain), least=0.02).ok
    # The fraction at an earlier time is equal to the fraction of a shorter run from the same start.
    (short,) = statistics.results([{**settings[1], "duration": 1.0}], 16)
    early = [statistics.fraction(r.state, 1.0) for r in across]
    assert early == [statistics.fraction(r.state) for r in short]
    assert statistics.mean(across, 1.0).value < statistics.mean(across).value
    group = [({"nanometres": 125, "angle": 90.0, "aspect": 5 / 3}, across)]
    text = curves.table(group).splitlines()
    assert text[1].startswith("125,90.0,1.666")
    path = tmp_path / "trajectory.h5"
    run(capture.scene(number=40, duration=2.0), record=Recording(path, frames=8))
    with frames(path) as trajectory:
        figure = figures.pictures(trajectory)["trajectories.png"]
        last = trajectory[-1].arrays
    curve = figure.axes[1].lines[0].get_ydata()
    assert curve[-1] == pytest.approx((last["captured_at"] >= 0).mean())
    assert len(figure.axes[0].collections[0].get_segments()) == 40 * (len(trajectory.times) - 1)


def test_a_scene_with_the_placement_of_the_case_is_read_without_other_imports(tmp_path):
    file = tmp_path / "scene.toml"
    file.write_text(capture.scene().to_toml(), encoding="utf-8")
    code = f"import tisim; print(tisim.Scene.from_toml({str(file)!r}).digest())"
    completed = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert completed.stdout.strip() == capture.scene().digest()


def test_force_towards_a_cylinder():
    body = fibre(90.0, 2.0)
    r, half = body.radius, body.length / 2
    points = np.array([[2 * r, 0, 0], [0, 0, 2 * half], [2 * r, 0, 2 * half], [0.0, 0.0, 0.0]])
    force = np.array([[-3.0, 1, 0], [1.0, 0, 2], [-1.0, 0, -1], [1.0, 0, 0]])
    over, beyond = r, half
    corner = (over + beyond) / np.hypot(over, beyond)
    np.testing.assert_allclose(figures.attraction(force, points, body), [3, -2, corner, 0], atol=1e-12)


def test_weights_of_directions():
    flat = np.array([[0.2, 0.4]] * 7)
    np.testing.assert_allclose(statistics.isotropic(flat), [0.2, 0.4])
    # The mean of cos^2 of the angle to the field, over directions, is 1/3.
    squares = np.cos(np.radians(statistics.ANGLES))[:, None] ** 2
    np.testing.assert_allclose(statistics.isotropic(squares), 1 / 3, atol=0.01)
    np.testing.assert_allclose(statistics.even(squares), 0.5, atol=0.01)


@pytest.mark.slow
def test_interval_of_a_mean_over_angles_accounts_for_shared_starts():
    """Fractions at neighbouring angles are correlated, as they share their starts."""
    settings = [{"angle": angle, "number": 20, "duration": 10.0} for angle in (45.0, 50.0)]
    one, other = (statistics.fractions(group) for group in statistics.results(settings, 40))
    assert np.corrcoef(one, other)[0, 1] > 0.4


@pytest.mark.slow
def test_the_conclusions_of_b16():
    failed = [item.name for item in CASE.check() if not item.ok]
    assert failed == []
