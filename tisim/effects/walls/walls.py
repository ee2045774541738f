"""Walls, which grains touch as they touch each other."""

from __future__ import annotations

import math
from collections.abc import Iterable, Iterator, Mapping, Sequence
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from tisim.components.component import Component, Text
from tisim.domains.domain import Domain
from tisim.effects.base import Effect, Field, Force, SceneParts, Shaped, option
from tisim.effects.contact.granular.contact import GranularContact
from tisim.effects.walls.motion import Fixed, Motion, MotionState, resultant, resultant_units
from tisim.effects.walls.wall_contacts import WallContacts
from tisim.effects.walls.wall_faces import check_faces
from tisim.effects.walls.wall_ring import Bundling, Doubting
from tisim.effects.walls.wall_search import CONTACTS, Faces
from tisim.errors import Words, must
from tisim.geometry.box import BoxSurface
from tisim.geometry.cone import ConicalSurface
from tisim.geometry.cylinder import CylindricalSurface
from tisim.geometry.disc import Disc
from tisim.geometry.plane import Plane
from tisim.geometry.shape import Shape
from tisim.geometry.sphere import SphericalSurface
from tisim.geometry.surface import Surface
from tisim.geometry.triangles import TriangulatedSurface
from tisim.materials.material_law import UsesMaterials
from tisim.materials.materials import Materials
from tisim.operators.base import largest_inserted
from tisim.state.bound import Peers
from tisim.state.fields import WorldField

FIELDS = ("past", "surface_past", "loads", "touched", "clear")
"""Fields of a grain for a wall, if needed: the contact history at planes and at surfaces, the load, the
number of contacts, and the cached clearance."""


