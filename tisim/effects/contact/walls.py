"""Walls at rest, which grains touch as they touch each other."""

from collections.abc import Sequence
from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend.taichi import ti
from tisim.components.component import Text
from tisim.components.material_law import MaterialLaw
from tisim.components.materials import Materials
from tisim.effects.base import Effect, Force, option
from tisim.effects.contact.granular.contact import GranularContact
from tisim.geometry.plane import Plane
from tisim.worlds.bound import Peers
from tisim.worlds.fields import Field


class Walls(MaterialLaw, Force):
    """Plane walls at rest hold grains back by the contact laws of the scene.

    A wall is a grain of infinite radius and mass. What a contact remembers lies with the grain, for each wall
    by itself.
    """

    fields = ("radius", "velocity", "spin")
    depends_on_velocity: ClassVar[bool] = True
    requires: ClassVar = (GranularContact,)

    planes: tuple[Plane, ...] = option(
        "the walls; their number may differ per world", (Plane(),), min_length=1
    )
    material: Text | None = option("material of the walls; the first of the scene unless given", None)

    def check_materials(self, materials: Materials) -> None:
        self.material_index(materials)

    def material_index(self, materials: Materials) -> int:
        """Return the index of the material of the walls among those of a scene."""
        return 0 if self.material is None else materials.index(self.material, f"{self.label}.material")

    def memory_fields(self, effects: Sequence[Effect]) -> tuple[Field, ...]:
        values = sum(effect.memory for effect in effects if isinstance(effect, GranularContact))
        past = Field(f"{self.label}_past", "", 1, "keep", slots=max(1, Plane.room(len(self.planes)) * values))
        return past, Field(f"{self.label}_touched", "", 1, "keep", integer=True)

    def connect(self, peers: Peers) -> dict[str, Any]:
        laws, begin = [], 0
        for law in peers.of(GranularContact):
            laws.append((law, begin, law.data.memory))
            begin += law.data.memory
        own = {"each": peers.bound(self).planes, "wall": self.material_index(self._materials)}
        return {"laws": tuple(laws), "stride": begin, **own}

    def remembers(self, s: Any) -> dict[str, Any]:
        return {name: getattr(s, f"{self.label}_{name}") for name in ("past", "touched")}

    if TYPE_CHECKING:
        past: Any
        each: Any
        stride: int
        wall: int

    @ti.func
    def overlap(self, s, w, i, k):
        """Return how deep (m) grain i lies in wall k; it is negative when they do not touch."""
        return s.radius[w, i] - self.each.distance(w, k, s.position[w, i])

    @ti.func
    def reach(self, s, w, i):
        """Return the widest gap (m) at which a law acts between grain i and a wall."""
        gap = ti.cast(0.0, s.real)
        for law in ti.static(self.laws):
            gap = ti.max(gap, law[0].wall_reach(s, w, i))
        return gap

    @ti.func
    def load(self, s, w, i, t, dt, commit):
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        touching = 0
        for k in range(self.each.size(w)):
            touching += ti.select(self.overlap(s, w, i, k) >= -self.reach(s, w, i), 1, 0)
        # Most grains touch no wall, and have touched none in the step before.
        if touching + self.touched[w, i] > 0:
            for k in range(self.each.size(w)):
                for law in ti.static(self.laws):
                    push, turn = self.touch(s, w, i, k, law, dt, commit)
                    force, torque = force + push, torque + turn
            if commit:
                self.touched[w, i] = touching
        return force, torque

    @ti.func
    def touch(self, s, w, i, k, law: ti.template(), dt, commit):  # type: ignore[valid-type]
        """Return force (N) and torque (N m) of one law at wall k; what the contact remembers goes on where
        ``commit``."""
        force, torque = ti.Vector.zero(s.real, 3), ti.Vector.zero(s.real, 3)
        begin, overlap = k * self.stride + law[1], self.overlap(s, w, i, k)
        past = ti.Vector.zero(s.real, max(1, law[2]))
        for c in ti.static(range(law[2])):
            past[c] = self.past[w, i, begin + c]
        known = 0.0 * past
        if overlap >= -self.reach(s, w, i):
            normal = -self.each.direction(w, k)
            rest = ti.Vector.zero(s.real, 3)
            force, torque, known = law[0].at_wall(s, w, i, normal, overlap, rest, self.wall, past, dt)
        if commit:
            for c in ti.static(range(law[2])):
                self.past[w, i, begin + c] = known[c]
        return force, torque
