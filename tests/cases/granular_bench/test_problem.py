"""The calibration: measurements of a file, the misfit, and designs that are found again."""

from types import SimpleNamespace

import pytest

from cases.case import every
from cases.granular_bench import problem as calibrating
from cases.granular_bench.measured import Measurement, read
from cases.granular_bench.problem import EXAMPLE, calibration, misfit, problem
from tests.judged import check_message
from tisim import InputError

GOOD = "quantity, value, uncertainty\n\nangle_of_repose,24.5,1.0\n discharge_rate , 0.15,5e-3\n"
WRONG = {
    "no heading": ("angle_of_repose,24.5,1.0\n", "heading of .* must be quantity,value,uncertainty"),
    "empty": ("", "heading of .* must be"),
    "nothing": ("quantity,value,uncertainty\n", "quantities of .* must be one or more"),
    "unknown": ("quantity,value,uncertainty\nangle_of_reposs,1,1\n", "must be one of angle_of_repose, disch"),
    "twice": ("quantity,value,uncertainty\n" + 2 * "discharge_rate,1,1\n", "must be given once"),
    "too few": ("quantity,value,uncertainty\ndischarge_rate,1\n", "a line of .* must be of three cells"),
    "no number": ("quantity,value,uncertainty\ndischarge_rate,x,1\n", "must be a value and an uncertainty"),
    "no uncertainty": ("quantity,value,uncertainty\ndischarge_rate,1,0\n", "uncertainty must be finite and"),
    "not finite": ("quantity,value,uncertainty\ndischarge_rate,nan,1\n", "value must be finite and above 0"),
}


def test_measurements_of_a_file(tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text(GOOD)
    assert read(path) == {
        "angle_of_repose": Measurement(24.5, 1.0), "discharge_rate": Measurement(0.15, 5e-3)
    }  # fmt: skip


@pytest.mark.parametrize(("text", "message"), WRONG.values(), ids=WRONG)
def test_wrong_files_are_refused(text, message, tmp_path):
    path = tmp_path / "measured.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as error_info:
        read(path)
    check_message(str(error_info.value))
    with pytest.raises(InputError, match="must be a CSV file that can be read"):
        read(tmp_path / "absent.csv")


def test_misfit_counts_in_uncertainties(monkeypatch):
    result = SimpleNamespace(measures={"passage_rate": 0.156})
    monkeypatch.setitem(calibrating.SIMULATED, "angle_of_repose", lambda result: 22.0)
    both = {"angle_of_repose": Measurement(20.0, 1.0), "discharge_rate": Measurement(0.15, 3e-3)}
    assert misfit(result, both) == pytest.approx((4 + 4) / 2)
    assert misfit(result, {"discharge_rate": both["discharge_rate"]}) == pytest.approx(4)


def test_a_bed_in_a_cup_is_not_calibrated():
    """It is no draw-down test: it has neither an angle of repose nor a discharge rate."""
    with pytest.raises(InputError, match="size must be that of a draw-down test; received 'bed'"):
        problem("bed")
    with pytest.raises(InputError, match="size must be one of default for the inverse problem"):
        every()["granular_bench"].inverse("bed", "calibrate")


def test_other_measurements_are_another_problem(tmp_path):
    """Runs that were judged by others are not used again; the scenes are the same."""
    path = tmp_path / "measured.csv"
    path.write_text(GOOD)
    case = every()["granular_bench"]
    usual, _ = case.inverse("default", None)
    own, settings = case.inverse("default", "calibrate", path)
    assert usual.identity != own.identity
    assert own.identity == calibration("default", "calibrate", path).identity
    assert usual.identity == problem().identity
    assert settings["generations"] == 8
    design = {"friction": 0.3, "rolling_friction": 0.1, "restitution": 0.5}
    assert usual.scene(design, 1).digest() == own.scene(design, 1).digest()
    assert "24.5 ± 1 degrees" in own.title
    with pytest.raises(InputError, match="--measured must be given for a case that is calibrated; received"):
        every()["vibration"].inverse("default", None, path)
    assert EXAMPLE.keys() == calibrating.SIMULATED.keys()
