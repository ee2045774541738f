"""Calibration to an angle of repose, and to a slope profile of any size."""

from types import SimpleNamespace

import numpy as np
import pytest

import tisim
from tests.cases.avalanche.slopes import leaning
from tests.own_measurements import WRONG_ANGLES, check_another_problem, check_refused
from tisim import InputError, optimize
from tisim.cases.avalanche.measures import profile, repose
from tisim.cases.avalanche.problem import (
    EXAMPLE,
    KNOWN,
    MeasuredProfile,
    area,
    calibration,
    measured,
    other_runs,
    read,
    simulated,
)
from tisim.cases.case import every
from tisim.cases.common.csv_tables import Measurement
from tisim.optimize import Misfit
from tisim.optimize.tables import met_columns

HEADING = "distance,height,uncertainty\n"
WRONG = WRONG_ANGLES | {
    "no heading": ("0,1,1\n", "heading of .* must be quantity,value,uncertainty or distance,height,uncertai"),
    "other quantity": ("quantity,value,uncertainty\ndischarge_rate,1,1\n", "must be one of angle_of_repose"),
    "too few points": (HEADING + "0,1,1\n1,0,1\n", "profile must be of 4 points or more; received 2"),
    "no height": (HEADING + "0,1,1\n1,x,1\n", "must be of numbers below its heading"),
    "falls back": (HEADING + "0,3,1\n1,2,1\n1,1,1\n2,0,1\n", "distance must be rising"),
    "flat": (
        HEADING + "0,0,1\n1,0,1\n2,0,1\n3,0,1\n",
        "height must be finite and not below 0, with some",
    ),
    "too sure": (HEADING + "0,3,1\n1,2,1\n2,1,0\n3,0,1\n", "uncertainty must be finite and above 0"),
}


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG)
def test_wrong_files_are_refused(text, message, tmp_path):
    check_refused(read, text, message, tmp_path)


def test_an_angle_is_met_in_uncertainties(tmp_path):
    path = tmp_path / "mine.csv"
    path.write_text("quantity,value,uncertainty\nangle_of_repose,41,2\n")
    target = read(path)
    assert target == Measurement(41.0, 2.0)
    result = SimpleNamespace(state=leaning(16, 1))
    assert misfit(result, target) == pytest.approx(((repose(result.state) - 41) / 2) ** 2)


def misfit(result, target):
    return Misfit(measured(target)).value([list(simulated(result, target).values())])


def off(target, place, height):
    return Misfit(measured(target)).value([list(target.compared(place, height).values())])


def triangle(top, foot, uncertainty):
    """A measured profile of a straight slope, of 9 points and one beyond its foot."""
    place = np.append(np.linspace(0, foot, 9), 1.2 * foot)
    return MeasuredProfile(place, np.maximum(top * (1 - place / foot), 0.0), np.full(10, uncertainty))


def test_a_profile_is_met_by_the_same_slope_of_any_size():
    place = np.linspace(0.0, 2.0, 201)
    height = np.maximum(1.5 - place, 0.0)
    assert area(place, height) == pytest.approx(1.125, rel=1e-3)
    for size in (1.0, 30.0):
        assert off(triangle(1.5 * size, 1.5 * size, 0.01 * size), place, height) < 0.01
    # The misfit of a flatter slope is in its heights: 1.5 - 1.5 / sqrt(1.5) at the end of the cell.
    flatter = triangle(1.5, 1.5 * 1.5, 0.1)
    gap = flatter.height - np.maximum(1.5 * 1.5**0.5 - flatter.distance, 0.0)
    assert off(flatter, place, height) == pytest.approx(float(((gap / 0.1) ** 2).mean()), rel=0.02)


def test_a_profile_distinguishes_slopes():
    """The misfit to its own profile is zero, and to a steeper slope it is large."""
    place, height = profile(leaning(16, 2))
    target = MeasuredProfile(place, height, np.full(len(place), 1e-3))
    same, steep = (misfit(SimpleNamespace(state=leaning(16, run)), target) for run in (2, 1))
    assert same == pytest.approx(0.0, abs=1e-12)
    assert steep > 10


def test_other_measurements_are_another_problem(tmp_path):
    text = HEADING + "0,5,1\n4,3,1\n8,1,1\n12,0,1\n"
    design = {"friction": 0.3, "rolling_friction": 0.1, "cohesion": 50.0}
    _, own, scene = check_another_problem("avalanche", text, calibration, design, tmp_path)
    assert scene.materials["iron"].cohesion_energy_density == 50.0
    assert "magnetic_field" not in {effect.label for effect in scene.effects}
    assert "a measured profile" in own.title
    case = every()["avalanche"]
    assert case.sizes["default"].search["generations"] == 6
    with pytest.raises(InputError, match="size must be one of default for the inverse problem"):
        case.inverse("l21", "calibrate")


@pytest.mark.slow
def test_a_known_design_is_met():
    """The best design has the angle of the known design, also from starts that the search has not used.

    One angle does not determine three parameters: designs with this angle are far from each other."""
    case = every()["avalanche"]
    problem, search = case.inverse("default", "calibrate")
    outcome = optimize.run(problem, **search)
    frictions = met_columns(outcome.problem, outcome.estimates, outcome.limits)["friction"]
    assert len(frictions) > 5
    assert max(frictions) - min(frictions) > 0.3
    for design in (KNOWN, outcome.designs[0].genes):
        results = tisim.run(other_runs(design, "default", 8))
        assert all(result.status.ok for result in results)
        angles = [repose(result.state) for result in results]
        assert EXAMPLE.misfit(float(np.mean(angles))) < 1.0
        assert np.std(angles, ddof=1) < 1.5 * EXAMPLE.uncertainty