class Walls(WallContacts, UsesMaterials, Force):
    """Walls confine grains by the contact laws of the scene; the walls of an effect form one rigid body.

    The body is at rest or moves as prescribed by its ``motion``. A wall is a grain of infinite radius and
    mass. Planes bound the region of the grains, and each plane acts independently. Other surfaces have two
    sides and rims. If they meet, a grain feels the nearer one at a convex edge or a seam, and both at a
    concave edge. The contact history is stored on the grain, and is kept when the grain moves from one
    triangle to the next. No surface acts through the periodic faces of a box: a surface at one face must be
    the same at the opposite face, as a floor is, or it is refused.

    Use separate walls, each with its own name, for bodies that move independently or whose forces are
    reported separately. The result contains the force (N) and the torque (N m) of the grains on the body,
    about the origin or the centre of its rotation, as ``measures["NAME_force_x"]`` and so on, and the force
    and torque of the body on each grain as ``state["NAME_loads"]``.
    """

    fields = ("radius", "velocity", "spin")
    depends_on_velocity: ClassVar[bool] = True
    leapfrog: ClassVar[bool] = True
    guards_steps: ClassVar[bool] = True
    requires: ClassVar = (GranularContact,)

    planes: tuple[Plane, ...] = option(
        "planes; worlds of a batch may differ in their number, as for other shapes",
        (),
        examples=[(Plane(),)],
    )
    discs: tuple[Disc, ...] = option("flat discs", (), examples=[()])
    spheres: tuple[SphericalSurface, ...] = option(
        "spheres, with grains inside or outside", (), examples=[()]
    )
    cylinders: tuple[CylindricalSurface, ...] = option(
        "cylinders, with grains inside or outside", (), examples=[()]
    )
    cones: tuple[ConicalSurface, ...] = option("cones, with grains inside or outside", (), examples=[()])
    boxes: tuple[BoxSurface, ...] = option("boxes, with grains inside or outside", (), examples=[()])
    surface: TriangulatedSurface | None = option("a surface of triangles, such as from an STL file", None)
    motion: Motion = option("how the body moves", Fixed())
    material: Text | None = option("material of the walls; by default the first of the scene", None)

    @model_validator(mode="after")
    def _there(self) -> Walls:
        there = any(getattr(self, name) for name, _ in self.lists()) or self.surface is not None
        must(there, self.label, "given a plane or a surface", Words("none"))
        return self

    def members(self) -> dict[str, Component]:
        surface = {"surface": self.surface} if self.surface else {}
        return {"motion": self.motion, **surface}

    def check_materials(self, materials: Materials) -> None:
        self.material_index(materials)

    def check_start(self, start: Mapping[str, np.ndarray], scene: SceneParts) -> None:
        effects = scene.acting()
        for law in effects:
            if isinstance(law, GranularContact):
                law.check_wall(start, effects, self.material_index(self._materials), self.label)
        radii = np.concatenate([start["radius"], largest_inserted(effects)["radius"]])
        reach = float(radii.max(initial=0.0))
        check_faces(self._named_shapes(), self.motion, scene.domain, reach, scene.duration)

    def _named_shapes(self) -> Iterator[tuple[str, Shape]]:
        for name, _ in self.lists():
            yield from ((f"{self.label}.{name}", shape) for shape in getattr(self, name))
        if self.surface:
            yield f"{self.label}.surface", self.surface

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # The contact laws give the limit, including the materials of walls.
        return math.inf

    def reached_speed(self, duration: float, extent: float) -> float:
        return self.motion.top_speed(extent)

    def failure_hint(self, effects: Sequence[Effect], domain: Domain) -> str:
        hints = [law.failure_hint(effects, domain) for law in effects if isinstance(law, GranularContact)]
        if self.touches_surfaces and any(isinstance(one, Shaped) and one.moves for one in effects):
            hints.append(
                "a body with a shape touches a rim, or a cone from outside, for which there is no law"
            )
        return ", or ".join(filter(None, hints))

    def material_index(self, materials: Materials) -> int:
        """Return the index of the material of the walls among the materials of a scene."""
        return 0 if self.material is None else materials.index(self.material, f"{self.label}.material")

    def room(self) -> dict[str, int]:
        # Particles remember their contacts by the rows of these lists.
        return self.needed_room()

    def kinds_of_surface(self) -> Iterator[str]:
        """Yield the names of the non-empty lists of surfaces."""
        return (name for name, kind in self.lists() if issubclass(kind, Surface) and getattr(self, name))

    def not_for_shapes(self) -> Iterator[str]:
        """Yield the names of the surfaces that bodies with shapes cannot touch: those that are no planes,
        spheres, open cylinders or open cones."""
        for name, kind in self.lists():
            rows = getattr(self, name)
            if rows and issubclass(kind, Surface) and not kind.envelope:
                yield name
            elif any(getattr(shape, "closed", False) for shape in rows):
                yield f"closed {name}"
        if self.surface is not None:
            yield "surface"

    @property
    def touches_surfaces(self) -> bool:
        """Return whether there are surfaces other than planes."""
        return self.surface is not None or any(self.kinds_of_surface())

    def overlaps(self, position: np.ndarray, radius: np.ndarray) -> np.ndarray:
        """Return the overlap (m) of spheres at some places (m, shape (n, 3)) with the wall at time 0, shape
        (n,); for a sphere behind a plane it exceeds the diameter."""
        shapes = [shape for _, shape in self._named_shapes()]
        places = position - np.array(self.motion.shift())
        deepest: np.ndarray = radius - np.min([shape.distances(places) for shape in shapes], axis=0)
        return deepest

    def envelopes(self) -> list[Surface]:
        """Return the surfaces that bodies with shapes touch."""
        return [one for _, one in self._named_shapes() if isinstance(one, Surface) and one.envelope]

    def required_world_fields(self) -> tuple[WorldField, ...]:
        kept = self.motion.quantities.items()
        measures = (WorldField(f"{self.label}_{name}", "measure", unit) for name, unit in kept)
        return (*measures, WorldField(f"{self.label}_resistance", "sum")) if kept else ()

    def memory_fields(self, effects: Sequence[Effect]) -> tuple[Field, ...]:
        values = sum(effect.memory for effect in effects if isinstance(effect, GranularContact))
        moving = [one for one in effects if isinstance(one, Shaped) and one.moves]
        corners = moving[0].corners if moving else 1
        slots = {"past": self.room()["planes"] * corners * values, "loads": 6}
        if self.touches_surfaces and moving:
            slots["surface_past"] = self._rows()[-1] * corners * values
        elif self.touches_surfaces:
            slots["surface_past"] = CONTACTS * (3 + values)
        if self.touches_surfaces or self.motion.moves:
            slots["clear"] = 5
        fields = (Field(f"{self.label}_{n}", "", 1, "keep", slots=size) for n, size in slots.items() if size)
        return *fields, Field(f"{self.label}_touched", "", 1, "keep", integer=True)

    def _rows(self) -> list[int]:
        """Return the number of rows in the memory of the lists of surfaces before each list, and of all."""
        room = self.room()
        rows = [room[name] for name in self.kinds_of_surface()]
        return [0, *np.cumsum(rows).tolist()]

    def connect(self, peers: Peers) -> dict[str, Any]:
        laws, begin = [], 0
        for law in peers.of(GranularContact):
            laws.append((law, begin, law.data.memory))
            begin += law.data.memory
        bound, moving = peers.bound(self), [one for one in peers.of(Shaped) if one.data.moves]
        surfaces = tuple(getattr(bound, name) for name in self.kinds_of_surface())
        faces = Faces(surfaces, bound.surface, self.surface is not None)
        return {
            "laws": tuple(laws),
            "stride": begin,
            "shaped": bool(moving),
            "shapes": moving[0] if moving else None,
            "corners": moving[0].data.corners if moving else 1,
            "wall_material": self.material_index(self._materials),
            "flat": bound.planes,
            "has_planes": bool(self.planes),
            "faces": faces,
            "envelopes": tuple(zip(surfaces, self._rows(), strict=False)),
            "envelope_rows": self._rows()[-1],
            "bundling": Bundling(faces),
            "doubting": Doubting(),
            "has_mesh": self.surface is not None,
            "mesh": bound.surface,
        }

    def bind_fields(self, s: Any) -> dict[str, Any]:
        def columns(names: Iterable[str]) -> dict[str, Any]:
            return {name: getattr(s, f"{self.label}_{name}") for name in names}

        present = {field.name for field in s.fields}
        fields = [name for name in FIELDS if f"{self.label}_{name}" in present]
        return {
            "kept": MotionState(columns(self.motion.quantities)),
            **columns(fields),
            **(columns(["resistance"]) if self.motion.quantities else {}),
        }

    def measures(self, state: Mapping[str, np.ndarray]) -> dict[str, float]:
        loads = state[f"{self.label}_loads"]
        centre = self.motion.centre_of_torque()
        return resultant(self.label, state["position"], -loads[:, :3], -loads[:, 3:], centre)

    def measured(self) -> dict[str, str]:
        return {**resultant_units(self.label), **super().measured()}
