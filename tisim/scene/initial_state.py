"""The initial state of a scene: the contract, and particles given one by one."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import Any, ClassVar, Self

import numpy as np
from pydantic import ConfigDict, field_serializer, field_validator, model_validator

from tisim.components.arrays import Numbers, RowsOrNone, equal, frozen
from tisim.components.component import Component, Text, option, parameter
from tisim.components.plain_numbers import DEEPEST, broken_rule, plain
from tisim.components.ranges import MOST, limits
from tisim.domains.domain import Box, Domain, Open
from tisim.errors import InputError, Words, abbreviated, must
from tisim.materials.materials import Materials
from tisim.packing.clump import Clump, clump_columns, sphere_columns
from tisim.packing.tried_places import Packing
from tisim.shapes.particle_shape import ParticleShape

Arrays = dict[str, np.ndarray]
"""Particle quantities by field name: shape (n,) or (n, 3), SI."""


FLAGS = ("fixed",)
"""Quantities that may be given as true or false."""


class Start(Component):
    """The contract of an initial state."""

    contract: ClassVar[bool] = True

    def masses(self, seed: int) -> np.ndarray:
        """Return the mass of each particle, kg, shape (n,), without placing the particles."""
        raise NotImplementedError(f"{type(self).__name__} must define masses")

    def unplaced(self, seed: int) -> Arrays:
        """Return the quantities that are known without placing the particles, for all particles or a
        sufficient number: velocity (m/s), mass (kg), radius (m) and further quantities; by default the
        particles are placed in open space."""
        return self.arrays(Open(), seed)

    def arrays(self, domain: Domain, seed: int) -> Arrays:
        """Return position (m), velocity (m/s), mass (kg), radius (m) and further quantities, n of each."""
        raise NotImplementedError(f"{type(self).__name__} must define arrays")

    def packing(self, domain: Domain, seed: int) -> Packing | None:
        """Return the random sequential addition that ``arrays`` needs; None if it needs none."""
        return None

    def material_indices(self, materials: Materials, seed: int) -> np.ndarray | None:
        """Return the material index of each particle, shape (n,), given the materials of the scene; None if
        all have the first material."""
        return None


class Particles(Start):
    """Particles are given one by one, as lists or arrays.

    Positions and velocities have shape (n, 3). Any other quantity is given as one number for all particles or
    as n numbers. Give mass or density, not both. Arrays are copied and stored as read-only arrays. If an
    effect inserts particles later, the initial state may be empty, ``Particles.none()``.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)
    position: RowsOrNone = parameter("m", "positions", examples=[((0.0, 0.0, 0.0),)])
    velocity: RowsOrNone = parameter("m/s", "velocities", examples=[((1.0, 0.0, 0.0),)])
    radius: Numbers = parameter("m", "radii, greater than 0", examples=[(1e-3,)])
    mass: Numbers | None = parameter("kg", "masses, greater than 0", None)
    density: float | None = parameter(
        "kg/m^3", "density of all particles, instead of masses", None, gt=0, examples=[2000.0]
    )
    material: Any = option(
        "material of each particle, by name or by its number in the scene, from 0; one for all particles, "
        "the first unless given",
        None,
    )
    quantities: Mapping[Text, Any] = option(
        "further fields by name, in SI, such as temperature", default_factory=dict
    )

    @classmethod
    def none(cls) -> Self:
        """Return an empty initial state, for a scene in which all particles are inserted later."""
        return cls(position=(), velocity=(), radius=(), mass=())

    @classmethod
    def of_clumps(
        cls,
        clumps: Clump | Sequence[Clump],
        position: Any,
        velocity: Any = (0.0, 0.0, 0.0),
        orientation: Any = (1.0, 0.0, 0.0, 0.0),
        angular_velocity: Any = (0.0, 0.0, 0.0),
        spheres: Particles | None = None,
        box: Box | None = None,
        quantities: Mapping[str, Any] | None = None,
        material: Any = None,
    ) -> Self:
        """Return the member particles of rigid clumps, for a scene with the effect RigidClumps.

        clumps : template of each clump, or of all. position : centres of mass, m, shape (n, 3). velocity :
        velocities of the centres of mass, m/s. orientation : quaternions w, x, y, z that rotate the
        templates, shape (n, 4). angular_velocity : rad/s, in space. For these three, one row may be given for
        all. spheres : particles outside clumps, which follow the members. box : box of the scene, whose
        periodic faces clumps may cross. quantities : further fields of all members, one value for all or one
        for each clump. material : material of the clumps, one for all or one for each, unless all have the
        first material; then ``spheres`` must have materials too.
        """
        columns, sizes = clump_columns(clumps, position, velocity, orientation, angular_velocity)
        for name, value in (quantities or {}).items():
            must(name not in columns, f"clumps.{name}", "a further quantity", value)
            columns[name] = np.repeat(_of_each(f"clumps.{name}", value, len(sizes)), sizes, axis=0)
        materials = None
        if material is not None:
            materials = [*np.repeat(_of_each("clumps.material", material, len(sizes)), sizes)]
        if spheres is not None:
            both = (material is None) == (spheres.material is None)
            must(
                both,
                "material",
                "given for both clumps and the spheres beside them, or for neither",
                material,
            )
            columns = _beside(columns, spheres.masses(0), spheres.arrays(Open(), 0))
            if materials is not None:
                materials += [*_of_each("particles.material", spheres.material, len(spheres.masses(0)))]
        if box is not None:
            low, side, joined = np.array(box.low), np.diff([box.low, box.high], axis=0), box.joined()
            inside = low + (columns["position"] - low) % side
            # The remainder may be rounded up to the whole side.
            inside = np.where(inside < np.array(box.high), inside, low)
            columns["position"] = np.where(joined, inside, columns["position"])
        core = {name: columns.pop(name) for name in ("position", "velocity", "radius", "mass")}
        return cls(**core, quantities=columns, material=materials)

    @classmethod
    def of_shapes(
        cls,
        shapes: ParticleShape | Sequence[ParticleShape],
        position: Any,
        density: float,
        velocity: Any = (0.0, 0.0, 0.0),
        orientation: Any = None,
        angular_velocity: Any = (0.0, 0.0, 0.0),
        shape: Any = 0,
        size: Any = 1.0,
        quantities: Mapping[str, Any] | None = None,
        material: Any = None,
    ) -> Self:
        """Return particles with shapes, for a scene with an effect such as RigidRods.

        shapes : the shapes of that effect, in its order. position : centres, m, shape (n, 3). density :
        kg/m^3, from which masses follow by the volumes of the shapes. velocity : m/s, shape (n, 3).
        orientation : quaternions w, x, y, z that rotate the shapes, shape (n, 4); random ones unless given.
        angular_velocity : rad/s, in space, shape (n, 3). shape : index of the shape of each particle. size :
        size of each particle over the size of its shape. quantities : further fields by name. Except for
        the positions, one row may be given for all.
        """
        centres = np.asarray(position, float)
        known = list(shapes) if isinstance(shapes, list | tuple) else [shapes]
        n, right = len(centres), bool(known) and all(isinstance(one, ParticleShape) for one in known)
        must(right, "particles.shapes", "shapes of tisim.shapes", Words(f"{shapes!r:.80}"))
        kinds = _of_each("particles.shape", shape, n)
        whole = kinds.dtype.kind in "iu" and bool(((kinds >= 0) & (kinds < len(known))).all())
        must(whole, "particles.shape", f"indices of the {len(known)} shapes", shape)
        must(density > 0, "particles.density", "greater than 0", density)
        sizes = _of_each("particles.size", size, n).astype(float)
        bounding, volume = (
            np.array([getattr(one, name)() for one in known])[kinds] for name in ("bounding_radius", "volume")
        )
        spin = np.atleast_2d(np.asarray(angular_velocity, float))
        columns = {"shape": kinds, "spin": _of_each("particles.angular_velocity", spin, n)}
        if orientation is not None:
            turns = _of_each("particles.orientation", np.atleast_2d(np.asarray(orientation, float)), n)
            columns["orientation"] = turns
        return cls(
            position=centres,
            velocity=_of_each("particles.velocity", np.atleast_2d(np.asarray(velocity, float)), n),
            radius=sizes * bounding,
            mass=density * volume * sizes**3,
            material=material,
            quantities={**columns, **(quantities or {})},
        )

    # The comparison of pydantic would use the comparison of two arrays as a truth value.
    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(equal(getattr(self, name), getattr(other, name)) for name in type(self).model_fields)

    __hash__ = None  # type: ignore[assignment]

    def __setstate__(self, state: dict[Any, Any]) -> None:
        """Set the state received from another process; its arrays are made read-only again."""
        super().__setstate__(state)
        for value in (*self.__dict__.values(), *self.quantities.values()):
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    def _column(self, name: str, value: Any, n: int) -> np.ndarray:
        where = f"particles.{name}"
        if name in FLAGS:
            value = np.asarray(value, float) if np.asarray(value).dtype.kind == "b" else value
        rule = broken_rule(value)
        must(not rule, where, rule, value)
        try:
            column = np.asarray(value if isinstance(value, np.ndarray) else plain(where, value))
        except (ValueError, RecursionError):
            raise InputError(f"particles.{name} must be numbers; received {abbreviated(value)}") from None
        # Text, and integers of more than 64 bits, are not numbers here.
        must(column.dtype.kind in "iuf", where, "numbers", value)
        column = column.astype(float)
        if column.ndim == 0 or column.shape == (1,):
            column = np.full(n, float(column.reshape(-1)[0]))
        must(len(column) == n, f"particles.{name}", f"one value or {n} of them", column.shape)
        must(bool(np.isfinite(column).all()), f"particles.{name}", "finite", worst(column))
        return column

    @field_validator("quantities")
    @classmethod
    def _frozen(cls, values: Mapping[str, Any]) -> Mapping[str, Any]:
        for name, value in values.items():
            must(not np.ma.is_masked(value), f"particles.{name}", "without masked entries", value)
        return {k: frozen(v) if isinstance(v, np.ndarray) else _lists(v) for k, v in values.items()}

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

    def material_indices(self, materials: Materials, seed: int) -> np.ndarray | None:
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

    def unplaced(self, seed: int) -> Arrays:
        return self._arrays()

    def arrays(self, domain: Domain, seed: int) -> Arrays:
        return self._arrays()

    def _arrays(self) -> Arrays:
        n = len(self.position)
        arrays = {
            name: self._column(name, getattr(self, name), n) for name in ("position", "velocity", "radius")
        }
        received = Words("both" if self.mass is not None else "neither")
        must((self.mass is None) != (self.density is None), "particles", "given mass or density", received)
        farthest = float(np.abs(arrays["position"]).max(initial=0.0))
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
                name not in (*arrays, "id", "material"),
                f"particles.quantities.{name}",
                "given outside quantities",
                value,
            )
            arrays[name] = self._column(name, value, n)
        return arrays

    def structure(self) -> tuple[Any, ...]:
        return (type(self),)


