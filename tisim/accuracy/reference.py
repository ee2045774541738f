"""The true value of a quantity: in closed form, or by a run much tighter, checked by others.

The reference is the stepper of highest order, the scene's own among equals, turned to errors two decades
below the finest of the sweep, and with it whatever else converges. It is checked by itself a decade short of
that, and by a stepper of another kind turned as far, where there is one. The largest distance of the checks
is taken for the error of the reference. Another stepper alone would not do: on a rotation the trapezoidal
rule and Boris' stepper make the same error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tisim.accuracy.methods import Method, finest
from tisim.accuracy.quantity import Estimate, Quantity, estimate
from tisim.errors import must
from tisim.result import Result
from tisim.scene import Scene

TIGHTER = 2.0
"""Decades between the finest setting of the sweep and the reference."""


@dataclass(frozen=True)
class Truth:
    """Of a quantity; ``source`` says where it is from."""

    estimate: Estimate
    source: str

    @property
    def error(self) -> float:
        """Bound of its own relative error."""
        return self.estimate.uncertainty / float(np.linalg.norm(self.estimate.value))


@dataclass(frozen=True)
class Attempt:
    """A run that a truth is made of: a method, and the decades of error that it is turned by."""

    method: Method
    decades: float

    @property
    def scene(self) -> Scene:
        """What is run."""
        return finest(self.method.at(self.decades), -TIGHTER)

    @property
    def name(self) -> str:
        """For people."""
        stepper = self.method.base.stepper
        return f"{type(stepper).__name__}, {type(stepper.control).__name__}"


def attempts(methods: Sequence[Method], level: float) -> list[Attempt]:
    """The reference and then its checks, for methods whose finest setting is at this level.

    InputError when no method converges.
    """
    able = [m for m in methods if m.converges and all(s.precision == "f64" for s in m.settings)]
    must(bool(able), "stepper", "one with a knob that its error vanishes with", "none")
    best = max(able, key=lambda method: method.base.stepper.order)
    others = [
        m for m in able if type(m.base.stepper) is not type(best.base.stepper) and m.base.stepper.order > 1
    ]
    tight = level - TIGHTER
    return [Attempt(best, tight), Attempt(best, tight + 1), *(Attempt(m, tight) for m in others[:1])]


def closed_form(quantity: Quantity, result: Result) -> Truth:
    """For the scene of a result."""
    assert quantity.exact is not None
    return Truth(Estimate(np.ravel(np.asarray(quantity.exact(result)))), "its closed form")


def compared(quantity: Quantity, runs: Sequence[Sequence[Result]], made: Sequence[Attempt]) -> Truth:
    """The truth from the runs of a reference and its checks."""
    best, *others = (estimate(quantity, results) for results in runs)
    apart = max(float(np.linalg.norm(other.value - best.value)) for other in others)
    source = f"{made[0].name} at {made[0].decades:+g} decades of error, checked by itself"
    source += "".join(f" and by {attempt.name}" for attempt in made[2:])
    return Truth(Estimate(best.value, max(apart, best.uncertainty)), source)
