"""Rigid clumps of spheres: templates, and the particles of clumps."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from functools import cached_property
from typing import Any, NamedTuple, Self

import numpy as np
from pydantic import ConfigDict, model_validator
from scipy.optimize import minimize
from scipy.spatial.transform import Rotation as Turn
from scipy.special import logsumexp, softmax

from tisim.components.arrays import Numbers, Rows, equal
from tisim.components.component import Component, parameter
from tisim.components.ranges import LEAST, MOST
from tisim.errors import Words, must
from tisim.geometry.sphere_union import sphere_union

SYMMETRIC, ROUNDED = 1e-9, 1e-12
"""Relative tolerances: for the symmetry of an inertia tensor; and for off-diagonal elements below which axes
are principal, and for the offset of a single sphere from the centre of mass, relative to its radius."""


class ClumpBody(NamedTuple):
    """The mass properties of a clump.

    mass : kg.
    volume : volume of the union of its spheres (m^3).
    moments : principal moments of inertia (kg m^2), shape (3,).
    axes : the principal axes in the template, as columns, shape (3, 3).
    places : positions of its spheres from the centre of mass along the principal axes (m), shape (n, 3).
    masses : masses of its spheres (kg), shape (n,).
    """

    mass: float
    volume: float
    moments: np.ndarray
    axes: np.ndarray
    places: np.ndarray
    masses: np.ndarray


class Clump(Component):
    """A rigid body made of spheres, which may overlap: a template for any number of clumps in a scene.

    With a given density, the body is the union of its spheres: overlapping regions count once in its mass,
    centre and inertia. Alternatively the mass and the inertia are given, and the centres of spheres are
    relative to the centre of mass. Laws act on the spheres. The mass of the body is divided among them, as
    close as possible to the ratio of their volumes (minimum relative entropy) under the constraint that
    gravity acts at the centre of mass.
    """

    model_config = ConfigDict(arbitrary_types_allowed=True)
    centres: Rows = parameter("m", "centres of its spheres", examples=[((0.0, 0.0, 0.0), (1e-3, 0.0, 0.0))])
    radii: Numbers = parameter("m", "radii of its spheres, one for all or one for each", examples=[(1e-3,)])
    density: float | None = parameter("kg/m^3", "density of the body", None, gt=0, examples=[2500.0])
    mass: float | None = parameter("kg", "mass of the body, instead of a density", None, gt=0)
    inertia: Rows | None = parameter(
        "kg m^2", "inertia tensor about the centre of mass, three rows, instead of a density", None
    )

    __hash__ = None  # type: ignore[assignment]

    def __eq__(self, other: object) -> bool:
        if type(other) is not type(self):
            return NotImplemented
        return all(equal(getattr(self, name), getattr(other, name)) for name in type(self).model_fields)

    @model_validator(mode="after")
    def _sound(self) -> Self:
        given = [name for name in ("density", "mass", "inertia") if getattr(self, name) is not None]
        rule = "given density, or mass and inertia"
        must(given in (["density"], ["mass", "inertia"]), "clump", rule, Words(" and ".join(given) or "none"))
        n = len(self.centres)
        must(len(self.radii) in (1, n), "clump.radii", f"one value or {n} of them", len(self.radii))
        must(bool((self.radii > 0).all()), "clump.radii", "greater than 0", float(self.radii.min()))
        apart = np.linalg.norm(self.centres[:, None] - self.centres, axis=2)
        within = apart + self.radius <= self.radius[:, None]
        np.fill_diagonal(within, False)
        must(
            not within.any(), "clump", "of spheres none of which lies within another", Words("one that does")
        )
        if self.inertia is not None:
            tensor = self.inertia
            symmetric = tensor.shape == (3, 3) and np.allclose(tensor, tensor.T, rtol=SYMMETRIC, atol=0)
            least, middle, most = np.linalg.eigvalsh(tensor) if symmetric else (0.0, 0.0, 0.0)
            rule = "symmetric, with moments above 0 of which none is larger than the other two together"
            sound = least > 0 and most <= (least + middle) * (1 + SYMMETRIC)
            must(bool(symmetric and sound), "clump.inertia", rule, tensor.tolist())
        rule = f"from {LEAST:g} to {MOST:g} kg"
        must(LEAST <= self.body.mass <= MOST, "mass of a clump", rule, self.body.mass)
        return self

    @property
    def radius(self) -> np.ndarray:
        """Return the radius of each sphere, m, shape (n,)."""
        return np.broadcast_to(self.radii, len(self.centres))

    @cached_property
    def body(self) -> ClumpBody:
        """Return its mass, its inertia and the positions of its spheres."""
        solid = sphere_union(self.centres, self.radius)
        if self.density is not None:
            mass, inertia = self.density * solid.volume, self.density * solid.inertia
            places = self.centres - solid.centre
        else:
            assert self.mass is not None
            mass, inertia, places = self.mass, np.asarray(self.inertia), self.centres
        moments, axes = _principal(inertia)
        places = places @ axes
        return ClumpBody(mass, solid.volume, moments, axes, places, mass * _shares(places, self.radius))


def length(places: np.ndarray, radii: np.ndarray) -> float:
    """Return the largest distance (m) between opposite surfaces of any two spheres at positions (m, shape (n,
    3))."""
    apart = np.linalg.norm(places[:, None] - places[None], axis=2) + radii[:, None] + radii[None]
    return float(apart.max(initial=0.0))


def _principal(inertia: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return principal moments and axes, as columns of a right-handed system; the template axes if these are
    already principal."""
    off = np.abs(inertia - np.diag(np.diag(inertia))).max()
    if off <= ROUNDED * np.abs(inertia).max():
        return np.diag(inertia).copy(), np.eye(3)
    moments, axes = np.linalg.eigh(inertia)
    axes[:, 0] *= np.sign(np.linalg.det(axes))
    return moments, axes


