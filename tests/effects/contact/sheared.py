"""Grains under Hertz and Mindlin in a box in simple shear, and their NumPy reference, whose positions are
never wrapped."""

from __future__ import annotations

import numpy as np

from tests.effects.contact.grains import HERTZ_MINDLIN
from tests.effects.contact.granular_reference import Grains, law_of
from tests.scenes import scene
from tisim import Material, ShearedBox

SIDES, RATE, DT, STEPS = np.array([1.6, 2.0, 1.8]), 3.0, 2e-4, 300
MATERIALS = {"grain": Material(young=1e5, poisson=0.25, restitution=0.6, friction=0.4)}
ALONG, ACROSS = 0, 1


def crowd(rng, n=60, rate=RATE, sides=SIDES, steps=STEPS, low=0.0, **more):
    """Grains of unlike sizes that overlap, spin and slide, in a box too small for them; many cross faces."""
    radius, place = rng.uniform(0.1, 0.3, n), rng.uniform(0, 1, (n, 3)) * sides + low
    velocity = rng.normal(size=(n, 3))
    velocity[:, ALONG] += rate * (place[:, ACROSS] - low)
    settings = {"radius": radius, "mass": 30 * radius**3, "dt": DT, "steps": steps}
    box = ShearedBox(low=(low,) * 3, high=tuple(sides + low), rate=rate)
    spin = {"spin": 5 * rng.normal(size=(n, 3))}
    settings |= {"domain": box, "materials": MATERIALS, **more}
    return scene(place, velocity, (HERTZ_MINDLIN,), quantities=spin, **settings)


def inside(box, place, velocity, time):
    """Wrap positions and velocities of the reference into the box."""
    low, high = box.bounds()
    turns = np.floor((place[:, ACROSS] - low[ACROSS]) / (high - low)[ACROSS])[:, None]
    back, jump = np.zeros(3), np.zeros(3)
    back[[ALONG, ACROSS]] = np.array([box.rate * time, 1.0]) * (high - low)[ACROSS]
    jump[ALONG] = box.rate * (high - low)[ACROSS]
    return low + np.mod(place - turns * back - low, high - low), velocity - turns * jump


class ShearedGrains(Grains):
    """The grains of a sheared crowd: each interacts with the nearest image of each other grain, at the
    image's velocity.

    lag : images are taken at their positions this time (s) ago.
    """

    def __init__(self, made, levers="contact", lag=0.0):
        start = made.particles.arrays(made.domain, made.seed)
        low, high = made.domain.bounds()
        self.sides, self.rate, self.time, self.lag = high - low, made.domain.rate, 0.0, lag
        super().__init__(
            law_of(made, levers),
            *(start[name] for name in ("position", "velocity", "spin", "radius", "mass")),
        )

    def load(self, dt):
        self.time += dt
        super().load(dt)

    def apart(self):
        gap, passing = super().apart()
        turns, length = -np.round(gap[..., ACROSS] / self.sides[ACROSS]), self.sides[ACROSS]
        gap[..., ACROSS] += turns * length
        gap[..., ALONG] += turns * self.rate * length * max(0.0, self.time - self.lag)
        passing[..., ALONG] += turns * self.rate * length
        for k in (0, 2):
            gap[..., k] -= self.sides[k] * np.round(gap[..., k] / self.sides[k])
        return gap, passing
