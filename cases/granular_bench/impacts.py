"""Impacts of a sphere with a rigid plane or with another sphere, as in the eight tests of Chung and Ooi
(2011).

All impacts are worlds of one structure: two materials, one or two spheres, and a plane, which is far away if
two spheres collide. They approach along z, the line of centres; the observed sphere also moves along x and
spins about y. Steps are a fraction of the duration of the elastic impact by Hertz.
"""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from tisim import Material, Particles, Result, Scene, Simulation
from tisim.cases.common.runs import sound
from tisim.cases.common.two_spheres import hertz_depth, hertz_duration, reduced
from tisim.effects import Granular, HertzMaterial, MindlinForce, RestitutionDamping, Walls
from tisim.geometry import Plane
from tisim.steppers import FixedStep, Verlet

SOURCE = "Y. C. Chung and J. Y. Ooi, Granul. Matter 13 (2011) 643-656, doi 10.1007/s10035-011-0277-0"

HERTZ_MINDLIN = Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce())
STEPS = 800
"""Number of steps in the duration of an elastic impact."""
LASTS = 4
"""Simulated time in units of that duration; damped impacts take longer."""
STIFFER = 1e9
"""Ratio of Young's moduli of a rigid plane and the sphere."""


@dataclass(frozen=True)
class Substance:
    """A substance: Young's modulus (Pa), Poisson's ratio and density (kg/m^3)."""

    young: float
    poisson: float
    density: float

    @property
    def rigid_modulus(self) -> float:
        """Return E* of a sphere of this substance at a rigid plane, E / (1 - nu^2), Pa."""
        return self.young / (1 - self.poisson**2)


SUBSTANCES = {
    "glass": Substance(4.8e10, 0.20, 2800.0),
    "limestone": Substance(2.0e10, 0.25, 2500.0),
    "aluminium alloy": Substance(7.0e10, 0.30, 2699.0),
    "magnesium alloy": Substance(4.0e10, 0.35, 1800.0),
    "aluminium oxide": Substance(3.8e11, 0.23, 4000.0),
    "cast iron": Substance(1.0e11, 0.25, 7000.0),
    "aluminium alloy 2": Substance(7.0e10, 0.33, 2700.0),
    "steel": Substance(2.08e11, 0.30, 7850.0),
    "polyethylene": Substance(1.0e9, 0.40, 1400.0),
    "nylon": Substance(2.5e9, 0.40, 1000.0),
    "copper": Substance(1.2e11, 0.35, 8900.0),
}
"""Substances by name; Chung and Ooi have two alloys of aluminium, the second in test 4 and later tests."""


@dataclass(frozen=True)
class ParticleImpact:
    """An impact of a sphere of a substance and a radius (m), which approaches at a speed (m/s).

    sideways : velocity along x, m/s. spin : about y, rad/s; the surface at the contact moves by -R spin along
    x.
    partner : "plane", rigid; "equal", an equal sphere that approaches at the same speed with the same spin;
    "large" or "large rigid", a sphere at rest, five times as wide and a thousand times as dense.
    """

    substance: str
    radius: float
    speed: float
    restitution: float = 1.0
    friction: float = 0.0
    sideways: float = 0.0
    spin: float = 0.0
    partner: str = "plane"

    @property
    def other_radius(self) -> float:
        """Return the radius of the partner, m; infinite for a plane."""
        return {"plane": np.inf, "equal": self.radius}.get(self.partner, 5 * self.radius)

    @property
    def mass(self) -> float:
        """Return the mass of the sphere, kg."""
        return float(SUBSTANCES[self.substance].density * 4 / 3 * np.pi * self.radius**3)

    @property
    def mass_ratio(self) -> float:
        """Return the mass of the partner divided by the mass of the sphere; infinite for a plane."""
        return {"plane": np.inf, "equal": 1.0}.get(self.partner, 1000.0 * 5**3)

    @property
    def share(self) -> float:
        """Return m*/m."""
        return reduced(1.0, self.mass_ratio)

    @property
    def approach(self) -> float:
        """Return the speed at which the two approach, m/s."""
        return self.speed * (2 if self.partner == "equal" else 1)

    @property
    def modulus(self) -> float:
        """Return E*, Pa."""
        own = SUBSTANCES[self.substance].rigid_modulus
        return reduced(own, own * (STIFFER if self.partner in ("plane", "large rigid") else 1.0))

    @property
    def hertz(self) -> tuple[float, float, float, float]:
        """Return the arguments of Hertz's impact: the relative speed, R*, m* and E*."""
        return self.approach, reduced(self.radius, self.other_radius), self.mass * self.share, self.modulus

    @property
    def depth(self) -> float:
        """Return the largest overlap by Hertz, m."""
        return float(hertz_depth(*self.hertz))

    @property
    def duration(self) -> float:
        """Return the duration of the elastic impact by Hertz, s."""
        return float(hertz_duration(*self.hertz))

    def scene(self) -> Scene:
        """Return the impact as a scene, which begins just before the surfaces touch."""
        r, other = self.radius, self.other_radius
        substance = SUBSTANCES[self.substance]
        position, velocity, spin = [[0.0, 0.0, r]], [[self.sideways, 0.0, -self.speed]], [[0, self.spin, 0.0]]
        radius, mass, floor = [r], [self.mass], 0.0
        if self.partner != "plane":
            equal = self.partner == "equal"
            position.append([0.0, 0.0, -other])
            velocity.append([0.0, 0.0, self.speed if equal else 0.0])
            spin.append([0.0, self.spin if equal else 0.0, 0.0])
            radius.append(other)
            mass.append(self.mass * self.mass_ratio)
            floor = -1e4 * other
        rigid = self.partner in ("plane", "large rigid")
        alike = {"poisson": substance.poisson, "restitution": self.restitution, "friction": self.friction}
        return Scene(
            name="granular_bench",
            particles=Particles(
                position=np.array(position), velocity=np.array(velocity), radius=radius, mass=mass,
                material=[0, 1][: len(radius)], quantities={"spin": np.array(spin)},
            ),
            materials={
                "sphere": Material(young=substance.young, **alike),
                "partner": Material(young=substance.young * (STIFFER if rigid else 1.0), **alike),
            },
            effects=(HERTZ_MINDLIN, Walls(planes=(Plane(point=(0.0, 0.0, floor)),), material="partner")),
            stepper=Verlet(control=FixedStep(dt=self.duration / STEPS)),
            duration=LASTS * self.duration,
        )  # fmt: skip


