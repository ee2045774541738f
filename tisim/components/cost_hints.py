"""What parts of a scene say to ``tisim cost`` alone: nothing else asks for it.

A part that says nothing of this runs as well; it is only not compared.
"""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

from pydantic import BaseModel

from tisim.components.accuracy_parameter import AccuracyParameter


class AccuracyHints(BaseModel):
    """These are the hints that any part of a scene gives.

    accuracy_parameters : its settings that trade accuracy for time.
    softening : properties of materials that may be lowered for longer steps, each with the power of it that
        the time of an impact at a given speed goes by; as {"young": 0.4}, where that is as E^-0.4. Under a
        given load it may go by less: the overlap of Hertz's law goes as E^-2/3, so the stiffness of a
        contact at rest as E^(2/3), and the time in which it swings as E^-1/3. All other constants stay as
        they are, such as a cohesion, of which softer grains have more, or a spring of a bond, for which
        longer steps may be too long: what that does is part of what is measured.
    """

    accuracy_parameters: ClassVar[tuple[AccuracyParameter, ...]] = ()
    softening: ClassVar[Mapping[str, float]] = {}


class LawHints(AccuracyHints):
    """These are the hints that an effect gives.

    smooth : whether its forces have derivatives of all orders on the way, without which steppers of high
        order, and steps that follow the error, gain nothing.
    """

    smooth: ClassVar[bool] = True

    def approximations(self, extent: float) -> tuple[Any, ...]:
        """Return cheaper laws to try in its place, the coarsest first, for particles that are up to
        ``extent`` (m) apart; by default none."""
        return ()


class StepperHints(AccuracyHints):
    """These are the hints that a stepper gives."""

    @classmethod
    def alternatives(cls, effects: Sequence[Any], dt: float) -> tuple[Self, ...]:
        """Return those of this kind to try in a scene of these effects, with steps of some dt (s); by default
        none."""
        return ()

    def rivals(self, effects: Sequence[Any], dt: float) -> tuple[Any, ...] | None:
        """Return what to try beside this one; None, the default, for the alternatives of every kind."""
        return None

    def evaluations(self, work: Mapping[str, int], particles: int, independent: bool) -> float:
        """Return how often forces were summed for a particle, the mean over particles, given the counts of a
        run; one a step by default."""
        return work["particle_steps"] / particles
