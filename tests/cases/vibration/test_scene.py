"""The case of Z13: the centre of gravity of a cloud follows the closed form for any near field."""

import numpy as np
import pytest

from tests.scenes import simulate
from tisim.cases.vibration.checks import deviation
from tisim.cases.vibration.scene import RATIOS, SPACING, near_fields, scene


@pytest.mark.long
@pytest.mark.parametrize(
    "near_field",
    [
        pytest.param("none", marks=pytest.mark.slow),
        "printed",
        pytest.param("equilibrium", marks=pytest.mark.slow),
    ],
)
def test_centre_of_gravity_follows_the_closed_form(near_field):
    """There are 27 particles at every ratio of Fig. 3; the printed near field drives them apart."""
    results = simulate(
        [scene(r, near_field, duration=0.004, sites=3, error=1e-5) for r in RATIOS], worlds=8, capacity=27
    )
    assert all(result.status.ok for result in results)
    assert deviation(results) < 1e-3
    spread = np.array([np.ptp(result.state["position"], axis=0).max() for result in results])
    if near_field == "printed":
        assert (spread > 2 * SPACING * 1.5).all()
    elif near_field == "equilibrium":
        # Equal particles in a uniform field move as one, and the near field has no effect.
        moved = [result.state["position"] - result.start["position"] for result in results]
        assert max(np.ptp(m, axis=0).max() for m in moved) < 1e-12
        assert min(np.abs(m).max() for m in moved) > 1e-5
    if near_field != "printed":
        assert (spread < 2 * SPACING * 1.1).all()


@pytest.mark.long
def test_error_falls_and_work_rises_with_the_requested_accuracy():
    """The printed near field, before chaos: the reference has a tolerance 100 times tighter."""
    tolerances = (1e-4, 1e-5, 1e-6, 1e-8)
    results = simulate(
        [scene(0.8, "printed", duration=0.001, sites=3, error=e) for e in tolerances], worlds=8, capacity=27
    )
    *places, reference = (result.state["position"] for result in results)
    errors = np.array([np.abs(position - reference).max() for position in places])
    work = np.array([result.work["force_evaluations"] for result in results])
    assert (np.diff(errors) < 0).all()
    assert (np.diff(work) > 0).all()
    assert errors[-1] < errors[0] / 30


def test_near_field_in_equilibrium_exerts_no_force_at_the_start():
    (field,) = near_fields("equilibrium")
    assert field.alpha1 / SPACING**field.beta1 == pytest.approx(field.alpha2 / SPACING**field.beta2)
