"""The calibration: measurements of a file, the misfit, and a known design that is found again."""

from types import SimpleNamespace

import numpy as np
import pytest

import tisim
from tests.own_measurements import WRONG_ANGLES, check_another_problem, check_refused
from tisim import InputError, optimize
from tisim.analysis import Mean
from tisim.cases.case import every
from tisim.cases.common.csv_tables import Measurement
from tisim.cases.granular_bench import problem as calibrating
from tisim.cases.granular_bench.problem import (
    EXAMPLES,
    KNOWN,
    SIMULATED,
    UNCERTAINTIES,
    calibration,
    calibration_to,
    other_runs,
    problem,
    read,
)

INTERVALS = {"friction": 0.05, "rolling_friction": 0.05, "restitution": 0.02}
"""Largest deviation of the best design, and of the calibration's estimate, from the known design."""
GOOD = (
    "quantity, value, uncertainty\n\nangle_of_repose,24.5,1.0\n discharge_rate , 0.15,5e-3\n"
    "sliding_angle,27,1\nrebound_ratio,0.25,0.02\n"
)
WRONG = WRONG_ANGLES | {
    "no heading": ("angle_of_repose,24.5,1.0\n", "heading of .* must be quantity,value,uncertainty"),
    "no rate": ("quantity,value,uncertainty\ndischarge_rate,x,1\n", "must be a value and an uncertainty"),
}


def test_measurements_of_a_file(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text(GOOD)
    assert read(path) == {
        "angle_of_repose": Measurement(24.5, 1.0), "discharge_rate": Measurement(0.15, 5e-3),
        "sliding_angle": Measurement(27.0, 1.0), "rebound_ratio": Measurement(0.25, 0.02),
    }  # fmt: skip


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG)
def test_wrong_files_are_refused(text, message, tmp_path):
    check_refused(read, text, message, tmp_path)


def test_misfit_counts_in_uncertainties(monkeypatch):
    result = SimpleNamespace()
    monkeypatch.setitem(calibrating.SIMULATED, "angle_of_repose", lambda result: 22.0)
    monkeypatch.setitem(calibrating.SIMULATED, "discharge_rate", lambda result: 0.156)
    both = {"angle_of_repose": Measurement(20.0, 1.0), "discharge_rate": Measurement(0.15, 3e-3)}
    for measured, misfit in ((both, (4 + 4) / 2), ({"discharge_rate": both["discharge_rate"]}, 4)):
        (objective,) = calibrating.calibration_to(measured, "small").objectives
        values = objective.of(result)
        assert objective.cost([[values[name] for name in objective.quantities]]) == pytest.approx(misfit)


def test_a_bed_in_a_cup_is_not_calibrated():
    """It has neither an angle of repose nor a discharge rate, which draw-down tests have."""
    with pytest.raises(InputError, match="size must be one of default, small for the inverse problem"):
        calibration_to(EXAMPLES["small"], "bed")
    with pytest.raises(InputError, match="size must be one of default, small for the inverse problem"):
        every()["granular_bench"].inverse("bed", "calibrate")


def test_other_measurements_are_another_problem(tmp_path):
    design = {"friction": 0.3, "rolling_friction": 0.1, "restitution": 0.5}
    _, own, _ = check_another_problem("granular_bench", GOOD, calibration, design, tmp_path)
    assert "24.5 ± 1 degrees" in own.title
    assert own.title.endswith("rebound_ratio 0.25 ± 0.02")
    with pytest.raises(InputError, match="--measured must be given for a case that is calibrated; received"):
        every()["vibration"].inverse("default", None, tmp_path / "mine.csv")
    case = every()["granular_bench"]
    assert case.sizes["default"].search["max_evaluations"] == 120
    searched = [name for name, size in case.sizes.items() if size.search is not None]
    assert [*EXAMPLES] == searched
    assert all(example.keys() == SIMULATED.keys() for example in EXAMPLES.values())
    with pytest.raises(
        InputError, match="size must be one of default, small for the inverse problem; received 'bed'"
    ):
        problem("bed")


@pytest.mark.slow
def test_a_known_design_is_found_again():
    """Its measures are means over held-out starts, given in the example of the case."""
    results = tisim.run(other_runs(KNOWN, "small", 8))
    assert all(result.status.ok for result in results)
    measured = {}
    for name, measure in SIMULATED.items():
        values = np.array([measure(result) for result in results])
        mean = Mean.of(values)
        measured[name] = Measurement(mean.value, UNCERTAINTIES[name])
        assert values.std(ddof=1) < 1.5 * UNCERTAINTIES[name]
        # The example is a mean over 64 other starts.
        near = max(mean.half, 0.1 * UNCERTAINTIES[name])
        assert EXAMPLES["small"][name].value == pytest.approx(mean.value, abs=near)
    search = every()["granular_bench"].sizes["small"].search
    outcome = optimize.run(calibration_to(measured, "small"), **search)
    found = {gene.name: gene for gene in optimize.calibration(outcome).genes}
    for name, interval in INTERVALS.items():
        print(name, outcome.designs[0].genes[name], found[name])  # for docs/granular_bench.md
        assert outcome.designs[0].genes[name] == pytest.approx(KNOWN[name], abs=interval)
        assert found[name].estimate == pytest.approx(KNOWN[name], abs=interval)
        assert found[name].low <= KNOWN[name] <= found[name].high
