"""What grains are drawn from: classes of a mixture, each with its sizes, its density and its share."""

from __future__ import annotations

from collections.abc import Collection, Iterator, Mapping, Sequence
from typing import Self

import numpy as np
from pydantic import model_validator

from tisim.components.component import Component, Text, Vector, option, parameter
from tisim.components.ranges import LEAST, MOST
from tisim.errors import must
from tisim.materials.materials import Materials
from tisim.numerics.random_streams import GRAIN_SIZES
from tisim.packing.clump import Clump
from tisim.packing.size_laws import EqualSizes
from tisim.packing.sizes import SizeDistribution


class GrainClass(Component):
    """A class of grains is one of those that a mixture is made of.

    A class with a share x of the mass, density rho and sizes with the mean <r^3> over their number has
    x / (rho <r^3>) of the number of grains, up to a factor that is the same for all classes. Where it has a
    shape, its grains are rigid clumps like that, of any size: the radius of one is that of a ball of the same
    volume.
    """

    sizes: SizeDistribution = option("sizes of its grains", examples=[EqualSizes(radius=1e-3)])
    density: float = parameter("kg/m^3", "density of its grains", examples=[2500.0], gt=0)
    share: float = parameter(
        "", "its share of the mass of the mixture; shares are divided by their sum", 1.0, gt=0
    )
    clump: Clump | None = option(
        "shape of its grains, a rigid clump, whose size and mass do not count; spheres unless given", None
    )
    material: Text | None = option(
        "material of its grains; unless given, that of the cloud, or the first of the scene", None
    )
    quantities: Mapping[Text, float | Vector] = option(
        "further fields of its grains by name, in SI, such as temperature", default_factory=dict
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
        return self

    def spheres(self) -> np.ndarray:
        """Return the spheres of a grain of the radius 1: place from the centre of mass along the principal
        axes, radius, and part of the mass; shape (n, 5)."""
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
        """Return how far a grain of radius 1 reaches from its centre of mass."""
        spheres = self.spheres()
        return float((np.linalg.norm(spheres[:, :3], axis=1) + spheres[:, 3]).max())

    def _clump_radius(self) -> float:
        """Return the radius (m) of a ball of the volume of the clump as it is given."""
        assert self.clump is not None
        return float(np.cbrt(self.clump.body.volume * 3 / (4 * np.pi)))

    def number(self) -> float:
        """Return how many grains it has for each kg of share."""
        return self.share / (self.density * 4 / 3 * np.pi * self.sizes.mean_cube())


def draw(classes: Sequence[GrainClass], number: int, seed: int) -> tuple[np.ndarray, np.ndarray]:
    """Return the class, by its index, and the radius (m) of each of a number of grains, drawn independently.

    They depend on the arguments alone, and the first of many are those of few.
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


def quantity(classes: Sequence[GrainClass], name: str, which: np.ndarray) -> np.ndarray:
    """Return a quantity that all classes give, for grains of these classes."""
    return np.array([one.quantities[name] for one in classes], float)[which]


def class_materials(
    classes: Sequence[GrainClass], materials: Materials, otherwise: int = 0
) -> np.ndarray | None:
    """Return the index of the material of each class, ``otherwise`` where it has none of its own; None where
    no class has one. Raise InputError for one that the scene does not have."""
    if all(one.material is None for one in classes):
        return None
    indices = [
        otherwise if one.material is None else materials.index(one.material, f"grains.{k}.material")
        for k, one in enumerate(classes)
    ]
    return np.array(indices)


def check_quantities(classes: Sequence[GrainClass], taken: Collection[str]) -> None:
    """Raise InputError unless all classes give the same quantities, with as many components, and none that
    is given otherwise."""
    for k, one in enumerate(classes):
        names, where = sorted(one.quantities), f"grains.{k}.quantities"
        must(names == sorted(classes[0].quantities), where, "those of the other classes", ", ".join(names))
        for name, value in one.quantities.items():
            must(name not in taken, f"{where}.{name}", "given once, and none that the grains have", value)
            components = np.size(classes[0].quantities[name])
            rule = f"of as many components as in the other classes, {components}"
            must(np.size(value) == components, f"{where}.{name}", rule, value)