def _shares(places: np.ndarray, radius: np.ndarray) -> np.ndarray:
    """Return positive mass fractions of the spheres whose centre of mass is 0. They are the closest to the
    volume fractions in relative entropy, s_i = v_i exp(l.r_i) / sum_j v_j exp(l.r_j)."""
    scale = np.linalg.norm(places, axis=1).max()
    if len(places) == 1:
        centred = bool(scale <= ROUNDED * radius[0])
        must(centred, "clump.centres", "0 if mass and inertia of one sphere are given", places[0].tolist())
        return np.ones(1)
    r, weights = places / scale, np.log(radius**3 / (radius**3).sum())
    found = minimize(
        lambda lean: logsumexp(weights + r @ lean),
        np.zeros(3),
        jac=lambda lean: softmax(weights + r @ lean) @ r,
        hess=lambda lean: np.cov(r.T, aweights=softmax(weights + r @ lean), bias=True),
        method="trust-exact",
        options={"gtol": 1e-14, "maxiter": 200},
    )
    shares: np.ndarray = softmax(weights + r @ found.x)
    off = float(np.abs(shares @ r).max())
    must(off < 1e-9, "clump", "one whose centre of mass lies between the centres of its spheres", off)
    return shares


def clump_columns(
    clumps: Clump | Sequence[Clump],
    position: Any,
    velocity: Any = (0.0, 0.0, 0.0),
    orientation: Any = (1.0, 0.0, 0.0, 0.0),
    angular_velocity: Any = (0.0, 0.0, 0.0),
) -> tuple[dict[str, np.ndarray], np.ndarray]:
    """Return the particle quantities of clumps by name, and the number of particles of each clump.

    clumps : the template of each, or one for all.
    position : centres of mass, m, shape (n, 3).
    velocity : velocities of the centres of mass, m/s.
    orientation : quaternions w, x, y, z by which the template is rotated, shape (n, 4).
    angular_velocity : in the space frame, rad/s.

    Velocity, orientation and angular_velocity may be a single row for all clumps.
    """
    place = _rows("position", position, 3)
    n = len(place)
    templates = [clumps] * n if isinstance(clumps, Clump) else list(clumps)
    must(len(templates) == n, "clumps", f"one, or {n} of them", len(templates))
    going, turning = _rows("velocity", velocity, 3, n), _rows("angular_velocity", angular_velocity, 3, n)
    quaternion = _rows("orientation", orientation, 4, n)
    length = np.linalg.norm(quaternion, axis=1)
    must(bool((length > 0).all()), "clumps.orientation", "other than 0", float(length.min()))
    bodies = [template.body for template in templates]
    axes = np.array([body.axes for body in bodies])
    turn = Turn.from_quat(np.roll(quaternion, -1, axis=1)) * Turn.from_matrix(axes)
    matrix, sizes = turn.as_matrix(), np.array([len(body.places) for body in bodies])
    moments, mass = np.array([body.moments for body in bodies]), np.array([body.mass for body in bodies])
    spin_in_body = np.einsum("nji,nj->ni", matrix, turning)
    momentum = np.einsum("nij,nj->ni", matrix, moments * spin_in_body)
    offset = np.concatenate([body.places for body in bodies])
    whose, first = np.repeat(np.arange(n), sizes), np.cumsum(sizes) - sizes
    arm = np.einsum("nij,nj->ni", matrix[whose], offset)
    columns = {
        "position": place[whose] + arm,
        "velocity": going[whose] + np.cross(turning[whose], arm),
        "radius": np.concatenate([template.radius for template in templates]),
        "mass": np.concatenate([body.masses for body in bodies]),
        "spin": turning[whose],
        "body_mass": mass[whose],
        "clump": whose,
        "clump_member": np.arange(len(whose)),
        "clump_first": first[whose],
        "clump_size": sizes[whose],
        "clump_offset": offset,
    }
    columns["clump_volume"] = np.zeros(len(whose))
    columns["clump_volume"][first] = [body.volume for body in bodies]
    for name, values in (
        ("position", place), ("velocity", going), ("orientation", np.roll(turn.as_quat(), 1, axis=1)),
        ("angular_momentum", momentum), ("inertia", moments),
    ):  # fmt: skip
        columns[f"clump_{name}"] = np.zeros((len(whose), values.shape[1]))
        columns[f"clump_{name}"][first] = values
    return columns, sizes


