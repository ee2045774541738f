"""Every number of every effect, operator, source, stepper and particle at the ends of its accepted range.

The scene is refused before anything runs, or runs to the end, or fails with a message. It never crashes,
hangs, or returns a state that is not finite.
"""

from collections import Counter
from types import SimpleNamespace

import numpy as np
import pytest

from tests import extremes
from tests.judged import check_message
from tests.soak.running import FAILED, RAN, REFUSED, Runs
from tisim import InputError, Scene, steppers
from tisim.components import serialization
from tisim.effects import RigidRods
from tisim.engine.monitor import Monitor
from tisim.shapes import SpherocylinderShape
from tisim.steppers import StepControl, Stepper

SHAPED = RigidRods(rods=(SpherocylinderShape(length=1.0, diameter=1.0),))


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


def check_choice(name, cases):
    """Return the number of refused scenes that name no stepper; each must be refused in words, or get one."""
    scene = {key: value for key, value in extremes.scenes()[name].items() if key != "stepper"}
    refused = 0
    for values in cases:
        try:
            Scene.from_dict(extremes.changed(scene, values))
        except InputError as fault:
            check_message(str(fault))
            refused += 1
    return refused


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in extremes.scenes() if name.startswith("effects.")])
def test_a_stepper_is_chosen_for_extremes_of_a_kind(name):
    check_choice(name, extremes.one_by_one(name))


def test_a_stepper_is_chosen_for_a_few_extremes():
    """A critical step whose arithmetic overflows, or that is 0, is not known; a large speed makes short
    steps."""
    speed, bond = ("particles", "velocity", 0, 0), ("effects", "parallel_bond")
    cases = [{(*bond, "young"): 1.7e308}, {(*bond, "radius_ratio"): 1.7e308}, {speed: 1e155}]
    assert check_choice("effects.parallel_bond", cases) == 2
    assert (
        check_choice("effects.permanent_moment", [{("particles", "radius", 0): 1e100}, {speed: -1.7e308}])
        == 1
    )


def test_the_message_of_a_step_that_is_too_long_holds_large_speeds():
    """Their squares overflow, and the product of the largest ones and the step."""
    rows = {"velocity": [[1e200, 1e200, 0.0], [0.0, 1.0, 0.0]], "spin": [[0.0] * 3, [0.0, 1e160, 0.0]]}
    then = {name: np.array([values]) for name, values in rows.items()}
    then |= {
        "count": [2],
        "dt": [1e-3],
        "frame": np.zeros((1, 3)),
        "radius": np.array([[1.0, 2.0]]),
        "id": [[0, 1]],
    }
    world = SimpleNamespace(simulation=SimpleNamespace(scenes=[SimpleNamespace(effects=(SHAPED,))]))
    assert Monitor._outrun(world, 0, then).startswith(
        "particle 0 moves by 1.41e+197 m relative to the others"
    )
    then["velocity"][0, 0] = 0.0
    assert Monitor._outrun(world, 0, then).startswith("particle 1 moves by 2e+157 m relative to the others")


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
