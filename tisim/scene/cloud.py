"""An initial state of spheres at random places, equal or of classes with their own sizes."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, Self

import numpy as np
from pydantic import model_validator

from tisim.components.component import Text, Vector, option, parameter
from tisim.components.ranges import LEAST, MOST, PARTICLES, check_memory
from tisim.domains.domain import Domain
from tisim.errors import Words, must
from tisim.materials.materials import Materials
from tisim.packing.grains import (
    GrainClass,
    check_quantities,
    class_materials,
    draw,
    further_quantities,
    masses,
)
from tisim.packing.magnetic_core import core_normals
from tisim.packing.placement import Placement, RandomInDomain, RandomSequential
from tisim.packing.tried_places import Packing
from tisim.scene.initial_state import Arrays, Start, worst
from tisim.scene.initial_velocity import Pulse

SPHERES_ASKED = 4096
"""Number of spheres of a larger cloud of equal spheres from which a stepper is chosen."""


class Cloud(Start):
    """A cloud of spheres starts with random velocities.

        v = mean_velocity + deviation * lambda + pulse

    lambda is uniform in -1..1 for each particle and component. The same seed gives the same lambdas for any
    values of the other parameters. The spheres are equal, with a radius and a density, or are drawn from the
    grains of a mixture: the class of each is drawn by the number fractions of the classes, and its size from
    the class.

    Source: Z04 section 7.
    """

    number: int | None = option(
        "number of spheres; left out if the placement determines it, as a lattice does",
        None,
        gt=0,
        le=PARTICLES,
        examples=[100],
    )
    radius: float | None = parameter("m", "radius of equal spheres", None, examples=[1e-3], gt=0)
    density: float | None = parameter("kg/m^3", "density of equal spheres", None, examples=[2000.0], gt=0)
    grains: tuple[GrainClass, ...] = option("classes of unequal spheres, instead of radius and density", ())
    placement: Placement = option("placement of the centres", RandomInDomain())
    mean_velocity: Vector = parameter("m/s", "mean velocity", (0.0, 0.0, 0.0))
    deviation: Vector = parameter(
        "m/s", "largest deviation from the mean velocity, along each axis", (0.0, 0.0, 0.0)
    )
    pulse: Pulse | None = option("additional initial velocities, such as those of a blast", None)
    temperature: float = parameter("K", "temperature", 300.0, gt=0)
    material: Text | None = option("material of the spheres; the first of the scene unless given", None)
    specific_charge: float | None = parameter(
        "C/kg", "charge over mass of each sphere; uncharged unless given", None
    )
    quantities: Mapping[Text, float | Vector] = option(
        "further fields by name, in SI; one number or three components, for all spheres", default_factory=dict
    )

    @model_validator(mode="after")
    def _sound(self) -> Self:
        sites = self.placement.sites()
        rule = "given" if sites is None else f"{sites}, as the placement has sites, or left out"
        agrees = self.number is not None if sites is None else self.number in (None, sites)
        must(agrees, "cloud.number", rule, Words("nothing") if self.number is None else self.number)
        given = [name for name in ("radius", "density", "grains") if getattr(self, name)]
        rule = "given radius and density, or grains"
        must(
            given in (["radius", "density"], ["grains"]), "cloud", rule, Words(" and ".join(given) or "none")
        )
        must(all(one.clump is None for one in self.grains), "cloud.grains", "spheres", Words("clumps"))
        own = {"position", "velocity", "radius", "mass", "temperature", "id", "material"}
        own |= {"charge"} if self.specific_charge is not None else set()
        for name, value in self.quantities.items():
            must(
                name not in own, f"cloud.quantities.{name}", "given outside quantities, and only once", value
            )
        check_quantities(self.grains, {*own, *self.quantities} - {"temperature"})
        mass, rule = self._equal_mass(), f"from {LEAST:g} to {MOST:g} kg"
        must(mass is None or LEAST <= mass <= MOST, "mass of a particle of the cloud", rule, mass)
        return self

    def count(self) -> int:
        """Return the number of spheres."""
        return self.placement.sites() or self.number or 0

    def _equal_mass(self) -> float | None:
        """Return the mass of each sphere, kg; None for unequal spheres."""
        if self.radius is None or self.density is None:
            return None
        return self.density * 4 / 3 * np.pi * self.radius**3

    def material_indices(self, materials: Materials, seed: int) -> np.ndarray | None:
        own = 0 if self.material is None else materials.index(self.material, "cloud.material")
        of_classes = class_materials(self.grains, materials, own)
        if of_classes is not None:
            return of_classes[draw(self.grains, self.count(), seed)[0]]
        return np.full(self.count(), own) if own else None

    def masses(self, seed: int) -> np.ndarray:
        mass = self._equal_mass()
        if mass is None:
            return masses(self.grains, *draw(self.grains, self.count(), seed))
        # All in one memory location, because the number may be large and a scene is checked before it is run.
        return np.broadcast_to(mass, self.count())

    @np.errstate(over="ignore", invalid="ignore")
    def arrays(self, domain: Domain, seed: int) -> Arrays:
        arrays = self._unplaced(self.count(), seed)
        arrays = {"position": self.placement.centres(arrays["radius"], domain, seed), **arrays}
        if self.pulse is not None:
            arrays["velocity"] = arrays["velocity"] + self.pulse.velocity(arrays["position"], arrays["mass"])
        for name, values in arrays.items():
            must(bool(np.isfinite(values).all()), f"{name} of the cloud", "finite", worst(values))
        return arrays

    def unplaced(self, seed: int) -> Arrays:
        # A few equal spheres, which differ in velocity only, represent all.
        known = self._unplaced(self.count() if self.grains else min(self.count(), SPHERES_ASKED), seed)
        if self.pulse is not None and len(known["mass"]):
            # In any direction: two of them may be thrown apart.
            added = self.pulse.top_speed(self.masses(seed))
            known["velocity"][0, 0] += added
            known["velocity"][-1, 0] -= added
        return known

    def _unplaced(self, n: int, seed: int) -> Arrays:
        """Return the quantities of the first n spheres, without their places."""
        check_memory(f"a cloud of {n} particles", n)
        draws = np.random.Generator(np.random.Philox(seed)).uniform(-1.0, 1.0, (n, 3))
        spheres = self._spheres(n, seed)
        arrays = {
            "velocity": np.asarray(self.mean_velocity) + np.asarray(self.deviation) * draws,
            "temperature": np.full(n, self.temperature),
            **{name: np.repeat([value], n, axis=0).astype(float) for name, value in self.quantities.items()},
            **spheres,
        }
        if self.specific_charge is not None:
            arrays["charge"] = arrays["mass"] * self.specific_charge
        return arrays

    def _spheres(self, n: int, seed: int) -> Arrays:
        """Return the radius and mass of each sphere, and the further quantities that its class defines."""
        mass = self._equal_mass()
        if mass is not None:
            return {"radius": np.full(n, self.radius), "mass": np.full(n, mass)}
        which, radius = draw(self.grains, n, seed)
        further = further_quantities(self.grains, which, radius, core_normals(n, seed))
        return {"radius": radius, "mass": masses(self.grains, which, radius), **further}

    def packing(self, domain: Domain, seed: int) -> Packing | None:
        if not isinstance(self.placement, RandomSequential):
            return None
        n = self.count()
        check_memory(f"a cloud of {n} particles", n)
        return self.placement.packing(self._spheres(n, seed)["radius"], domain, seed)

    def structure(self) -> tuple[Any, ...]:
        return (type(self),)
