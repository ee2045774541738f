"""Every number of every effect, operator, source and stepper at the ends of what is accepted, and those of a
particle: refused before anything runs, or run to the end, or failed in words. Never a crash, a hang, or a
state that is not finite."""

from collections import Counter

import pytest

from tests import extremes
from tests.soak.running import FAILED, RAN, REFUSED, Runs
from tisim import steppers
from tisim.components import serialization
from tisim.steppers import StepControl, Stepper


@pytest.fixture(scope="module")
def runs():
    runner = Runs()
    yield runner
    runner.end()


def count_outcomes(runs, name, cases):
    """How many scenes have come to what; none of them to anything but words or numbers."""
    counts = Counter()
    for values in cases:
        column, word = runs(name, values)
        assert not column, (name, values, column, word)
        counts[word] += 1
    return counts


@pytest.mark.slow
@pytest.mark.parametrize("name", extremes.scenes())
def test_extremes_of_a_kind(runs, name):
    """One number after another; as they are, the scene runs."""
    assert count_outcomes(runs, name, [{}]) == {RAN: 1}
    counts = count_outcomes(runs, name, extremes.one_by_one(name))
    assert counts[RAN] > 0
    assert counts[REFUSED] > 0


@pytest.mark.long
def test_extremes_of_one_kind(runs):
    """A quick one of them."""
    name = "effects.stokes_drag"
    cases = [{("effects", "stokes_drag", "viscosity"): value} for value in (0.0, 2.3e-308, 1e155, 1.7e308)]
    assert count_outcomes(runs, name, cases) == {REFUSED: 1, RAN: 1, FAILED: 2}


def test_every_kind_is_there():
    """Each stepper and control of the package is in some scene; effects are taken as they are found."""
    serialization.load(steppers)
    tables = [data["stepper"] for data in extremes.scenes().values()]
    for contract, names in (
        (Stepper, {stepper["kind"] for stepper in tables}),
        (StepControl, {stepper["control"]["kind"] for stepper in tables}),
    ):
        own = {name for name, kind in contract.known().items() if kind.__module__.startswith("tisim.")}
        assert own == names
