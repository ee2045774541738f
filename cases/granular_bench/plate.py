"""Two tests of single grains on a plate beside the silo, of the same material: a falling and a pulled grain.

The first grain begins at the plate with the speed of a fall and rebounds; the height of its rebound depends
on the restitution. The second lies on the plate and is pulled over it without rotation, as a block of glued
grains slides. The ratio of the forces along and normal to the plate is the tangent of the angle at which such
a block begins to slide, because Coulomb's law here has one coefficient. Both grains stay away from the grains
of the silo and add no computing time.
"""

from collections.abc import Mapping
from typing import Any

import numpy as np
from scipy.constants import g as STANDARD_GRAVITY

from tisim import Particles, Result, Scene
from tisim.cases.granular_bench.scene import DENSITY, DIAMETER, NATURAL, scene
from tisim.effects import PrescribedMotion, Translation, Walls
from tisim.geometry import Disc
from tisim.operators import PeakHeight

FALL = 1.0
"""The initial speed of the first grain at the plate, m/s: the speed of a fall from 51 mm."""
DRAWN, DROPPED = 1, 2
"""The groups of the pulled grain and of the falling grain."""
ASIDE, PLATE_RADIUS = 20.0, 15.0
"""Distance of the plate's centre from the silo or the disc, and radius of the plate, in diameters."""
WAY, FROM_MIDDLE = 20.0, 5.0
"""Distance over which the second grain is pulled, and distance of each grain from the middle of the plate, in
diameters."""
PRESSED_PART = 0.01
"""Overlap of the second grain with the plate, as a fraction of its radius."""


def scene_with_plate(design: Mapping[str, float] = NATURAL, seed: int = 0, **settings: Any) -> Scene:
    """Return a draw-down test with a plate beside it; the arguments are the same as for ``scene``."""
    test = scene(design, seed, **settings)
    walls = next(one for one in test.effects if isinstance(one, Walls))
    d, radius = DIAMETER, DIAMETER / 2
    across = max(walls.cylinders[0].radius, walls.discs[0].radius) + ASIDE * d
    plate = Disc(centre=(across, 0.0, 0.0), radius=PLATE_RADIUS * d)
    grains = test.particles.arrays(test.domain, seed)
    drawn = (across - WAY / 2 * d, FROM_MIDDLE * d, (1 - PRESSED_PART) * radius)
    dropped = (across, -FROM_MIDDLE * d, radius)
    number, mass = len(grains["radius"]), DENSITY * np.pi / 6 * d**3
    particles = Particles(
        position=np.vstack([grains["position"], drawn, dropped]),
        velocity=np.vstack([grains["velocity"], (0.0, 0.0, 0.0), (0.0, 0.0, -FALL)]),
        radius=np.append(grains["radius"], [radius, radius]),
        mass=np.append(grains["mass"], [mass, mass]),
        quantities={"group": np.append(np.zeros(number), [DRAWN, DROPPED])},
    )
    motion = Translation(velocity=(WAY * d / test.duration, 0.0, 0.0))
    return Scene(
        name=test.name,
        particles=particles,
        materials=test.materials,
        effects=(
            *(
                walls.model_copy(update={"discs": (*walls.discs, plate)}) if one is walls else one
                for one in test.effects
            ),
            PrescribedMotion(name="drawn", group=DRAWN, motion=motion),
            PeakHeight(),
        ),
        stepper=test.stepper,
        duration=test.duration,
        seed=seed,
    )


def rebound(result: Result) -> float:
    """Return the height of the rebound divided by the height of the fall."""
    (height,) = result.state["peak_height"][result.state["group"] == DROPPED]
    return float(height / (FALL**2 / (2 * STANDARD_GRAVITY)))


def sliding(result: Result) -> float:
    """Return the angle (degrees) at which a block slides.

    Its tangent is the ratio of the resisting force and the normal force of the pulled grain.
    """
    (mass,) = result.state["mass"][result.state["group"] == DRAWN]
    measures = result.measures
    presses = measures["drawn_force_z"] + mass * STANDARD_GRAVITY
    return float(np.degrees(np.arctan2(-measures["drawn_force_x"], presses)))