def sphere_columns(mass: np.ndarray) -> dict[str, np.ndarray]:
    """Return the clump quantities, by name, of particles with these masses (kg) that do not belong to a
    clump."""
    n = len(mass)
    none = {name: np.full(n, -1) for name in ("clump", "clump_member", "clump_first")}
    vectors = ("offset", "position", "velocity", "angular_momentum", "inertia")
    return {
        **none,
        "clump_size": np.zeros(n),
        "clump_volume": np.zeros(n),
        "body_mass": mass,
        "spin": np.zeros((n, 3)),
        **{f"clump_{name}": np.zeros((n, 3)) for name in vectors},
        "clump_orientation": np.zeros((n, 4)),
    }


def _rows(name: str, values: Mapping[str, Any] | Any, columns: int, n: int | None = None) -> np.ndarray:
    """Return an array of rows; a single row is repeated n times."""
    try:
        rows = np.atleast_2d(np.asarray(values, float))
    except (TypeError, ValueError):
        rows = np.empty((0, 0))
    wanted = f"of shape (n, {columns})" if n is None else f"of shape ({columns},) or ({n}, {columns})"
    right = rows.shape[1:] == (columns,) and len(rows) > 0 and len(rows) in (len(rows) if n is None else n, 1)
    must(bool(right and np.isfinite(rows).all()), f"clumps.{name}", f"numbers {wanted}", values)
    return rows if n is None else np.broadcast_to(rows, (n, columns))
