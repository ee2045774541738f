"""Grains under a composed contact law in NumPy: every contact at once, velocity Verlet with half kicks."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Any

import numpy as np

from tisim.effects import Granular

ATTACHED, SLIP, ROLL, TWIST, SLOTS = 0, slice(1, 5), slice(5, 9), slice(9, 11), 11
"""Slots of the contact history: whether the contact has begun, and a value and its stiffness for
each part."""
SERIES = ("stiffness", "rolling_stiffness", "twisting_stiffness")


@dataclass
class ReferenceLaw:
    """A contact law: the names of its parts, its materials, and values given for pairs of materials.

    levers : with "contact", spins move the surfaces at R - delta / 2 from the centres, where forces act.
    "radius" does as LAMMPS: spins move surfaces at R, which is also the lever arm at walls; a new contact has
    no tangential or rolling force if its damping alone exceeds the limit; a twisting torque beyond its limit
    opposes the current twist rate; JKR ends at its largest pull; and forces that jump at contact, or at the
    end of JKR, are not spread over two steps. frame : with "turning", springs rotate with the normal and
    about it, by the mean of both spins, and are stretched by the surface motion at mid-step. "projected"
    projects them into the current tangential plane, as LAMMPS does.
    """

    materials: tuple[dict[str, float], ...]
    pairs: dict[tuple[int, int], dict[str, float]] = field(default_factory=dict)
    normal: str = "hertz_material"
    damping: str | None = "restitution_damping"
    tangential: str | None = "mindlin_force"
    rolling: str | None = None
    twisting: str | None = None
    cohesion: str | None = None
    options: dict[str, float] = field(default_factory=dict)
    levers: str = "contact"
    frame: str = "turning"

    def of(self, name, which):
        """A property for each of some pairs of materials, (n, 2)."""
        values = []
        for i, j in which:
            a, b = self.materials[i].get(name), self.materials[j].get(name)
            given = self.pairs.get((i, j), self.pairs.get((j, i), {})).get(name)
            mixed = (
                None if a is None or b is None else 2 / (1 / a + 1 / b) if name in SERIES else (a * b) ** 0.5
            )
            values.append(mixed if given is None else given)
        return np.array(values, float)

    def moduli(self, which):
        """E* and G*."""
        e, nu = (np.array([[m[k] for m in self.materials]])[0][which] for k in ("young", "poisson"))
        return 1 / ((1 - nu**2) / e).sum(axis=1), 1 / (2 * (2 - nu) * (1 + nu) / e).sum(axis=1)

    def gap(self, which, radius):
        """The gap (m) at which an existing contact ends."""
        if self.normal != "jkr":
            return np.zeros(len(radius))
        ratio = np.pi * self.of("surface_energy", which) / self.moduli(which)[0]
        most = 1.5 * ratio ** (2 / 3) * (radius / 2) ** (1 / 3)
        return most / 9 ** (1 / 3) if self.levers == "radius" else most

    def press(self, which, overlap, radius):
        """Radius of the contact circle, S_n, elastic force, F_c, and the stored energy."""
        circle = np.sqrt(radius * np.maximum(overlap, 0))
        if self.normal == "hooke":
            k = self.of("stiffness", which)
            return circle, k, k * overlap, 0 * k, k * overlap**2 / 2
        e_star, _ = self.moduli(which)
        if self.normal == "hertz_material":
            stored = 8 / 15 * e_star * circle * overlap**2
            return circle, 2 * e_star * circle, 4 / 3 * e_star * circle * overlap, 0 * circle, stored
        energy = self.of("surface_energy", which)
        line, circle = 2 * radius * np.sqrt(np.pi * energy / e_star), np.zeros(len(radius))
        for k in range(len(radius)):
            roots = np.roots([1, 0, 0, -line[k], -radius[k] * overlap[k]])
            circle[k] = roots.real[np.abs(roots.imag) < 1e-6 * np.abs(roots)].max() ** 2
        force = 4 * e_star * circle**3 / (3 * radius) - 4 * np.sqrt(np.pi * energy * e_star * circle**3)
        return circle, 2 * e_star * circle, force, 3 * np.pi * energy * radius, np.nan * force

    def loss(self, which, stiffness, mass):
        """gamma_n."""
        if self.damping is None:
            return 0 * mass
        if self.damping == "constant_damping":
            return self.of("damping", which)
        if self.damping == "viscoelastic_damping":
            return self.of("viscous_time", which) * stiffness
        e = self.of("restitution", which)
        # To rounding, the damping of e = 0.
        log = np.log(np.maximum(e, 1e-300)) * np.where(e > 0, 1, 1e9)
        shape = 1.0 if self.normal == "hooke" else np.sqrt(5 / 6)
        return -2 * shape * log / np.sqrt(np.pi**2 + log**2) * np.sqrt(stiffness * mass)

    def pull(self, which, radius, overlap):
        """Cohesive force."""
        if self.cohesion == "sjkr":
            return self.of("cohesion_energy_density", which) * 2 * np.pi * radius * overlap
        return 4 * np.pi * self.of("surface_energy", which) * radius if self.cohesion == "dmt" else 0 * radius

    @property
    def turns(self):
        """Whether springs also rotate about the normal."""
        springs = {"mindlin_force", "mindlin_displacement", "linear_spring"}
        held = self.tangential in springs or self.twisting or self.rolling in ("rolling_sds", "rolling_epsd")
        return bool(held) and self.frame == "turning" and self.levers == "contact"

    def contact(self, which, normal, overlap, radius, mass, slip, spinning, way, past, dt):
        """Force and torque for each of some contacts, and their new history. ``which`` : the materials in
        contact, (n, 2). ``way`` : the rotation in the step, tilt of the normal and half of the turn about it.
        """
        tilt, turn = way
        if self.turns:
            carry, past = carrying(normal, tilt, turn), past.copy()
            for part in (slice(1, 4), slice(5, 8)):
                past[:, part] = (carry @ past[:, part, None])[..., 0]
        known = np.zeros_like(past)
        known[:, ATTACHED] = 1
        circle, stiffness, elastic, parting, self.stored = self.press(which, overlap, radius)
        damping = self.loss(which, stiffness, mass)
        opening = (slip * normal).sum(axis=1)
        pull = self.pull(which, radius, overlap)
        press = elastic - damping * opening
        limit = np.abs(press)
        if self.normal == "jkr":
            limit = np.abs(elastic + 2 * parting)
        if self.cohesion == "dmt":
            limit = np.abs(elastic - pull + 2 * pull)
        if self.levers == "contact":
            speed = np.abs(opening)
            if self.cohesion == "dmt":
                pull = pull * spread(overlap, speed, dt, pull, mass)
            if self.normal == "jkr":
                begun, last = past[:, ATTACHED], overlap + self.gap(which, radius)
                first, other = 8 / 9 * parting, 5 / 9 * parting
                begins = np.where(begun < 1, 1 - spread(overlap, speed, dt, first, mass), 0)
                ends = np.where(opening > 0, 1 - spread(last, speed, dt, other, mass), 0)
                press = press + first * begins + other * ends
                new = (begun < 1) & (opening < 0) & (overlap < 2 * speed * dt)
                known[:, ATTACHED] = np.where(new, 0.5, 1)
        force, couple = -(press - pull)[:, None] * normal, np.zeros_like(normal)
        spring, drag, friction = self.tangential_constants(which, stiffness, damping)
        if self.tangential:
            across, form = slip - opening[:, None] * normal, "force"
            if self.tangential in ("mindlin_displacement", "linear_spring"):
                form = "displacement"
            grip, known[:, SLIP], self.slides = spring_and_slider(
                past[:, SLIP],
                normal,
                across,
                spring,
                drag,
                friction * limit,
                dt,
                form,
                self.levers,
                self.turns,
            )
            force = force + grip
            if self.tangential == "viscous_friction":
                known[:, SLIP] = 0
            with np.errstate(divide="ignore", invalid="ignore"):
                size = (known[:, 1:4] ** 2).sum(axis=1)
                own = size / (2 * spring) if form == "force" else spring * size / 2
            self.stored = self.stored + np.where(spring > 0, own, 0)
        if self.rolling:
            rolling = radius[:, None] * np.cross(spinning, normal)
            if self.turns:
                rolling = radius[:, None] * np.cross(spinning, normal + tilt)
                rolling = seen_midway(rolling, normal, tilt, turn)
            roll, known[:, ROLL] = self.rolled(
                which, normal, stiffness, mass, limit, rolling, past[:, ROLL], dt
            )
            couple = couple + radius[:, None] * np.cross(normal, roll)
        if self.twisting:
            twist = self.twisted(
                which,
                circle,
                spring,
                drag,
                friction,
                limit,
                (spinning * (normal + tilt)).sum(axis=1),
                past[:, TWIST],
                dt,
            )
            couple, known[:, TWIST] = couple + twist[0][:, None] * normal, twist[1]
        return force, couple, known

    def tangential_constants(self, which, stiffness, damping):
        """S_t, gamma_t and mu."""
        zero = 0 * stiffness
        if self.tangential is None:
            return zero, zero, zero
        friction = self.of("friction", which)
        if self.tangential == "viscous_friction":
            return zero, self.options.get("damping_ratio", 1.0) * damping, friction
        if self.tangential == "linear_spring":
            ratio = self.options.get("stiffness_ratio", 2 / 7)
        else:
            e_star, g_star = self.moduli(which)
            ratio = 4 * g_star / e_star
        return ratio * stiffness, np.sqrt(ratio) * damping, friction

    def rolled(self, which, normal, stiffness, mass, limit, rolling, past, dt):
        """The force F for which R* n x F is the rolling torque, and the new history."""
        most = self.of("rolling_friction", which) * limit
        if self.rolling == "rolling_cdt":
            speed = np.linalg.norm(rolling, axis=1)
            return (most / np.where(speed > 0, speed, np.inf))[:, None] * rolling, 0 * past
        if self.rolling == "rolling_sds":
            spring, form = self.of("rolling_stiffness", which), "displacement"
            drag = self.of("rolling_damping", which)
        else:
            spring, form = 2.25 * self.of("rolling_friction", which) ** 2 * stiffness, "force"
            drag = 2 * self.options.get("rolling_damping_ratio", 0.3) * np.sqrt(spring * mass)
        return spring_and_slider(
            past, normal, rolling, spring, drag, most, dt, form, self.levers, self.turns
        )[:2]

    def twisted(self, which, circle, spring, drag, friction, limit, twisting, past, dt):
        """The twisting torque, and the new history."""
        if self.twisting == "twisting_sds":
            stiffness, arm = self.of("twisting_stiffness", which), self.of("twisting_friction", which)
            damping, elastic = self.of("twisting_damping", which), past[:, 0]
        else:
            stiffness, damping, arm = spring * circle**2 / 2, drag * circle**2 / 2, 2 / 3 * circle * friction
            was = past[:, 1]
            share = np.where(stiffness < was, stiffness / np.where(was > 0, was, 1), 1)
            elastic = np.where(was > 0, share, 1) * past[:, 0]
        elastic = elastic + stiffness * dt * twisting
        total, most = elastic + damping * twisting, arm * limit
        held = np.clip(total, -most, most)
        if self.levers == "radius":
            held = np.where(np.abs(total) > most, np.sign(twisting) * most, total)
        elastic = np.where(held == total, elastic, held - damping * twisting)
        return held, np.column_stack([elastic, stiffness])


def spread(depth, speed, dt, force, mass):
    """The factor on a force that jumps at depth 0. With it, the work does not depend on the depth in the
    first step of contact. The factor is 1 if the force hardly changes the speed in a step, or reverses it."""
    moves = (force * dt < mass * speed) & (force * dt > 1e-6 * mass * speed)
    s = np.maximum(depth, 0) / np.where(moves, speed * dt, np.nan)
    return np.where(s < 1, 1.5 * s, np.where(s < 2, 2 - s / 2, 1.0))


def cross(n):
    """The matrices of n x, (k, 3, 3)."""
    return np.cross(np.eye(3), n[:, None])


def carrying(normal, tilt, turn):
    """Matrices that rotate springs in a step: from the previous tangential plane to the current one, along
    the normal at mid-step (by R. Cayley's formula for the turn about it)."""
    flat = np.eye(3) - np.einsum("na,nb->nab", normal + tilt, normal)
    k = turn[:, None, None] * cross(normal)
    return np.linalg.solve(np.eye(3) - k, (np.eye(3) + k) @ flat)


def seen_midway(slip, normal, tilt, turn):
    """The part of slip perpendicular to the normal at mid-step, rotated by half of the step, so that it is
    perpendicular to the current normal."""
    along = (slip * normal).sum(axis=1)[:, None]
    return slip - along * (normal + tilt) + turn[:, None] * np.cross(normal, slip)


def spring_and_slider(past, normal, velocity, spring, drag, most, dt, form, levers="contact", carried=False):
    """Force of a spring, a dashpot and a slider, and their new history: force or displacement, and
    stiffness."""
    held, was = past[:, :3], past[:, 3]
    if form == "force":
        eased = (spring < was) & (was > 0)
        held = held * np.where(eased, spring / np.where(was > 0, was, 1), 1)[:, None]
    flat = held - (held * normal).sum(axis=1, keepdims=True) * normal
    size, left = np.linalg.norm(held, axis=1), np.linalg.norm(flat, axis=1)
    if not carried:
        held = flat * np.where(left > 0, size / np.where(left > 0, left, 1), 0)[:, None]
    held = held + (dt * velocity if form == "displacement" else (spring * dt)[:, None] * velocity)
    elastic = held if form == "force" else spring[:, None] * held
    damped = drag[:, None] * velocity
    total = elastic + damped
    size = np.linalg.norm(total, axis=1)
    slides = size > most
    bare = (elastic == 0).all(axis=1) & (spring > 0) & (levers == "radius")
    limit = np.where(bare, 0, most)
    total = np.where(slides, limit / np.where(size > 0, size, 1), 1)[:, None] * total
    left = total - damped
    if form == "displacement":
        left = left / np.where(spring > 0, spring, np.inf)[:, None]
    held = np.where((slides & ~bare)[:, None], left, held)
    return total, np.column_stack([held, spring]), slides


def law_of(scene, levers="contact"):
    """The contact law of a scene."""
    (law,) = (effect for effect in scene.effects if isinstance(effect, Granular))
    names, parts = list(scene.materials), law.members()
    given = {
        tuple(names.index(one) for one in name.split("-")): pair.model_dump(exclude_none=True)
        for name, pair in scene.material_pairs.items()
    }
    options = {
        "stiffness_ratio": getattr(law.tangential, "stiffness_ratio", None),
        "damping_ratio": getattr(law.tangential, "damping_ratio", None),
        "rolling_damping_ratio": getattr(law.rolling, "damping_ratio", None),
    }
    kinds = {
        name: parts[name].kind() if name in parts else None
        for name in ("normal", "damping", "tangential", "rolling", "twisting", "cohesion")
    }
    materials = tuple(material.model_dump(exclude_none=True) for material in scene.materials.values())
    return ReferenceLaw(materials, given, **kinds, options=options, levers=levers, frame=law.frame)


def hertz_mindlin(young, poisson, restitution, friction, levers="contact"):
    """The law of Hertz and Mindlin between grains of one material; young in Pa."""
    material = {"young": young, "poisson": poisson, "restitution": restitution, "friction": friction}
    return ReferenceLaw((material,), levers=levers)


class Grains:
    """Spheres and planes (point, normal), under one law and a constant acceleration.

    turning : (angular velocity, centre) of all planes; the rotation must map each plane onto itself. material
    : index of each grain's material; planes have the first. ``past`` and ``held`` keep the contact history
    between loads, for pairs i < j and for grains at planes. ``sliding`` and ``sticking`` count contacts of
    all loads so far. ``virial`` is the sum of r F over pairs, J, (3, 3); it is positive for repulsion.
    """

    law: Any

    def __init__(
        self, law, position, velocity, spin, radius, mass, planes=(), acceleration=(0, 0, 0), material=None,
        turning=((0, 0, 0), (0, 0, 0)),
    ):  # fmt: skip
        self.law, self.radius, self.mass = law, np.asarray(radius), np.asarray(mass)
        self.x, self.v, self.w = (np.array(values, float) for values in (position, velocity, spin))
        self.planes = [(np.asarray(p, float), np.asarray(n) / np.linalg.norm(n)) for p, n in planes]
        self.acceleration, n = np.asarray(acceleration, float), len(self.x)
        self.turning = np.asarray(turning, float)
        self.material = np.zeros(n, int) if material is None else np.asarray(material)
        self.past, self.held = np.zeros((n, n, SLOTS)), np.zeros((n, len(self.planes), SLOTS))
        self.sliding = self.sticking = 0
        self.load(0.0)

    def load(self, dt):
        """Sum forces and torques, ``dt`` after the last call."""
        self.force, self.torque = self.mass[:, None] * self.acceleration, np.zeros_like(self.x)
        self.stored = 0.0
        self._pairs(dt)
        for k, plane in enumerate(self.planes):
            self._plane(k, *plane, dt)

    def _contact(self, *contact):
        force, couple, known = self.law.contact(*contact)
        if self.law.tangential:
            self.sliding += self.law.slides.sum()
            self.sticking += (~self.law.slides).sum()
        self.stored += self.law.stored.sum()
        return force, couple, known

    def apart(self):
        """Relative positions, m, and velocities, m/s, from i to j, both (n, n, 3)."""
        return self.x[None] - self.x[:, None], self.v[None] - self.v[:, None]

    def lasting(self, which, overlap, radius, attached):
        """Which pairs are in contact."""
        return (overlap >= 0) | ((attached > 0) & (overlap >= -self.law.gap(which, radius)))

    def _pairs(self, dt):
        gap, passing = self.apart()
        distance = np.linalg.norm(gap, axis=2)
        i, j = np.triu_indices(len(self.x), 1)
        overlap, reduced = (self.radius[:, None] + self.radius - distance)[i, j], self.radius[:, None]
        reduced = (reduced * self.radius / (reduced + self.radius))[i, j]
        near = np.nonzero((overlap >= 0) | (self.past[i, j, ATTACHED] > 0))[0]
        i, j, overlap, reduced = i[near], j[near], overlap[near], reduced[near]
        lasts = self.lasting(
            self.material[np.column_stack([i, j])], overlap, reduced, self.past[i, j, ATTACHED]
        )
        i, j, delta, reduced = i[lasts], j[lasts], overlap[lasts], reduced[lasts]
        a, b, which = self.radius[i], self.radius[j], self.material[np.column_stack([i, j])]
        n = gap[i, j] / distance[i, j][:, None]
        arm, other = (a - delta / 2)[:, None], (b - delta / 2)[:, None]
        if self.law.levers == "contact":
            turn = np.cross(arm * self.w[i] + other * self.w[j], n)
        else:
            turn = np.cross(a[:, None] * self.w[i] + b[:, None] * self.w[j], n)
        slip, spinning = passing[i, j] - turn, self.w[j] - self.w[i]
        tilt, half = 0 * n, 0 * delta
        if self.law.turns:
            far, along = distance[i, j], (passing[i, j] * n).sum(axis=1)
            back = dt / 2 / far
            tilt = ((1 + back * along) * back)[:, None] * (along[:, None] * n - passing[i, j])
            half = dt / 4 * ((self.w[i] + self.w[j]) * n).sum(axis=1)
            # Lever arms are proportional parts of the line between the centres at mid-step.
            lain = gap[i, j] - dt / 2 * passing[i, j]
            arms = (arm * self.w[i] + other * self.w[j]) / far[:, None]
            slip = seen_midway(passing[i, j] - np.cross(arms, lain), n, tilt, half) + along[:, None] * n
        mass = self.mass[i] * self.mass[j] / (self.mass[i] + self.mass[j])
        force, couple, known = self._contact(
            which, n, delta, reduced, mass, slip, spinning, (tilt, half), self.past[i, j], dt
        )
        self.past[:] = 0
        self.past[i, j] = known
        moment = np.cross(n, force)
        self.virial = -gap[i, j].T @ force
        np.add.at(self.force, i, force)
        np.add.at(self.force, j, -force)
        np.add.at(self.torque, i, arm * moment + couple)
        np.add.at(self.torque, j, other * moment - couple)

    def _plane(self, k, point, normal, dt):
        overlap = self.radius - (self.x - point) @ normal
        which = np.column_stack([self.material, 0 * self.material])
        (i,) = np.nonzero(self.lasting(which, overlap, self.radius, self.held[:, k, ATTACHED]))
        n, arm = np.broadcast_to(-normal, (len(i), 3)), (self.radius[i] - overlap[i] / 2)[:, None]
        if self.law.levers == "radius":
            arm = self.radius[i][:, None]
        rate, centre = self.turning
        tilt = -dt / 2 * np.cross(rate, n) * self.law.turns
        # The wall too is taken at its position at mid-step.
        surface = np.cross(rate, self.x[i] + arm * (n + tilt) - dt / 2 * self.v[i] - centre)
        slip, spinning = surface - self.v[i] - np.cross(arm * self.w[i], n + tilt), rate - self.w[i]
        half = dt / 4 * ((self.w[i] + rate) * n).sum(axis=1)
        if self.law.turns:
            along = ((surface - self.v[i]) * n).sum(axis=1)[:, None]
            slip = seen_midway(slip, n, tilt, half) + along * n
        force, couple, known = self._contact(
            which[i], n, overlap[i], self.radius[i], self.mass[i], slip, spinning, (tilt, half),
            self.held[i, k], dt,
        )  # fmt: skip
        self.held[:, k] = 0
        self.held[i, k] = known
        self.force[i] += force
        self.torque[i] += arm * np.cross(n, force) + couple

    def run(self, steps, dt):
        """Take some steps of dt (s)."""
        inertia = 0.4 * (self.mass * self.radius**2)[:, None]
        for _ in range(steps):
            self.v += dt / 2 * self.force / self.mass[:, None]
            self.w += dt / 2 * self.torque / inertia
            self.x += dt * self.v
            self.load(dt)
            self.v += dt / 2 * self.force / self.mass[:, None]
            self.w += dt / 2 * self.torque / inertia

    def remove(self, i):
        """Remove grain i; the others continue unchanged."""
        for name in ("x", "v", "w", "radius", "mass", "held", "material"):
            setattr(self, name, np.delete(getattr(self, name), i, axis=0))
        self.past = np.delete(np.delete(self.past, i, axis=0), i, axis=1)
        # Forces are computed again with the current velocities. No time has passed, so the history is
        # unchanged.
        past, held = self.past.copy(), self.held.copy()
        self.load(0.0)
        self.past, self.held = past, held

    def energy(self):
        """Kinetic and spin energy, and energy stored in contacts, J."""
        moving = (self.mass * (self.v**2).sum(axis=1)).sum()
        return (moving + 0.4 * (self.mass * self.radius**2 * (self.w**2).sum(axis=1)).sum()) / 2 + self.stored
