"""The critical time step of contacts, known before a run from masses, stiffness and the speed of impact.

Two grains in contact oscillate with the angular frequency omega = sqrt(S / m*). S is the slope of the force
at the deepest overlap of an impact, and m* the reduced mass. A leapfrog is stable at steps below 2 / omega.
For Hertz's contact this limit is 1/2.01 of the duration of an impact.

Source: P. A. Cundall, O. D. L. Strack, Geotechnique 29 (1979) 47; C. O'Sullivan, J. D. Bray, Eng. Comput. 21
(2004) 278.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Mapping

import numpy as np

from tisim.effects.base.effect import LONGEST_PART

SLIDING = 3.5
"""m* over the effective mass at the surfaces of two solid spheres that slide and therefore also rotate."""
LEAST_OVERLAP = 1e-3
"""The stiffness is evaluated at this overlap over R* or above, a typical overlap of grains at rest under
load."""
OVERLAPS = np.geomspace(1e-9, 1.0, 512)
"""Overlaps over R* at which forces are evaluated."""


def critical_step(stiffness: float, mass: float) -> float:
    """Return 2/omega (s) of a spring (N/m) and a reduced mass (kg); infinity without a spring."""
    return 2.0 * math.sqrt(mass / stiffness) if stiffness > 0 else math.inf


def elastic_contact(accuracy: float) -> float:
    """Return the longest step over the critical step at which lossless impacts return their energy to a
    relative accuracy. The measured error was at most 0.15 of the square of this ratio
    (tests/hard/test_default_stepper.py); 0.25 is assumed."""
    return min(math.sqrt(accuracy / 0.25), LONGEST_PART)


def lagging_contact(accuracy: float) -> float:
    """Return the same for impacts with damping or friction, whose velocities are half a step old: the
    measured error of the coefficient of restitution was at most 0.08 of the step over the critical step."""
    return min(accuracy / 0.1, elastic_contact(accuracy))


def adhesive_contact(accuracy: float) -> float:
    """Return the same for grains that attract each other in full as soon as they touch. The measured error of
    the energy of an impact was at most 2.5 times the square of the step over the critical step, times that
    energy or the energy of adhesion."""
    return min(math.sqrt(accuracy / 2.5), elastic_contact(accuracy))


def impact_stiffness(
    push: Callable[[np.ndarray], np.ndarray], mass: float, radius: float, speed: float
) -> float:
    """Return the largest slope (N/m) of a contact force during an impact.

    push : the force (N) at an array of overlaps (m); it may be attractive at first. mass : m* (kg). radius :
    R* (m). speed : approach speed (m/s).
    """
    overlap = radius * OVERLAPS
    force = push(overlap)
    if not np.isfinite(force).all():
        # The law does not define its force.
        return math.inf
    steps, means = np.diff(overlap, prepend=0.0), 0.5 * (force + np.append(0.0, force[:-1]))
    work = np.cumsum(steps * means)
    stopped = np.flatnonzero(work >= 0.5 * mass * speed * speed)
    deepest = max(int(stopped[0]) if len(stopped) else len(overlap) - 1, _least())
    return float(np.gradient(force, overlap)[: deepest + 1].max())


def _least() -> int:
    return int(np.searchsorted(OVERLAPS, LEAST_OVERLAP))


def smallest_grains(start: Mapping[str, np.ndarray]) -> Iterator[tuple[int, float, float]]:
    """Yield material, mass (kg) and radius (m) of the lightest and of the smallest grain of each material:
    contacts of these have the highest frequencies."""
    mass, radius = start["mass"], start["radius"]
    material = start.get("material", np.zeros(len(mass), int))
    for index in np.unique(material):
        own = np.flatnonzero(material == index)
        for i in {int(own[np.argmin(mass[own])]), int(own[np.argmin(radius[own])])}:
            yield int(index), float(mass[i]), float(radius[i])
