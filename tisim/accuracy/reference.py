"""The true value of a quantity: in closed form, or from a much more accurate run that is checked by others.

The reference uses the stepper of highest order; among steppers of equal order, the scene's own. It is set to
an error two decades below the finest setting of the sweep, together with all other convergent accuracy
parameters. Its error is estimated as its distance from the same stepper at a setting one decade coarser,
which overestimates the error by a factor of about nine. A stepper of another kind, at the same two settings,
must agree with it within the uncertainties of both; if it does not, the distance between them is taken as the
error. A second stepper alone is not a sufficient check: for a rotation, the trapezoidal rule and Boris'
stepper make the same error.
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
"""A reference with a larger error than this, relative to the size of the motion, cannot tell settings
apart."""
ADVICE = (
    "paths are chaotic, or hard to resolve. Use a shorter duration, or a quantity averaged over many random "
    "starts (docs/accuracy.md)"
)
"""Advice that is given if the reference cannot tell settings apart."""
TIGHTER = 2.0
"""Decades of error between the finest setting of the sweep and the reference."""


@dataclass(frozen=True)
class Truth:
    """The best estimate of the true value of a quantity.

    source : origin of the value, as text.
    size : the value to which errors are relative, in the unit of the quantity.
    """

    estimate: QuantityEstimate
    source: str
    size: float

    @property
    def error(self) -> float:
        """An upper bound of the relative error of the true value."""
        return self.estimate.uncertainty / self.size


@dataclass(frozen=True)
class ReferenceRun:
    """A run that contributes to a truth: a method set to an error larger by a number of decades."""

    method: SettingSweep
    decades: float

    @property
    def scene(self) -> Scene:
        """The scene that is run."""
        return finest(self.method.at(self.decades), -TIGHTER)

    @property
    def name(self) -> str:
        """The stepper and its step control, as text."""
        stepper = self.method.base.stepper
        return f"{type(stepper).__name__}, {type(stepper.control).__name__}"


def attempts(methods: Sequence[SettingSweep], level: float) -> list[ReferenceRun]:
    """Return the reference, the same method one decade coarser, and another stepper at both settings if there
    is one.

    level : decades of error at the finest settings of the methods. InputError if no method converges.
    """
    able = [m for m in methods if m.converges and all(s.numbers == USUAL_NUMBERS for s in m.settings)]
    must(bool(able), "stepper", "one with an error that vanishes with an accuracy parameter", Words("none"))
    best = max(able, key=lambda method: method.base.stepper.order)
    others = [
        m for m in able if type(m.base.stepper) is not type(best.base.stepper) and m.base.stepper.order > 1
    ]
    tight = level - TIGHTER
    return [ReferenceRun(m, level) for m in (best, *others[:1]) for level in (tight, tight + 1)]


def closed_form(quantity: Quantity, result: Result, largest: float = 0.0) -> Truth:
    """Return the truth in closed form for the scene of a result. largest : largest |value| during the run."""
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
    """Return the truth from the runs of a reference and its checks. largest : largest |value| during the
    run."""
    best, short, *other = (estimate(quantity, results) for results in runs)
    off = _distance(best, short)
    if other:
        apart = _distance(best, other[0])
        off = off if apart <= off + _distance(*other) else apart
    source = f"{references[0].name} at {references[0].decades:+g} decades of error, checked by itself"
    source += "".join(f" and by {attempt.name}" for attempt in references[2:3])
    # The sum of the error of the stepper and the uncertainty from the finite number of starts.
    return _truth(quantity, QuantityEstimate(best.value, off + best.uncertainty), source, largest)


def tells_apart(quantity: Quantity, truth: Truth) -> bool:
    """Return whether errors relative to the truth of a quantity can tell settings apart.

    They cannot if the error of the reference is a large fraction of the size of the motion. The uncertainty
    from a finite number of random starts does not count as an error of the reference, because the number of
    starts is itself a setting.
    """
    return quantity.random or truth.error <= LARGEST_REFERENCE_ERROR


def _truth(quantity: Quantity, estimated: QuantityEstimate, source: str, largest: float) -> Truth:
    """Return a truth; InputError if its size is zero, so that no relative error exists."""
    size = float(np.linalg.norm(estimated.value))
    if quantity.returns:
        size = max(size, largest)
    when = "at some time" if quantity.returns else "at the end"
    must(size > 0, quantity.name, f"other than zero {when}", size)
    return Truth(estimated, source, size)


def _distance(one: QuantityEstimate, other: QuantityEstimate) -> float:
    return float(np.linalg.norm(one.value - other.value))
