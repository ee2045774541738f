"""One sphere on a plane or between two, and a column of spheres: sliding, rolling, sticking and rest.

All are worlds of one structure under gravity: planes, Hertz and Mindlin contacts with friction, and rolling
resistance (``rolling_epsd``), which may be 0.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tisim import Material, Particles, Scene
from tisim.cases.common.two_spheres import hertz_force, hertz_overlap
from tisim.effects import (
    Granular,
    Gravity,
    HertzMaterial,
    MindlinForce,
    RestitutionDamping,
    RollingEPSD,
    Walls,
)
from tisim.geometry import Plane
from tisim.steppers import FixedStep, Verlet

ROLLING = Granular(
    normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce(), rolling=RollingEPSD()
)
SPHERE_RADIUS, DENSITY, SPHERE_YOUNG, SPHERE_POISSON, G = 5e-3, 2500.0, 1e7, 0.3, 9.81
"""Radius, m, density, kg/m^3, Young's modulus, Pa, Poisson's ratio, and gravity, m/s^2."""
SPHERE_MASS = DENSITY * 4 / 3 * np.pi * SPHERE_RADIUS**3
WEIGHT = SPHERE_MASS * G
SPHERE_MODULUS = SPHERE_YOUNG / (2 * (1 - SPHERE_POISSON**2))
"""E* of two equal spheres, Pa."""
MOTION_DT = 2e-5
"""Step, s."""
SPEED, FRICTION = 1.0, 0.3
"""Initial speed, m/s, and friction of a sliding sphere."""
ROLL_SPEED, ROLLING_FRICTION = 0.2, 0.05
"""Initial speed, m/s, and rolling friction of a rolling sphere."""
PRESSED = 2e-5
"""The overlap of a sphere with each of the two planes that hold it, m."""
PUSH = float(hertz_force(PRESSED, SPHERE_RADIUS, SPHERE_MODULUS))
"""The force of each of these planes, N."""
COLUMN = 10
"""Number of spheres in the column."""
SLOPES = (0.3, 0.95, 1.05, 2.0)
"""Slopes, divided by the slope above which a sphere slides, 7/2 mu."""
HOLDS = (0.98, 1.02)
"""Loads, divided by the largest load that sticking, or rolling resistance, can carry."""
FLOOR = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
SLOT = (
    ((0.0, 0.0, -SPHERE_RADIUS + PRESSED), (0.0, 0.0, 1.0)),
    ((0.0, 0.0, SPHERE_RADIUS - PRESSED), (0.0, 0.0, -1.0)),
)


@dataclass(frozen=True)
class SphereMotion:
    """A motion: positions (m), velocities (m/s), spins (rad/s), gravity (m/s^2), planes, and its duration
    (s)."""

    position: Sequence[Sequence[float]]
    duration: float
    velocity: Sequence[float] = (0.0, 0.0, 0.0)
    spin: Sequence[float] = (0.0, 0.0, 0.0)
    gravity: tuple[float, float, float] = (0.0, 0.0, -G)
    planes: tuple[tuple[tuple[float, float, float], tuple[float, float, float]], ...] = (FLOOR,)
    friction: float = FRICTION
    rolling_friction: float = 0.0
    restitution: float = 0.5

    def scene(self) -> Scene:
        """Return the motion as a scene."""
        n = len(self.position)
        return Scene(
            name="granular_bench",
            particles=Particles(
                position=np.array(self.position, float), velocity=np.tile(self.velocity, (n, 1)),
                radius=SPHERE_RADIUS, density=DENSITY, quantities={"spin": np.tile(self.spin, (n, 1))},
            ),
            materials={
                "sphere": Material(
                    young=SPHERE_YOUNG, poisson=SPHERE_POISSON, restitution=self.restitution,
                    friction=self.friction, rolling_friction=self.rolling_friction,
                )
            },
            effects=(
                ROLLING,
                Walls(planes=tuple(Plane(point=point, normal=normal) for point, normal in self.planes)),
                Gravity(acceleration=self.gravity),
            ),
            stepper=Verlet(control=FixedStep(dt=MOTION_DT)),
            duration=self.duration,
        )  # fmt: skip


def sunk(push: float = WEIGHT) -> float:
    """Return the overlap (m) of a sphere with a plane under a load (N)."""
    return float(hertz_overlap(push, SPHERE_RADIUS, SPHERE_MODULUS))


def slides() -> SphereMotion:
    """Return a sphere that slides on the floor until it rolls."""
    return SphereMotion(((0.0, 0.0, SPHERE_RADIUS - sunk()),), 2 * roll_begins(), velocity=(SPEED, 0.0, 0.0))


def roll_begins() -> float:
    """Return the time at which a rigid sliding sphere begins to roll, s: 2 v / (7 mu g)."""
    return 2 * SPEED / (7 * FRICTION * G)


def rolls() -> SphereMotion:
    """Return a sphere that rolls against a resisting couple mu_r R m g."""
    spin = (0.0, ROLL_SPEED / (SPHERE_RADIUS - sunk() / 2), 0.0)
    return SphereMotion(
        ((0.0, 0.0, SPHERE_RADIUS - sunk()),), 1.2 * stops_after(), velocity=(ROLL_SPEED, 0.0, 0.0),
        spin=spin, rolling_friction=ROLLING_FRICTION,
    )  # fmt: skip


def stops_after() -> float:
    """Return the time at which a rigid rolling sphere has stopped, s; its deceleration is 5/7 mu_r g."""
    return 7 * ROLL_SPEED / (5 * ROLLING_FRICTION * G)


def on_slope(tangent: float, rolling_friction: float = 0.0, duration: float = 0.1) -> SphereMotion:
    """Return a sphere that is released on a slope."""
    cosine = 1 / np.hypot(1, tangent)
    gravity = (G * tangent * cosine, 0.0, -G * cosine)
    return SphereMotion(
        ((0.0, 0.0, SPHERE_RADIUS - sunk(WEIGHT * cosine)),), duration, gravity=gravity,
        rolling_friction=rolling_friction,
    )  # fmt: skip


def held(part: float, duration: float = 0.1) -> SphereMotion:
    """Return a sphere between two planes that is pulled along them with a fraction of 2 mu N."""
    return SphereMotion(
        ((0.0, 0.0, 0.0),), duration, gravity=(-part * 2 * FRICTION * PUSH / SPHERE_MASS, 0.0, 0.0),
        planes=SLOT, restitution=0.3,
    )  # fmt: skip


def column() -> SphereMotion:
    """Return spheres on top of each other that just touch at the start."""
    return SphereMotion(
        [(0.0, 0.0, (2 * k + 1) * SPHERE_RADIUS) for k in range(COLUMN)], 1.2, restitution=0.1
    )


def column_height() -> float:
    """Return the height (m) of the top sphere's centre in a column at rest, with overlaps by Hertz."""
    depths = [sunk(COLUMN * WEIGHT)]
    depths += [
        float(hertz_overlap((COLUMN - k) * WEIGHT, SPHERE_RADIUS / 2, SPHERE_MODULUS))
        for k in range(1, COLUMN)
    ]
    return (2 * COLUMN - 1) * SPHERE_RADIUS - sum(depths)
