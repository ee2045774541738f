"""Every number of every effect, operator, source, stepper and particle at the ends of its accepted range.

The scene is refused before anything runs, or runs to the end, or fails with a message. It never crashes,
hangs, or returns a state that is not finite.
"""

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
    """Return the number of scenes for each outcome; each scene must end in a message or in finite numbers."""
    counts = Counter()
    for values in cases:
        column, word = runs(name, values)
        assert not column, (name, values, column, word)
        counts[word] += 1
    return counts


@pytest.mark.slow
@pytest.mark.parametrize("name", extremes.scenes())
def test_extremes_of_a_kind(runs, name):
    """Each number is varied separately; the unchanged scene runs."""
    assert count_outcomes(runs, name, [{}]) == {RAN: 1}
    counts = count_outcomes(runs, name, extremes.one_by_one(name))
    assert counts[RAN] > 0
    assert counts[REFUSED] > 0


@pytest.mark.long
def test_extremes_of_one_kind(runs):
    """One kind with a few values, for the quick suite."""
    name = "effects.stokes_drag"
    cases = [{("effects", "stokes_drag", "viscosity"): value} for value in (0.0, 2.3e-308, 1e155, 1.7e308)]
    assert count_outcomes(runs, name, cases) == {REFUSED: 1, RAN: 1, FAILED: 2}


def test_every_kind_is_there():
    """Every stepper and control of the package is in some scene; effects are found automatically."""
    serialization.load(steppers)
    tables = [data["stepper"] for data in extremes.scenes().values()]
    for contract, names in (
        (Stepper, {stepper["kind"] for stepper in tables}),
        (StepControl, {stepper["control"]["kind"] for stepper in tables}),
    ):
        known = contract.known().items()
        own = {name for name, kind in known if kind.__module__.startswith("tisim.")}
        assert {name for name in own if not extremes.for_packings(contract.known()[name])} == names