@dataclass(frozen=True)
class Rebound:
    """The result of an impact: velocity (m/s) and spin (rad/s) of the sphere, and the velocity of its
    partner."""

    impact: ParticleImpact
    velocity: np.ndarray
    spin: np.ndarray
    other_velocity: np.ndarray

    @property
    def restitution(self) -> float:
        """Return the speed of separation divided by the speed of approach."""
        return float((self.velocity - self.other_velocity)[2] / self.impact.approach)

    @property
    def tangential_restitution(self) -> float:
        """Return the velocity along x after the impact divided by the velocity before."""
        return float(self.velocity[0] / self.impact.sideways)

    @property
    def surface_speed(self) -> float:
        """Return the velocity along x of the sphere's own surface at the contact, m/s."""
        return float(self.velocity[0] - self.impact.radius * self.spin[1])


def simulation_of(scenes: Sequence[Scene]) -> Simulation:
    """Return a loaded simulation with a world for each scene; the scenes must have one structure."""
    capacity = max(scene.capacity() for scene in scenes)
    simulation = Simulation(scenes[0], len(scenes), capacity)
    simulation.load(list(scenes))
    return simulation


def by_id(result: Result) -> dict[str, np.ndarray]:
    """Return the state of a result with its particles in the order of their ids."""
    order = np.argsort(result.state["id"])
    return {name: values[order] for name, values in result.state.items()}


def rebound(impact: ParticleImpact, result: Result) -> Rebound:
    """Return the rebound of an impact from its result."""
    state = by_id(result)
    other = state["velocity"][1] if impact.partner != "plane" else np.zeros(3)
    return Rebound(impact, state["velocity"][0], state["spin"][0], other)


@dataclass(frozen=True)
class ForceCurve:
    """The force curve of an impact: overlaps (m) and forces (N) at times (s), and the duration of contact,
    s."""

    time: np.ndarray
    overlap: np.ndarray
    force: np.ndarray
    lasted: float


def force_curves(impacts: Sequence[ParticleImpact], every: int = 4) -> list[ForceCurve]:
    """Return the force curves of several impacts, sampled after every ``every`` steps."""
    seen: list[list[tuple[float, float, float]]] = [[] for _ in impacts]
    with closing(simulation_of([impact.scene() for impact in impacts])) as simulation:
        for _ in range(int(1.5 * STEPS) // every):
            simulation.run(steps=every)
            for impact, rows, result in zip(impacts, seen, sound(simulation.results()), strict=True):
                state = by_id(result)
                other = state["position"][1, 2] + impact.other_radius if impact.partner != "plane" else 0.0
                overlap = impact.radius + other - state["position"][0, 2]
                rows.append((result.time, overlap, state["force"][0, 2]))
    curves = []
    for rows in seen:
        time, overlap, force = np.array(rows).T
        # The speed is constant after contact, so the end of contact follows by extrapolation.
        since = overlap[-1] / ((overlap[-1] - overlap[-2]) / (time[-1] - time[-2]))
        curves.append(ForceCurve(time, overlap, force, float(time[-1] - since)))
    return curves
