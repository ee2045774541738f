"""The rule by which all commands resume or begin anew."""

from pathlib import Path

import pytest

from tisim import InputError
from tisim.files.output_folder import resume_hint, resumes

LEFT, KEPT = "one that an interrupted run has left", r"without a finished run \(or give --overwrite\)"
BOTH = "--overwrite must be given without --resume"


@pytest.mark.parametrize(
    ("begun", "results", "without", "fresh", "resume", "overwrite"),
    [
        # Outcomes without options, with --fresh, with --resume and with --overwrite.
        (False, "", False, False, LEFT, False),
        (True, "", True, False, True, False),
        (True, "a finished run", True, KEPT, True, False),
        (False, "a finished run", KEPT, KEPT, LEFT, False),
    ],
)
def test_options_and_existing_files_decide_about_resuming(begun, results, without, fresh, resume, overwrite):
    for options, expected in (
        ((None, False), without),
        ((True, False), fresh),
        ((False, False), resume),
        ((None, True), overwrite),
        ((True, True), overwrite),
        ((False, True), BOTH),
    ):
        arguments = (Path("out"), "run", begun, results, *options)
        if isinstance(expected, bool):
            assert resumes(*arguments) is expected, options
        else:
            with pytest.raises(InputError, match=expected):
                resumes(*arguments)


def test_the_hint_to_resume_leaves_out_options_that_begin_anew():
    assert resume_hint(None, False) == "To go on, give the same command again."
    assert resume_hint(True, True) == (
        "To go on, give the same command again, without --fresh and --overwrite."
    )
    assert resume_hint(None, True, "make room and ") == (
        "To go on, make room and give the same command again, without --overwrite."
    )
