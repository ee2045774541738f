"""The true value of a quantity: in closed form, or by a run much tighter, checked by others.

The reference is the stepper of highest order, the scene's own among equals, turned to errors two decades
below the finest of the sweep, and with it whatever else converges. Its own error is taken to be its distance
from the same a decade short of that, some nine times as much as it should be. A stepper of another kind,
turned to the same two settings, must agree with it within what both are uncertain; where it does not, their
distance counts. Another stepper alone would not do: on a rotation the trapezoidal rule and Boris' stepper
make the same error.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tisim.accuracy.quantity import Quantity, QuantityEstimate, estimate
from tisim.accuracy.scene_parts import finest
from tisim.accuracy.sweep import USUAL_NUMBERS, SettingSweep
from tisim.engine.result import Result
from tisim.errors import Words, must
from tisim.scene.scene import Scene

LARGEST_REFERENCE_ERROR = 0.1
"""A reference whose own error, over the size of the motion, is above this does not tell settings apart."""
ADVICE = (
    "paths are chaotic, or hard to resolve. A shorter duration may do; or ask for a quantity of many random "
    "starts (docs/accuracy.md)"
)
"""What to do where the reference does not tell settings apart."""
TIGHTER = 2.0
"""Decades between the finest setting of the sweep and the reference."""


@dataclass(frozen=True)
class Truth:
    """The true value of a quantity, as well as it is known.

    source : where it is from, for people. size : what errors are relative to, in the unit of the quantity.
    """

    estimate: QuantityEstimate
    source: str
    size: float

    @property
    def error(self) -> float:
        """A bound of the relative error of the true value itself."""
        return self.estimate.uncertainty / self.size


@dataclass(frozen=True)
class ReferenceRun:
    """A run that a truth is made of: with a method that is turned by so many decades of error."""

    method: SettingSweep
    decades: float

    @property
    def scene(self) -> Scene:
        """The scene that is run."""
        return finest(self.method.at(self.decades), -TIGHTER)

    @property
    def name(self) -> str:
        """The stepper and its step control, for people."""
        stepper = self.method.base.stepper
        return f"{type(stepper).__name__}, {type(stepper.control).__name__}"


def attempts(methods: Sequence[SettingSweep], level: float) -> list[ReferenceRun]:
    """Return the runs of the reference, of itself a decade short, and of another stepper at both, where there
    is one.

    level : that of the finest settings of the methods. InputError when none of them converges.
    """
    able = [m for m in methods if m.converges and all(s.numbers == USUAL_NUMBERS for s in m.settings)]
    must(bool(able), "stepper", "one with an accuracy parameter that its error vanishes with", Words("none"))
    best = max(able, key=lambda method: method.base.stepper.order)
    others = [
        m for m in able if type(m.base.stepper) is not type(best.base.stepper) and m.base.stepper.order > 1
    ]
    tight = level - TIGHTER
    return [ReferenceRun(m, level) for m in (best, *others[:1]) for level in (tight, tight + 1)]


def closed_form(quantity: Quantity, result: Result, largest: float = 0.0) -> Truth:
    """Return the truth, in closed form, for the scene of a result. largest : |value| on the way."""
    assert quantity.exact is not None
    return _truth(
        quantity, QuantityEstimate(np.ravel(np.asarray(quantity.exact(result)))), "its closed form", largest
    )


def compared(
    quantity: Quantity,
    runs: Sequence[Sequence[Result]],
    references: Sequence[ReferenceRun],
    largest: float = 0.0,
) -> Truth:
    """Return the truth from the runs of a reference and its checks. largest : |value| on the way."""
    best, short, *other = (estimate(quantity, results) for results in runs)
    off = _distance(best, short)
    if other:
        apart = _distance(best, other[0])
        off = off if apart <= off + _distance(*other) else apart
    source = f"{references[0].name} at {references[0].decades:+g} decades of error, checked by itself"
    source += "".join(f" and by {attempt.name}" for attempt in references[2:3])
    # What the stepper does to every start, and what so few starts leave open.
    return _truth(quantity, QuantityEstimate(best.value, off + best.uncertainty), source, largest)


def tells_apart(quantity: Quantity, truth: Truth) -> bool:
    """Return whether errors against the truth of a quantity tell settings apart.

    They do not where the reference itself is off by a good part of the size of the motion. What is left open
    by a number of random starts is no fault of the reference: more starts are a setting like others.
    """
    return quantity.random or truth.error <= LARGEST_REFERENCE_ERROR


def _truth(quantity: Quantity, estimated: QuantityEstimate, source: str, largest: float) -> Truth:
    """Return a truth; InputError where there is nothing that an error could be relative to."""
    size = float(np.linalg.norm(estimated.value))
    if quantity.returns:
        size = max(size, largest)
    when = "at some time" if quantity.returns else "at the end"
    must(size > 0, quantity.name, f"other than zero {when}", size)
    return Truth(estimated, source, size)


def _distance(one: QuantityEstimate, other: QuantityEstimate) -> float:
    return float(np.linalg.norm(one.value - other.value))
