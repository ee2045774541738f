"""Hints that parts of a scene give to ``tisim cost`` only.

A part without hints runs as well, but it is not varied in a cost study.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

from pydantic import BaseModel

from tisim.components.accuracy_parameter import AccuracyParameter


class AccuracyHints(BaseModel):
    """Hints that any part of a scene may give.

    accuracy_parameters : settings that trade accuracy for time.
    softening : properties of materials that may be lowered to allow longer steps. Each value is the power of
        the property by which the duration of an impact at a given speed decreases: {"young": 0.4} for a
        duration proportional to E^-0.4. At a given load the dependence may be weaker: the overlap in Hertz's
        law is proportional to E^-2/3, so the stiffness of a contact at rest is proportional to E^(2/3) and
        its oscillation period to E^-1/3. All other constants are unchanged. For example, a cohesion has more
        effect on softer grains, and the spring of a bond may be too stiff for the longer steps; such effects
        are part of the measured error.
    """

    accuracy_parameters: ClassVar[tuple[AccuracyParameter, ...]] = ()
    softening: ClassVar[Mapping[str, float]] = {}


class LawHints(AccuracyHints):
    """Hints that an effect may give.

    smooth : whether its forces have derivatives of all orders along the trajectory; otherwise steppers of
        high order, and steps that follow the error, gain nothing.
    """

    smooth: ClassVar[bool] = True

    def approximations(self, extent: float) -> tuple[Any, ...]:
        """Return cheaper laws to try in place of this one, the coarsest first, for particles up to ``extent``
        (m) apart; by default none."""
        return ()


class StepperHints(AccuracyHints):
    """Hints that a stepper may give."""

    @classmethod
    def alternatives(cls, effects: Sequence[Any], dt: float) -> tuple[Self, ...]:
        """Return the steppers of this class to try in a scene with these effects and steps of about dt (s);
        by default none."""
        return ()

    def rivals(self, effects: Sequence[Any], dt: float) -> tuple[Any, ...] | None:
        """Return the steppers to compare with this one; None, the default, for the alternatives of every
        class."""
        return None

    def evaluations(self, work: Mapping[str, int], particles: int, independent: bool) -> float:
        """Return the number of force evaluations per particle, averaged over particles, from the counts of a
        run; by default one per step."""
        return work["particle_steps"] / particles
