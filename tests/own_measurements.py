"""Files of measurements for the calibration of a case: refused ones, and those that make another problem."""

import os

import pytest

from tests.judged import check_message
from tisim import InputError
from tisim.cases.case import every

ANGLES = "quantity,value,uncertainty\n"
WRONG_ANGLES = {
    "empty": ("", "heading of .* must be"),
    "nothing": (ANGLES, "quantities of .* must be one or more"),
    "unknown": (ANGLES + "angle_of_reposs,1,1\n", "must be one of angle_of_repose"),
    "twice": (ANGLES + 2 * "angle_of_repose,1,1\n", "must be given once"),
    "too few": (ANGLES + "angle_of_repose,1\n", "a line of .* must be of three cells"),
    "no number": (ANGLES + "angle_of_repose,x,1\n", "must be a value and an uncertainty"),
    "no uncertainty": (ANGLES + "angle_of_repose,1,0\n", "uncertainty must be finite and"),
    "not finite": (ANGLES + "angle_of_repose,nan,1\n", "value must be finite and above 0"),
}
"""Invalid files for a calibration to an angle of repose, and the error message for each."""


def check_refused(read, text, message, folder):
    """Check that a file with this text, and an absent file, are refused with such messages."""
    path = folder / "mine.csv"
    path.write_text(text)
    with pytest.raises(InputError, match=message) as error_info:
        read(path)
    check_message(str(error_info.value))
    with pytest.raises(InputError, match="must be a CSV file that can be read"):
        read(folder / "absent.csv")
    if hasattr(os, "mkfifo"):
        # Opening a fifo would wait for a writer for ever.
        os.mkfifo(folder / "fifo.csv")
        with pytest.raises(InputError, match="must be a CSV file that can be read; received a fifo"):
            read(folder / "fifo.csv")


def check_another_problem(name, text, calibration, design, folder):
    """Check that runs judged by other measurements are not reused, although the scenes are the same. Returns
    the default problem, the problem of the file, and a scene of a design."""
    path = folder / "mine.csv"
    path.write_text(text)
    case = every()[name]
    usual, _ = case.inverse("default", None)
    own, _ = case.inverse("default", "calibrate", path)
    assert usual.identity != own.identity
    assert own.identity == calibration("default", "calibrate", path).identity
    assert usual.identity == case.problem("default", "calibrate").identity
    scene = usual.scene(design, 1)
    assert scene.digest() == own.scene(design, 1).digest()
    return usual, own, scene
