"""The contract of insertions, which add grains to a region in the course of a run."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.materials.material_law import UsesMaterials
from tisim.materials.materials import Materials
from tisim.numerics import philox
from tisim.numerics.random_streams import INSERTION
from tisim.numerics.vectors import random_orientation
from tisim.operators.base import AddsParticles, option, parameter
from tisim.operators.filled_region import FilledRegion
from tisim.operators.grain_shapes import GrainShapes
from tisim.operators.tried_place import TriedPlace
from tisim.packing.grains import check_quantities, class_materials, further_quantities
from tisim.packing.magnetic_core import core_moments, core_normal
from tisim.program.phases import WorldAction
from tisim.state.bound import Bound
from tisim.state.fields import WorldField
from tisim.state.state import State

MOST_TRIES = 20_000
"""Largest number of insertion trials for a grain in a step, limited by the counter of the Philox
generator."""


class Insertion(GrainShapes, FilledRegion, UsesMaterials, AddsParticles):
    """An insertion adds grains at random places of a region, without overlap with the grains already there.

    Grains come one after another. The class of each is drawn at random, and its velocity is v = velocity +
    deviation * lambda, with lambda uniform in -1..1 along each axis. The orientations of clumps are uniformly
    random. If all ``tries`` insertion trials of a grain fail, it is tried again in the next step and the
    later grains wait, so that the size distribution is kept however full the region is. The grains depend on
    the seed of the scene alone; their places also depend on the particles already there. They do not spin,
    and have the further quantities that their class defines.

    ``measures`` have the number and the mass (kg) of the grains inserted so far, under the name of the
    insertion: NAME_number and NAME_mass.
    """

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    fields = ("radius",)
    any_order: ClassVar[bool] = True

    number: int = option("largest number of inserted grains", gt=0, le=10**8, examples=[1000])
    velocity: Vector = parameter("m/s", "mean velocity of the grains", (0.0, 0.0, 0.0))
    deviation: Vector = parameter(
        "m/s", "largest deviation from the mean velocity, along each axis", (0.0, 0.0, 0.0)
    )
    begin: float = parameter("s", "time from which on grains are inserted", 0.0, ge=0)
    tries: int = option("insertion trials for a grain in a step", 20, gt=0, le=MOST_TRIES)

    @model_validator(mode="after")
    def _sound(self) -> Self:
        check_quantities(self.grains, ("position", "velocity", "mass", "radius", "id", "material"))
        self.check_fits(self.farthest())
        return self

    def structure(self) -> tuple[Any, ...]:
        """Return the compiled-in options, including sizes, materials and further quantities."""
        classes = (
            (one.sizes, one.material, one.core, *sorted(one.quantities.items())) for one in self.grains
        )
        shapes = (table.tobytes() for table in GrainShapes.lookups(self).values())
        return (*super().structure(), *classes, *shapes)

    def required_world_fields(self) -> tuple[WorldField, ...]:
        number = WorldField(f"{self.label}_number", "measure")
        return *super().required_world_fields(), number, WorldField(f"{self.label}_mass", "measure", "kg")

    def check_materials(self, materials: Materials) -> None:
        class_materials(self.grains, materials)

    def given_quantities(self) -> list[dict[str, Any]]:
        """Return the further quantities of the grains of each class, by name; with the material index, if any
        class has its own material."""
        given: list[dict[str, Any]] = [dict(sorted(one.quantities.items())) for one in self.grains]
        indices = class_materials(self.grains, self._materials)
        if indices is None:
            return given
        return [{**one, "material": index} for one, index in zip(given, indices, strict=True)]

    def largest_inserted(self) -> Mapping[str, np.ndarray]:
        indices, of_each = class_materials(self.grains, self._materials), min(self.number, 2)
        material = np.zeros(len(self.grains), int) if indices is None else indices
        return {
            "radius": np.repeat(self.largest_spheres(), of_each),
            "material": np.repeat(material, of_each),
            "length": np.repeat(self.longest(), of_each),
        }

    def inserted_quantities(self) -> Mapping[str, np.ndarray]:
        every, largest = np.arange(len(self.grains)), np.array(self.largest_spheres())
        return further_quantities(self.grains, every, largest, np.zeros(len(every)))

    def capacity(self, masses: np.ndarray) -> int:
        return len(masses) + self.number * self.most_spheres()

    def lookups(self) -> dict[str, np.ndarray]:
        tables = [one.sizes.table() for one in self.grains]
        lengths = np.array([len(table) for table in tables])
        ends, by_number = np.cumsum(lengths), [one.sizes.by == "number" for one in self.grains]
        return {
            **super().lookups(),
            "nodes": np.concatenate(tables),
            "spans": np.column_stack([ends - lengths, ends - 1, by_number]).astype(float),
            # One more column, because there may be no given quantities.
            "given": np.array([np.hstack([*one.values(), 0.0]) for one in self.given_quantities()]),
            "cores": np.array([one.core.row() if one.core else [0.0] * 4 for one in self.grains]),
        }

    def world_action(self, own: Bound[Any], s: State) -> WorldAction:
        return TriedPlace(own, s)

    def bind_fields(self, s: Any) -> dict[str, Any]:
        """Return the state variables of the insertion, and the fields of the quantities given by the classes,
        each with its first column in the table."""
        number, mass = getattr(s, f"{self.label}_number"), getattr(s, f"{self.label}_mass")
        given, first = [], 0
        for name, value in self.given_quantities()[0].items():
            if hasattr(s, name):
                given.append((getattr(s, name), first, np.size(value)))
            first += np.size(value)
        named = {*self.given_quantities()[0], *self.grains[0].quantity_names()}
        own = {
            "inserted": number,
            "inserted_mass": mass,
            "given_fields": tuple(given),
            "has_cores": self.grains[0].core is not None,
            "has_domains": "domain_moment" in self.grains[0].quantity_names(),
            # Their defaults are copies of given fields, which an inserted particle gets last.
            "copied_fields": tuple(
                (getattr(s, field.name), getattr(s, field.default))
                for field in s.fields
                if field.default in named and field.name not in named
            ),
        }
        return {**super().bind_fields(s), **own}

    @ti.func
    def pending(self, s, w):
        """Return whether more grains are to come, so that ``at_rest`` has to wait."""
        return 0

    @ti.func
    def is_wanted(self, s, w):
        """Return whether another grain is to be inserted now."""
        return False

    @ti.func
    def seek(self, s, w):
        """Start the insertion trials of the next grain, if one is wanted."""
        tried = self.action
        tried.seeking[w], tried.attempt[w] = ti.cast(self.is_wanted(s, w), ti.i32), 0

    @ti.func
    def choose_place(self, s, w):
        """Choose the place of the next trial; before the first trial, draw the grain."""
        tried, k = self.action, ti.cast(self.inserted[w], ti.i32)
        tried.taken[w] = 0
        if tried.attempt[w] == 0:
            self.draw_grain(s, w, k)
        of_place = self.uniforms(s, w, k, 1 + tried.attempt[w])
        spot = ti.Vector([of_place[0], of_place[1], of_place[2]])
        tried.place[w] = self.point(w, self.outer(tried.drawn[w], tried.radius[w]), spot)
        tried.orientation[w] = random_orientation(of_place[3], of_place[4], of_place[5])

    @ti.func
    def draw_grain(self, s, w, k):
        """Draw grain k; if there is no room for it in memory, all its trials count as used."""
        tried, of_grain = self.action, self.uniforms(s, w, k, 0)
        c = self.draw_class(w, of_grain[0])
        tried.drawn[w], tried.radius[w] = c, ti.cast(self.draw_radius(c, of_grain[1]), s.real)
        lambda_ = 2.0 * ti.Vector([of_grain[2], of_grain[3], of_grain[4]]) - 1.0
        tried.velocity[w] = self.velocity(w) + self.deviation(w) * lambda_
        size = self.end_sphere(c) - self.first_sphere(c)
        # Members of clumps are found through a table by id, with one entry for each particle that fits into
        # memory.
        numbered = s.next_id[w] + size <= s.most[w]
        if s.free_slots(w) < size or not (numbered or ti.static(not self.has_clumps)):
            tried.taken[w], tried.attempt[w] = 1, self.tries

    @ti.func
    def end_try(self, s, w):
        """Insert the grain if its place is free, and start the trials of the next one. A grain whose trials
        have all failed is the last of the step."""
        tried = self.action
        if tried.taken[w] == 0:
            radius = tried.radius[w]
            self.put(s, w, tried.drawn[w], tried.place[w], tried.orientation[w], tried.velocity[w], radius)
            tried.filled[w] += ti.cast(radius, ti.f64) ** 3
            self.seek(s, w)
        else:
            tried.attempt[w] += 1
            tried.seeking[w] = ti.cast(tried.attempt[w] < self.tries, ti.i32)

    @ti.func
    def uniforms(self, s, w, k, attempt):
        """Return six random numbers in 0..1: the properties of grain k (attempt 0), or its place and
        orientation in a trial of this step (attempt 1 and later)."""
        step = ti.select(attempt > 0, s.steps[w], ti.cast(0, ti.i64))
        numbers = ti.Vector.zero(s.real, 6)
        for m in range(3):
            words = philox.bits(s.seed[w], INSERTION + self.index, k, step, 3 * attempt + m)
            two = philox.uniform(words)
            numbers[2 * m], numbers[2 * m + 1] = ti.cast(two[0], s.real), ti.cast(two[1], s.real)
        return numbers

    @ti.func
    def put(self, s, w, c, place, q, velocity, radius):
        """Insert a grain of class c at a place (m), turned by q."""
        mass = self.grains.density(w, c) * ti.cast(4.0 / 3.0 * ti.math.pi, s.real) * radius**3
        lead, first = s.count[w], s.next_id[w]
        for m in range(self.first_sphere(c), self.end_sphere(c)):
            at, size = place + self.arm(m, q, radius), self.sphere_radius(m, radius)
            i = s.insert(w, at, velocity, size, self.sphere_mass(m, mass))
            self.give(s, w, c, i)
        if ti.static(self.has_clumps):
            self.join(s, w, c, lead, first, place, q, velocity, mass, radius)
        self.inserted[w] += 1.0
        self.inserted_mass[w] += ti.cast(mass, ti.f64)

    @ti.func
    def give(self, s, w, c, i):
        """Set the further quantities that the class of a particle defines; those of its core, by its
        radius."""
        for given in ti.static(self.given_fields):
            if ti.static(given[2] == 3):
                given[0][w, i] = ti.Vector([self.given[c, given[1] + m] for m in range(3)])
            else:
                given[0][w, i] = ti.cast(self.given[c, given[1]], given[0].dtype)
        if ti.static(self.has_cores):
            k = ti.cast(self.inserted[w], ti.i32)
            normal = core_normal(s.seed[w], k, self.index)
            saturation, domain = core_moments(self.cores, c, s.radius[w, i], normal)
            s.saturation_moment[w, i] = ti.cast(saturation, s.real)
            if ti.static(self.has_domains):
                s.domain_moment[w, i] = ti.cast(domain, s.real)
        for copied in ti.static(self.copied_fields):
            copied[0][w, i] = copied[1][w, i]

    @ti.func
    def draw_class(self, w, u):
        """Return the class of a grain, drawn by a number in 0..1."""
        total = 0.0 * self.grains.number(w, 0)
        for k in range(self.grains.size(w)):
            total += self.grains.number(w, k)
        c, below = 0, self.grains.number(w, 0)
        while c < self.grains.size(w) - 1 and below <= u * total:
            c += 1
            below += self.grains.number(w, c)
        return c

    @ti.func
    def draw_radius(self, c, u):
        """Return the radius (m) of a grain of a class, drawn by a number in 0..1, as
        ``SizeDistribution.radii`` does."""
        low, high = ti.cast(self.spans[c, 0], ti.i32), ti.cast(self.spans[c, 1], ti.i32)
        while high - low > 1:
            middle = (low + high) // 2
            if self.nodes[middle, 1] <= u:
                low = middle
            else:
                high = middle
        a, b = ti.cast(self.nodes[low, 0], ti.f64), ti.cast(self.nodes[low + 1, 0], ti.f64)
        first, last = ti.cast(self.nodes[low, 1], ti.f64), ti.cast(self.nodes[low + 1, 1], ti.f64)
        part = ti.select(last > first, (u - first) / (last - first), 0.0)
        part = ti.max(0.0, ti.min(part, 1.0))
        ratio = a / b
        return ti.select(
            self.spans[c, 2] > 0.0, a + part * (b - a), a / ti.sqrt(1.0 - part * (1.0 - ratio * ratio))
        )
