"""Capture by successive fibres: the cascade of B16 section 6.4.5.

It continues the case capture: every stage of a cascade is a run of that case.

N particles spend ``stage`` seconds about one cylinder. The particles that it has not captured are then placed
at random around a cylinder of another orientation, and so on. "optimal": every cylinder lies across the
field. "directions": each has a random direction, with a uniform distribution over all directions. "angles":
its angle to the field is random, with a uniform distribution from 0 to 90 degrees, which is the average that
B16 uses elsewhere (section 6.4.3).

B16 does not say which of the two its random orientation is, nor gives L/D or the start positions. Here
particles start in a layer ``thickness`` wide and ``gap`` away from the cylinder, both in units of its radius.
"""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from tisim import RandomAroundCylinder, Scene
from tisim.cases.capture import scene as capture
from tisim.cases.case import Size, size_named
from tisim.sources import MagneticCylinders

Orientation = Literal["optimal", "directions", "angles"]
TITLE = "Magnetic colloids captured by successive fibres (B16)"
STAGE = {25: 10.0, 125: 0.5}
"""The time of a stage, Delta t_run, s, by radius in nm (B16 section 6.4.5)."""

SEARCH = {"generations": 100, "max_evaluations": 200}
"""Settings of the search."""
SIZES = {
    "default": Size("100 particles of 125 nm about a random cylinder of L/D 20, 0.5 s", {}, SEARCH),
    "optimal": Size("the same about a transverse cylinder", {"orientation": "optimal"}),
    "25nm": Size("100 particles of 25 nm, 10 s", {"nanometres": 25, "stage": 10.0}),
}


@dataclass(frozen=True)
class Cascade:
    """The settings of a cascade. nanometres : radius of the particles. stage : time about each cylinder, s.

    orientation, thickness, gap : see the module. aspect : L/D. number : of particles.
    """

    nanometres: int = 125
    stage: float = 0.5
    orientation: Orientation = "directions"
    aspect: float = 20.0
    thickness: float = 1.0
    gap: float = 0.0
    number: int = capture.NUMBER

    def begin(self, passed: int) -> float:
        """Return the time after a number of stages, s."""
        return passed * self.stage

    def angle(self, generator: np.random.Generator, passed: int = 0) -> float:
        """Return the angle to the field, degrees, of the cylinder after a number of stages."""
        uniform = generator.uniform()
        return {
            "optimal": 90.0,
            "directions": float(np.degrees(np.arccos(uniform))),
            "angles": 90.0 * uniform,
        }[self.orientation]

    def scene(self, number: int, generator: np.random.Generator, passed: int = 0) -> Scene:
        """Return one stage: ``number`` particles about the cylinder after a number of stages."""
        scene = capture.scene(
            nanometres=self.nanometres,
            angle=self.angle(generator, passed),
            aspect=self.aspect,
            number=number,
            duration=self.begin(passed + 1) - self.begin(passed),
            seed=int(generator.integers(2**62)),
        )
        (body,) = next(e for e in scene.effects if isinstance(e, MagneticCylinders)).cylinders
        away = self.gap * body.radius
        layer = RandomAroundCylinder(
            axis=body.axis,
            radius=body.radius + away,
            length=body.length + 2 * away,
            thickness=self.thickness * body.radius,
        )
        cloud = scene.particles.model_copy(update={"placement": layer})
        return scene.model_copy(update={"name": "cascade", "particles": cloud})


@dataclass(frozen=True)
class PlannedCascade(Cascade):
    """A cascade with a given angle of each cylinder, and a given time about each.

    angles : to the field, degrees. stages : s, as many. After the last, they are repeated in the same order.
    """

    angles: tuple[float, ...] = (90.0,)
    stages: tuple[float, ...] = (0.5,)

    def begin(self, passed: int) -> float:
        turns, rest = divmod(passed, len(self.stages))
        return turns * sum(self.stages) + sum(self.stages[:rest])

    def angle(self, generator: np.random.Generator, passed: int = 0) -> float:
        return self.angles[passed % len(self.angles)]


def scene_for(size: str, seed: int) -> Scene:
    """Return the first stage of the cascade of a size."""
    one = Cascade(**size_named(size, SIZES).scene)
    return one.scene(one.number, np.random.default_rng(seed))
