"""Hard walls around hard bodies."""

from collections.abc import Iterable, Mapping
from typing import Literal

import numpy as np

from tisim.components.component import Component, option
from tisim.effects.base import Effect, HardBodies, SceneParts
from tisim.effects.base.shaped import LENGTH_TOLERANCE
from tisim.errors import Words, must
from tisim.geometry.container import Container
from tisim.geometry.round_containers import CylindricalContainer


class Confinement(Effect):
    """Confinement keeps hard bodies inside a container.

    A packing stepper removes overlaps of bodies with walls as it removes overlaps between bodies. There are
    two ways to find them. ``exact`` takes the depth of the farthest point of each round end of a body behind
    a wall, along the normal of the wall; of a body without round ends, it is the farthest point of the body.
    ``virtual`` follows B16: a virtual body, a copy of the protruding one, touches the wall from outside at
    the point that protrudes, aligned with the wall, and overlaps as any other body. It is along the axis of a
    cylinder, along the slope, the length (bottom) or the height (back) of a wedge. For spheres both agree.
    Where a body protrudes by more than D/2, the depth is exact in either way, because a virtual body would
    draw a body that has passed its axis outwards.

    Source: B16 section 2.2.4, Figs 2.4 and 2.5.
    """

    homogeneous = False

    container: Container = option("the container", examples=[CylindricalContainer(diameter=3.0)])
    treatment: Literal["exact", "virtual"] = option(
        "how overlaps with walls are found: by exact distances or by virtual bodies", "exact"
    )

    def members(self) -> dict[str, Component]:
        return {"container": self.container}

    def check(self, scene: SceneParts) -> None:
        low, high = scene.domain.bounds()
        container, joined = self.container, scene.domain.joined()
        periodic = tuple(not hard for hard in container.walled())
        rule = f"a box that is periodic along {_axes(periodic)} for {container.kind()}"
        fits = low is not None and joined == scene.domain.imaged() == periodic
        must(fits, "domain", rule, Words(f"{scene.domain.kind()}, periodic along {_axes(joined)}"))
        if low is not None and high is not None:
            container.check_box(high - low)
        held = hard_bodies(scene)
        rule = f"one with hard bodies beside {self.kind()}, such as hard_rods"
        must(bool(held), "effects", rule, [effect.label for effect in scene.effects])
        for bodies in held:
            rule = f"rods or spheres in a {container.kind()}, as round ends touch curved walls"
            must(bodies.round_ends or not container.curved, f"effects.{bodies.label}", rule, bodies.kind())
            exact = self.treatment == "exact"
            known = bodies.offers("support") and (exact or bodies.offers("closest_virtual"))
            must(known, f"effects.{self.label}.treatment", f"one for {bodies.kind()}", self.treatment)

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        if not any(self.container.scaled()):
            return
        for bodies in hard_bodies(scene):
            sizes = bodies.sizes(start)
            if len(sizes):
                same = float(np.ptp(sizes)) <= LENGTH_TOLERANCE * float(sizes.max())
                rule = f"in one ratio to their shapes, as the {self.container.kind()} grows with them"
                must(same, "particles.radius", rule, float(sizes.max() / sizes.min()))


def confinement(scene: SceneParts) -> Confinement | None:
    """Return the confinement of a scene; None without walls."""
    return next((effect for effect in scene.effects if isinstance(effect, Confinement)), None)


def hard_bodies(scene: SceneParts) -> list[HardBodies]:
    """Return the effects of hard bodies in a scene."""
    return [effect for effect in scene.effects if isinstance(effect, HardBodies)]


def _axes(chosen: Iterable[bool]) -> str:
    names = [axis for axis, one in zip("xyz", chosen, strict=True) if one]
    return f"{' and '.join(names)} alone" if names else "no axis"
