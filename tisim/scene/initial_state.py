"""What a scene starts with: particles given one by one, or a cloud of spheres at random."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import ConfigDict, field_serializer, field_validator, model_validator

from tisim.components.arrays import Numbers, Rows, equal, frozen
from tisim.components.component import Component, Text, Vector, option, parameter
from tisim.components.domain import Domain
from tisim.components.materials import Materials
from tisim.components.ranges import LEAST, MOST, PARTICLES, check_memory, limits
from tisim.errors import InputError, abbreviated, must
from tisim.packing.grains import GrainClass, check_quantities, draw, masses, quantity
from tisim.packing.placement import Placement, RandomInDomain
from tisim.scene.initial_velocity import Pulse

Arrays = dict[str, np.ndarray]
"""These are particle quantities by field name: shape (n,) or (n, 3), SI."""

APART = "given beside quantities, and once"


class Start(Component):
    """This is the contract of a starting configuration."""

    contract: ClassVar[bool] = True

    def masses(self, seed: int) -> np.ndarray:
        """Return the mass of each particle, kg, shape (n,), which is known without placing them."""
        raise NotImplementedError(f"{type(self).__name__} must define masses")

    def arrays(self, domain: Domain, seed: int) -> Arrays:
        """Return position (m), velocity (m/s), mass (kg), radius (m) and any further quantity, n of each."""
        raise NotImplementedError(f"{type(self).__name__} must define arrays")

    def material_indices(self, materials: Materials) -> np.ndarray | None:
        """Return the index of the material of each particle, shape (n,), given those of the scene; None where
        all are of the first."""
        return None


class Particles(Start):
    """Particles are given one by one, as lists or arrays.

    Positions and velocities are of shape (n, 3). Of any other quantity one number stands for all particles,
    or n of them are given. Give mass or density, not both. Arrays are copied, and kept as arrays that are not
    writeable.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)
    position: Rows = parameter("m", "positions", examples=[((0.0, 0.0, 0.0),)])
    velocity: Rows = parameter("m/s", "velocities", examples=[((1.0, 0.0, 0.0),)])
    radius: Numbers = parameter("m", "radii, greater than 0", examples=[(1e-3,)])
    mass: Numbers | None = parameter("kg", "masses, greater than 0", None)
    density: float | None = parameter(
        "kg/m^3", "density of all particles, instead of masses", None, gt=0, examples=[2000.0]
    )
    material: Any = option(
        "material of each particle, by its name or its number, from 0, in the scene; one for all, the "
        "first unless given",
        None,
    )
    quantities: Mapping[Text, Any] = option(
        "further fields by name, in SI, such as temperature", default_factory=dict
    )

    # Not that of pydantic, which takes the comparison of two arrays for a truth.
    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(equal(getattr(self, name), getattr(other, name)) for name in type(self).model_fields)

    __hash__ = None  # type: ignore[assignment]

    def __setstate__(self, state: dict[Any, Any]) -> None:
        """Set the state that comes from another process: its arrays are not writeable either."""
        super().__setstate__(state)
        for value in (*self.__dict__.values(), *self.quantities.values()):
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def _column(self, name: str, value: Any, n: int) -> np.ndarray:
        try:
            column = np.asarray(value)
        except (ValueError, RecursionError):
            raise InputError(f"particles.{name} must be numbers; received {abbreviated(value)}") from None
        # Neither text nor whole numbers of more than 64 bits.
        must(column.dtype.kind in "biuf", f"particles.{name}", "numbers", value)
        column = column.astype(float)
        if column.ndim == 0 or column.shape == (1,):
            column = np.full(n, float(column.reshape(-1)[0]))
        must(len(column) == n, f"particles.{name}", f"one value or {n} of them", column.shape)
        must(bool(np.isfinite(column).all()), f"particles.{name}", "finite", _worst(column))
        return column

    @field_validator("quantities")
    @classmethod
    def _frozen(cls, values: Mapping[str, Any]) -> Mapping[str, Any]:
        return {k: frozen(v) if isinstance(v, np.ndarray) else v for k, v in values.items()}

    @field_serializer("quantities", when_used="json")
    def _plain(self, values: Mapping[str, Any]) -> dict[str, Any]:
        return {k: v.tolist() if isinstance(v, np.ndarray) else v for k, v in values.items()}

    @field_validator("material")
    @classmethod
    def _one_or_each(cls, value: Any) -> Any:
        if value is None or isinstance(value, str):
            return value
        column = np.atleast_1d(np.asarray(value))
        must(column.ndim == 1 and column.dtype.kind in "iU", "particles.material", "names or numbers", value)
        return frozen(column) if column.dtype.kind == "i" else tuple(map(str, column))

    @field_serializer("material", when_used="json")
    def _listed(self, value: Any) -> Any:
        return value.tolist() if isinstance(value, np.ndarray) else value

    def material_indices(self, materials: Materials) -> np.ndarray | None:
        if self.material is None:
            return None
        given, where = self.material, "particles.material"
        names = (given,) if isinstance(given, str) else given
        n, indices = (
            len(self.position),
            {name: materials.index(name, where) for name in np.unique(names).tolist()},
        )
        must(len(names) in (1, n), where, f"one, or {n} of them", len(names))
        return np.resize([indices[name] for name in np.asarray(names).tolist()], n)

    @model_validator(mode="after")
    def _sound(self) -> Self:
        self._arrays()
        return self

    def masses(self, seed: int) -> np.ndarray:
        return self._arrays()["mass"]

    def arrays(self, domain: Domain, seed: int) -> Arrays:
        return self._arrays()

    def _arrays(self) -> Arrays:
        n = len(self.position)
        arrays = {
            name: self._column(name, getattr(self, name), n) for name in ("position", "velocity", "radius")
        }
        received = "both" if self.mass is not None else "neither"
        must((self.mass is None) != (self.density is None), "particles", "given mass or density", received)
        farthest = float(np.abs(arrays["position"]).max())
        must(farthest <= MOST, "particles.position", f"at most {MOST:g} m from the origin", farthest)
        check_sizes("radius", "m", arrays["radius"])
        if self.density is not None:
            with np.errstate(over="ignore"):
                arrays["mass"] = 4 / 3 * np.pi * arrays["radius"] ** 3 * self.density
        else:
            arrays["mass"] = self._column("mass", self.mass, n)
        check_sizes("mass", "kg", arrays["mass"])
        for name, value in self.quantities.items():
            must(
                name not in (*arrays, "id"), f"particles.quantities.{name}", "given beside quantities", value
            )
            arrays[name] = self._column(name, value, n)
        return arrays

    def structure(self) -> tuple[Any, ...]:
        return (type(self),)