def _beside(clumps: Arrays, mass: np.ndarray, spheres: Arrays) -> Arrays:
    """Return the quantities of the members of clumps, followed by the quantities of spheres outside clumps,
    which may belong to a group."""
    given = {**sphere_columns(mass), **spheres}
    clumps = {**clumps, **({"group": np.zeros(len(clumps["mass"]))} if "group" in given else {})}
    must(given.keys() == clumps.keys(), "spheres beside clumps", f"given {sorted(clumps)}", sorted(given))
    return {name: np.concatenate([values, given[name]]) for name, values in clumps.items()}


def _lists(value: Any, depth: int = DEEPEST) -> Any:
    """Return a list with its NumPy arrays and numbers converted to Python lists and numbers; other values
    unchanged."""
    if isinstance(value, np.ndarray | np.generic):
        return value.tolist()
    if type(value) not in (list, tuple) or depth == 0:
        return value
    return type(value)(_lists(one, depth - 1) for one in value)


def _of_each(name: str, value: Any, n: int) -> np.ndarray:
    """Return n rows: the given ones, or the given row repeated."""
    rows = np.asarray(value)
    rows = rows[None] if rows.ndim == 0 else rows
    must(len(rows) in (1, n), name, f"one value or {n} of them", len(rows))
    return np.resize(rows, (n, *rows.shape[1:]))


def worst(column: np.ndarray) -> float:
    """Return the first number that is not finite; 0 if all are finite."""
    return float(column[~np.isfinite(column)].flat[0]) if not np.isfinite(column).all() else 0.0


def check_sizes(name: str, unit: str, column: np.ndarray) -> None:
    """Raise InputError unless all values are above 0 and within the limits of their unit."""
    least, most = limits(unit)
    must(bool((column > 0).all()), f"particles.{name}", "greater than 0", float(column.min(initial=np.inf)))
    outside = column[(column < least) | (column > most)]
    first = float(outside[0]) if len(outside) else 0.0
    must(not len(outside), f"particles.{name}", f"from {least:g} to {most:g} {unit}", first)
