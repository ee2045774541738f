"""Results of runs, of which none has failed."""

from types import SimpleNamespace

import pytest

from cases.runs import sound
from tisim import RunError
from tisim.engine.result import Status


def result_with(*status):
    return SimpleNamespace(scene=SimpleNamespace(name="a scene"), status=Status(*status))


def test_results_are_of_worlds_that_end_or_go_on():
    fine = [result_with(True, "as made"), result_with(False, "running")]
    assert sound(fine) == fine
    with pytest.raises(RunError, match="a scene: a force is not a number"):
        sound([*fine, result_with(False, "a force is not a number")])
