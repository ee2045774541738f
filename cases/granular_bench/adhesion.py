"""Two spheres that are drawn apart slowly, held by DMT adhesion, JKR adhesion or a liquid bridge.

The spheres are so heavy that the adhesion does not change their speed.
"""

from collections.abc import Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from tisim import Material, Particles, Scene
from tisim.cases.common.runs import sound
from tisim.cases.granular_bench.impacts import by_id, simulation_of
from tisim.effects import DMT, JKR, CapillaryBridge, Effect, Granular, HertzMaterial
from tisim.steppers import FixedStep, Verlet

STICKY_RADIUS, STICKY_YOUNG, STICKY_POISSON = 1e-3, 1e7, 0.3
"""Radius (m), Young's modulus (Pa) and Poisson's ratio of two equal spheres; R* is half the radius."""
STICKY_MODULUS = STICKY_YOUNG / (2 * (1 - STICKY_POISSON**2))
ENERGY = 0.05
"""Surface energy, J/m^2: half of the work of adhesion."""
TENSION, ANGLE, VOLUME = 0.072, 0.4, 1e-12
"""The liquid's surface tension, N/m, contact angle, rad, and volume, m^3."""
HELD_MASS = 1e9
"""Mass of each sphere, kg."""
PULL_SAMPLES = 400
"""Number of steps; the force is sampled after each."""
EFFECTS: dict[str, tuple[Effect, ...]] = {
    "dmt": (
        Granular(normal=HertzMaterial(), cohesion=DMT()),
        CapillaryBridge(surface_tension=0.0, contact_angle=ANGLE, volume=VOLUME),
    ),
    "bridge": (
        Granular(normal=HertzMaterial(), cohesion=DMT()),
        CapillaryBridge(surface_tension=TENSION, contact_angle=ANGLE, volume=VOLUME),
    ),
    "jkr": (Granular(normal=JKR()),),
}
"""The effects of each kind of adhesion; the first two have the same structure."""


@dataclass(frozen=True)
class Pull:
    """A pull: overlaps (m, < 0 for a gap) and forces (N, < 0 for attraction) while two spheres are drawn
    apart."""

    overlap: np.ndarray
    force: np.ndarray

    @property
    def largest(self) -> float:
        """Return the largest attraction, N."""
        return float(-self.force.min())

    @property
    def ends(self) -> float:
        """Return the gap (m) halfway between the last sample with a force and the next one."""
        last = int(np.flatnonzero(self.force)[-1])
        return float(-(self.overlap[last] + self.overlap[last + 1]) / 2)


def drawn(name: str, begins: float, ends: float) -> Scene:
    """Return two spheres that are drawn apart, from an overlap (m) to a gap (m), within a second."""
    return Scene(
        name="granular_bench",
        particles=Particles(
            position=np.array([[0.0, 0.0, 0.0], [2 * STICKY_RADIUS - begins, 0.0, 0.0]]),
            velocity=np.array([[0.0, 0.0, 0.0], [begins + ends, 0.0, 0.0]]),
            radius=STICKY_RADIUS,
            mass=HELD_MASS,
        ),
        materials={
            "sphere": Material(
                young=STICKY_YOUNG,
                poisson=STICKY_POISSON,
                friction=0.0,
                surface_energy=0.0 if name == "bridge" else ENERGY,
            )
        },
        effects=EFFECTS[name],
        stepper=Verlet(control=FixedStep(dt=1 / PULL_SAMPLES)),
        duration=1.0,
    )


def pulls(scenes: Sequence[Scene]) -> list[Pull]:
    """Return the pulls of several scenes of one structure, sampled after each step."""
    seen: list[list[tuple[float, float]]] = [[] for _ in scenes]
    with closing(simulation_of(scenes)) as simulation:
        for _ in range(PULL_SAMPLES):
            simulation.run(steps=1)
            for rows, result in zip(seen, sound(simulation.results()), strict=True):
                state = by_id(result)
                overlap = 2 * STICKY_RADIUS - float(np.diff(state["position"][:, 0])[0])
                rows.append((overlap, float(state["force"][1, 0])))
    return [Pull(*np.array(rows).T) for rows in seen]
