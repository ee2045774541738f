"""Classes of grains in a mixture, each with its sizes, density and share."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Self

import numpy as np
from pydantic import model_validator

from tisim.components.component import Component, Text, Vector, option, parameter
from tisim.components.ranges import LEAST, MOST
from tisim.errors import Words, must
from tisim.materials.materials import Materials
from tisim.numerics.random_streams import GRAIN_SIZES
from tisim.packing.clump import Clump
from tisim.packing.magnetic_core import MagneticCore
from tisim.packing.size_laws import EqualSizes
from tisim.packing.sizes import SizeDistribution


class GrainClass(Component):
    """A class of grains, one component of a mixture.

    In a class with a share x of the mass, density rho and number-averaged cube of the radius <r^3>, the
    number of grains is proportional to x / (rho <r^3>), with the same factor for all classes. If it has a
    clump shape, its grains are rigid clumps of this shape, scaled to their size: the radius of a grain is the
    radius of a ball of equal volume.
    """

    sizes: SizeDistribution = option("sizes of its grains", examples=[EqualSizes(radius=1e-3)])
    density: float = parameter("kg/m^3", "density of its grains", examples=[2500.0], gt=0)
    share: float = parameter(
        "", "share of the mass of the mixture; shares are divided by their sum", 1.0, gt=0
    )
    clump: Clump | None = option(
        "shape of its grains, a rigid clump, whose size and mass have no effect; spheres by default", None
    )
    material: Text | None = option(
        "material of its grains; by default the material of the cloud, or the first of the scene", None
    )
    quantities: Mapping[Text, float | Vector] = option(
        "further fields of its grains by name, in SI, such as temperature", default_factory=dict
    )
    core: MagneticCore | None = option(
        "magnetic core of each grain, which gives it a saturation_moment by its own radius", None
    )

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        yield from super().columns()
        yield "number", 1

    def values(self) -> list[float]:
        return [*super().values(), self.number()]

    @model_validator(mode="after")
    def _weighable(self) -> Self:
        radius, rule = self.sizes.nodes()[0][[0, -1]], f"from {LEAST:g} to {MOST:g} kg"
        for mass in (self.density * 4 / 3 * np.pi * radius**3).tolist():
            must(LEAST <= mass <= MOST, "mass of a grain", rule, mass)
        alone = self.core is None or self.clump is None
        must(alone, f"{self.label}.core", "left out if there is a clump", Words("both"))
        return self

    def quantity_names(self) -> list[str]:
        """Return the names of the further fields of its grains, sorted."""
        return sorted([*self.quantities, *(self.core.names() if self.core else ())])

    def spheres(self) -> np.ndarray:
        """Return the spheres of a grain of radius 1: position from the centre of mass along the principal
        axes, radius, and mass fraction; shape (n, 5)."""
        if self.clump is None:
            return np.array([[0.0, 0.0, 0.0, 1.0, 1.0]])
        body, size = self.clump.body, self._clump_radius()
        return np.column_stack([body.places / size, self.clump.radius / size, body.masses / body.mass])

    def inertia(self) -> np.ndarray:
        """Return the principal moments of inertia of a grain of radius 1 and mass 1, shape (3,)."""
        if self.clump is None:
            return np.full(3, 0.4)
        return self.clump.body.moments / (self.clump.body.mass * self._clump_radius() ** 2)

    def outer_radius(self) -> float:
        """Return the largest distance from the centre of mass to the surface of a grain of radius 1."""
        spheres = self.spheres()
        return float((np.linalg.norm(spheres[:, :3], axis=1) + spheres[:, 3]).max())

    def _clump_radius(self) -> float:
        """Return the radius (m) of a ball with the volume of the template clump."""
        assert self.clump is not None
        return float(np.cbrt(self.clump.body.volume * 3 / (4 * np.pi)))

    def number(self) -> float:
        """Return its number of grains per kg of share."""
        return self.share / (self.density * 4 / 3 * np.pi * self.sizes.mean_cube())


def draw(classes: Sequence[GrainClass], number: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the class index and the radius (m) of each of a number of grains, drawn independently.

    The result depends on the arguments only; for a larger number, the first grains are the same.
    """
    uniform = np.random.Generator(np.random.Philox(key=[seed, GRAIN_SIZES])).random((number, 2))
    counts = np.array([one.number() for one in classes])
    edges = np.cumsum(counts) / counts.sum()
    which = np.minimum(np.searchsorted(edges, uniform[:, 0], side="right"), len(classes) - 1)
    radius = np.empty(number)
    for k, one in enumerate(classes):
        radius[which == k] = one.sizes.radii(uniform[which == k, 1])
    return which, radius


def masses(classes: Sequence[GrainClass], which: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return the mass (kg) of grains of these classes and radii (m)."""
    return np.array([one.density for one in classes])[which] * 4 / 3 * np.pi * radius**3


def further_quantities(
    classes: Sequence[GrainClass], which: np.ndarray, radius: np.ndarray, normal: np.ndarray
) -> dict[str, np.ndarray]:
    """Return the further fields of grains of these classes and radii (m), by name; SI.

    normal : the normal number Z of the magnetic core of each grain.
    """
    given = {
        name: np.array([one.quantities[name] for one in classes], float)[which]
        for name in sorted(classes[0].quantities)
    }
    if classes[0].core is None:
        return given
    moments = {name: np.empty(len(which)) for name in classes[0].core.names()}
    for k, one in enumerate(classes):
        assert one.core is not None
        for name, values in one.core.moments(radius[which == k], normal[which == k]).items():
            moments[name][which == k] = values
    return {**given, **moments}


def class_materials(
    classes: Sequence[GrainClass], materials: Materials, otherwise: int = 0
) -> np.ndarray | None:
    """Return the index of the material of each class, ``otherwise`` for classes without a material; None if
    no class has one. Raise InputError for a material that the scene does not have."""
    if all(one.material is None for one in classes):
        return None
    indices = [
        otherwise if one.material is None else materials.index(one.material, f"grains.{k}.material")
        for k, one in enumerate(classes)
    ]
    return np.array(indices)


def check_quantities(classes: Sequence[GrainClass], taken: Collection[str]) -> None:
    """Raise InputError unless all classes give the same quantities, with equal numbers of components, and
    none that is also given elsewhere."""
    for k, one in enumerate(classes):
        where = f"grains.{k}.quantities"
        names, others = (kind.quantity_names() for kind in (one, classes[0]))
        must(names == others, where, "those of the other classes", ", ".join(names))
        for name in one.core.names() if one.core else ():
            rule = "given once, and none that the grains have"
            must(name not in {*taken, *one.quantities}, f"grains.{k}.core", rule, name)
        alike = (one.core is None) == (classes[0].core is None)
        given = Words("none" if one.core is None else "given")
        must(alike, f"grains.{k}.core", "given for all classes or for none", given)
        for name, value in one.quantities.items():
            must(name not in taken, f"{where}.{name}", "given once, and none that the grains have", value)
            components = np.size(classes[0].quantities[name])
            rule = f"of as many components as in the other classes, {components}"
            must(np.size(value) == components, f"{where}.{name}", rule, value)