def _worst(column: np.ndarray) -> float:
    return float(column[~np.isfinite(column)].flat[0]) if not np.isfinite(column).all() else 0.0


def check_sizes(name: str, unit: str, column: np.ndarray) -> None:
    """Raise InputError unless all are above 0 and within the limits of their unit."""
    least, most = limits(unit)
    must(bool((column > 0).all()), f"particles.{name}", "greater than 0", float(column.min()))
    outside = column[(column < least) | (column > most)]
    worst = float(outside[0]) if len(outside) else 0.0
    must(not len(outside), f"particles.{name}", f"from {least:g} to {most:g} {unit}", worst)


class Cloud(Start):
    """A cloud of spheres starts with random velocities.

        v = mean_velocity + deviation * lambda + pulse

    lambda is uniform in -1..1 for each particle and component. The same seed gives the same lambdas whatever
    the other parameters. The spheres are equal, of a radius and a density, or drawn from the grains of a
    mixture: each is of a class by the class's part of the number of grains, with a size of its own.

    Source: Z04 section 7.
    """

    number: int | None = option(
        "number of spheres; left out where the placement fixes it, as a lattice does",
        None,
        gt=0,
        le=PARTICLES,
        examples=[100],
    )
    radius: float | None = parameter("m", "radius of equal spheres", None, examples=[1e-3], gt=0)
    density: float | None = parameter("kg/m^3", "density of equal spheres", None, examples=[2000.0], gt=0)
    grains: tuple[GrainClass, ...] = option("classes of unlike spheres, instead of radius and density", ())
    placement: Placement = option("where the centres lie", RandomInDomain())
    mean_velocity: Vector = parameter("m/s", "mean velocity", (0.0, 0.0, 0.0))
    deviation: Vector = parameter(
        "m/s", "largest deviation from the mean velocity, along each axis", (0.0, 0.0, 0.0)
    )
    pulse: Pulse | None = option("velocities that are added at the start, such as a blast's", None)
    temperature: float = parameter("K", "temperature", 300.0, gt=0)
    material: Text | None = option("material of the spheres; the first of the scene unless given", None)
    specific_charge: float | None = parameter(
        "C/kg", "charge over mass of each sphere; unless given, there is none", None
    )
    quantities: Mapping[Text, float | Vector] = option(
        "further fields by name, in SI; one number or three components, for all", default_factory=dict
    )

    @model_validator(mode="after")
    def _sound(self) -> Self:
        sites = self.placement.sites()
        rule = "given" if sites is None else f"{sites}, as the placement has sites, or left out"
        agrees = self.number is not None if sites is None else self.number in (None, sites)
        must(agrees, "cloud.number", rule, "nothing" if self.number is None else self.number)
        given = [name for name in ("radius", "density", "grains") if getattr(self, name)]
        rule = "given radius and density, or grains"
        must(given in (["radius", "density"], ["grains"]), "cloud", rule, " and ".join(given) or "none")
        own = {"position", "velocity", "radius", "mass", "temperature", "id"}
        own |= {"charge"} if self.specific_charge is not None else set()
        for name, value in self.quantities.items():
            must(name not in own, f"cloud.quantities.{name}", APART, value)
        check_quantities(self.grains, {*own, *self.quantities} - {"temperature"})
        mass, rule = self._equal_mass(), f"from {LEAST:g} to {MOST:g} kg"
        must(mass is None or LEAST <= mass <= MOST, "mass of a particle of the cloud", rule, mass)
        return self

    def count(self) -> int:
        """Return the number of spheres."""
        return self.placement.sites() or self.number or 0

    def _equal_mass(self) -> float | None:
        """Return the mass of each sphere, kg; None of unlike ones."""
        if self.radius is None or self.density is None:
            return None
        return self.density * 4 / 3 * np.pi * self.radius**3

    def material_indices(self, materials: Materials) -> np.ndarray | None:
        index = 0 if self.material is None else materials.index(self.material, "cloud.material")
        return np.full(self.count(), index) if index else None

    def masses(self, seed: int) -> np.ndarray:
        mass = self._equal_mass()
        if mass is None:
            return masses(self.grains, *draw(self.grains, self.count(), seed))
        # All in one place of memory, as the number may be large and a scene is checked before it is run.
        return np.broadcast_to(mass, self.count())

    @np.errstate(over="ignore", invalid="ignore")
    def arrays(self, domain: Domain, seed: int) -> Arrays:
        n = self.count()
        check_memory(f"a cloud of {n} particles", n)
        draws = np.random.Generator(np.random.Philox(seed)).uniform(-1.0, 1.0, (n, 3))
        spheres = self._spheres(n, seed)
        arrays = {
            "position": self.placement.centres(spheres["radius"], domain, seed),
            "velocity": np.asarray(self.mean_velocity) + np.asarray(self.deviation) * draws,
            "temperature": np.full(n, self.temperature),
            **{name: np.repeat([value], n, axis=0).astype(float) for name, value in self.quantities.items()},
            **spheres,
        }
        if self.specific_charge is not None:
            arrays["charge"] = arrays["mass"] * self.specific_charge
        if self.pulse is not None:
            arrays["velocity"] = arrays["velocity"] + self.pulse.velocity(arrays["position"], arrays["mass"])
        for name, values in arrays.items():
            must(bool(np.isfinite(values).all()), f"{name} of the cloud", "finite", _worst(values))
        return arrays

    def _spheres(self, n: int, seed: int) -> Arrays:
        """Return radius and mass of each sphere, and what its class says of it."""
        mass = self._equal_mass()
        if mass is not None:
            return {"radius": np.full(n, self.radius), "mass": np.full(n, mass)}
        which, radius = draw(self.grains, n, seed)
        names = self.grains[0].quantities
        further = {name: quantity(self.grains, name, which) for name in names}
        return {"radius": radius, "mass": masses(self.grains, which, radius), **further}

    def structure(self) -> tuple[Any, ...]:
        return (type(self),)
