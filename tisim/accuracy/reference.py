"""The true value of a quantity: in closed form, or by a run much tighter, checked by another.

The reference is the stepper of highest order, the scene's own among equals, turned to errors two decades
below the finest of the sweep, and with it whatever else converges. The check is a stepper of another kind,
turned as far, or the same one a decade short of it where no other suits. How far the two are apart bounds the
error of the better one, and is taken for that of the reference.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tisim.accuracy.methods import Method, finest
from tisim.accuracy.quantity import Estimate, Quantity, estimate
from tisim.errors import InputError
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


def closed_form(quantity: Quantity, result: Result) -> Truth:
    """For the scene of a result."""
    assert quantity.exact is not None
    return Truth(Estimate(np.ravel(np.asarray(quantity.exact(result)))), "closed form")


@dataclass(frozen=True)
class Pair:
    """A reference and its check: a method and a scene each."""

    methods: tuple[Method, Method]
    scenes: tuple[Scene, Scene]


def pair(methods: Sequence[Method], level: float) -> Pair:
    """Chosen among methods whose finest setting is at this level; InputError when nothing converges."""
    able = [m for m in methods if m.converges and all(s.precision == "f64" for s in m.settings)]
    if not able:
        raise InputError("stepper must have a knob that its error vanishes with; received none")
    able.sort(key=lambda m: -m.base.stepper.order)
    best = able[0]
    others = [m for m in able if type(m.base.stepper) is not type(best.base.stepper)]
    others = [m for m in others if m.base.stepper.order > 1] or [best]
    short = 1.0 if others[0] is best else 0.0
    scenes = (
        finest(best.at(level - TIGHTER), -TIGHTER),
        finest(others[0].at(level - TIGHTER + short), -TIGHTER),
    )
    return Pair((best, others[0]), scenes)


def compared(quantity: Quantity, reference: Sequence[Result], check: Sequence[Result], found: Pair) -> Truth:
    """The truth from the runs of a reference and its check."""
    value, other = estimate(quantity, reference), estimate(quantity, check)
    apart = float(np.linalg.norm(value.value - other.value))
    names = [f"{m.base.stepper.kind()}, {m.base.stepper.control.kind()}" for m in found.methods]
    source = f"{names[0]}, {TIGHTER:g} decades tighter; checked by {names[1]}"
    return Truth(Estimate(value.value, max(apart, value.uncertainty)), source)
