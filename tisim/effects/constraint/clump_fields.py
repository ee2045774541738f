"""Fields of the particles of clumps, and the checks of a start that contains clumps."""

from __future__ import annotations

from collections.abc import Mapping

import numpy as np
from scipy.spatial.transform import Rotation as Turn

from tisim.backend import runtime
from tisim.domains.domain import Domain
from tisim.effects.base import Field
from tisim.effects.base.constraint import BODY_MASS
from tisim.errors import Words, must
from tisim.packing.clump import length

NO_CLUMP = -1
"""Value of ``clump`` for a particle that belongs to no clump."""
MEMBERSHIP = (
    Field("clump", "", 1, "keep", integer=True, default=NO_CLUMP),
    Field("clump_member", "", 1, "keep", integer=True, default=NO_CLUMP),
    Field("clump_first", "", 1, "keep", integer=True, default=NO_CLUMP),
    Field("clump_size", "", 1, "keep", integer=True, default=0),
    Field("clump_offset", "m", 3, "keep"),
)
"""Fields of each particle: the number of its clump, its own number among the members of all clumps, the
number of the first member of its clump, the number of members of the clump, and its position in the body
along the principal axes."""
BODY = (
    Field("clump_position", "m", 3, "keep"),
    Field("clump_velocity", "m/s", 3, "keep"),
    Field("clump_orientation", "", 1, "keep", slots=4),
    Field("clump_angular_momentum", "kg m^2/s", 3, "keep"),
    Field("clump_inertia", "kg m^2", 3, "keep"),
    Field("clump_volume", "m^3", 1, "keep"),
)
"""Fields of the body, stored on the first member of a clump: centre of mass, its velocity, orientation as a
unit quaternion w, x, y, z from the principal axes to space, angular momentum in space, principal moments,
volume of the union of its members."""
BODY_BEFORE = Field("clump_orientation_before", "", 1, "keep", slots=4, scratch=True)
"""The orientation at the beginning of a step."""
APART = 1e-4
"""Tolerance of the positions of members, over a radius, of their velocities, over the largest speed, and of
the length of quaternions; rounding in single precision is smaller."""


def longest_clump(start: Mapping[str, np.ndarray]) -> float:
    """Return the largest length (m) of a clump of a start, from surface to surface of two of its spheres."""
    held = np.flatnonzero(start["clump"] != NO_CLUMP)
    held = held[np.argsort(start["clump"][held], kind="stable")]
    longest = 0.0
    for members in np.split(held, np.flatnonzero(np.diff(start["clump"][held])) + 1):
        places, radii = start["clump_offset"][members], start["radius"][members]
        longest = max(longest, length(places, radii))
    return longest


def check_clumps(start: Mapping[str, np.ndarray], domain: Domain) -> None:
    """Raise InputError unless the particles of a start are complete clumps, consistent with their bodies, and
    single particles."""
    names = [field.name for field in (BODY_MASS, *MEMBERSHIP, *BODY)]
    given = [name for name in names if name in start]
    must(given == names, "particles", "made by Particles.of_clumps with effects.rigid_clumps", given)
    held = np.flatnonzero(start["clump"] != NO_CLUMP)
    held = held[np.argsort(start["clump_member"][held])]
    clump, member, first, size = (start[field.name][held] for field in MEMBERSHIP[:4])
    # Kernels use these as memory indices, so all must be consistent with the first members. Clumps that have
    # left leave gaps; numbers of members are below the number of all particles that have existed.
    number, leads = np.arange(len(held)), np.flatnonzero(member == first)
    sizes = np.diff([*leads, len(held)])
    most = int(start["id"].max()) + 1 if "id" in start else len(start["mass"])
    whole = sizes.sum() == len(held) and bool((np.diff(member) > 0).all())
    whole = whole and all(not len(held) or 0 <= x.min() <= x.max() < most for x in (member, clump))
    if whole:
        firsts, lead = np.repeat(member[leads], sizes), np.repeat(leads, sizes)
        rows = ((first, firsts), (member, firsts + number - lead), (size, np.repeat(sizes, sizes)))
        whole = all(np.array_equal(values, right) for values, right in rows)
        whole = whole and np.array_equal(clump, clump[lead]) and len(np.unique(clump)) == len(leads)
    must(whole, "particles", "whole clumps, as Particles.of_clumps makes them", Words("others"))
    if len(held):
        _check_bodies(start, domain, held, np.repeat(held[leads], sizes))


@np.errstate(over="ignore", invalid="ignore", divide="ignore")
def _check_bodies(
    start: Mapping[str, np.ndarray], domain: Domain, held: np.ndarray, leader: np.ndarray
) -> None:
    """Raise InputError unless members of clumps agree with the bodies, whose fields their ``leader``
    holds."""
    position, velocity, quaternion, momentum, inertia = (start[field.name][leader] for field in BODY[:5])
    length = np.linalg.norm(quaternion, axis=1)
    off = float(np.abs(length - 1).max())
    must(off <= APART, "particles.clump_orientation", "of length 1", off)
    must(bool((inertia > 0).all()), "particles.clump_inertia", "greater than 0", float(inertia.min()))
    turn = Turn.from_quat(np.roll(quaternion, -1, axis=1))
    arm = turn.apply(start["clump_offset"][held])
    spin = turn.apply(turn.inv().apply(momentum) / inertia)
    around = np.cross(spin, arm)
    largest = np.finfo(np.float64 if runtime.precision() == "f64" else np.float32).max
    fast = ~(np.abs([spin, around]) <= largest).all(axis=(0, 2))
    worst = float(np.abs(momentum[fast]).max(initial=0.0))
    rule = "so small that spin and velocities of the members of its clump are finite"
    must(not fast.any(), "particles.clump_angular_momentum", rule, worst)
    apart = start["position"][held] - position - arm
    low, high = domain.bounds()
    if low is not None and high is not None:
        turns = np.round(apart / (high - low)) * (high - low)
        apart = np.where(domain.joined(), apart - turns, apart)
    rule = "where their clumps are, as Particles.of_clumps makes them"
    near = np.linalg.norm(apart, axis=1) <= APART * start["radius"][held]
    must(bool(near.all()), "particles.position", rule, Words("one elsewhere"))
    # The squares of large velocities overflow, but not their norms.
    lag = np.hypot.reduce(start["velocity"][held] - velocity - around, axis=1)
    fastest = np.hypot.reduce(velocity, axis=1).max() + np.hypot.reduce(around, axis=1).max()
    alike = (lag <= APART * fastest) & np.isfinite(lag)
    must(
        bool(alike.all()),
        "particles.velocity",
        "those of their clumps, as Particles.of_clumps makes them",
        Words("others"),
    )
