"""Grains under Hertz and Mindlin in NumPy: every contact at once, velocity Verlet with half kicks."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np


@dataclass
class TwinLaw:
    """A material, young in Pa.

    levers : "contact" has spins move surfaces that are R - delta / 2 from the centres, where forces act;
    "radius" does as LAMMPS: spins move surfaces at R, where walls act too, and a contact that begins has no
    tangential force if its damping alone is beyond Coulomb's limit.
    """

    young: float
    poisson: float
    restitution: float
    friction: float
    levers: str = "contact"

    def contact(self, normal, overlap, radius, mass, slip, past, dt):
        """Force on each of some contacts, and the elastic part of its tangential one; ``past`` is that of
        before, (n, 3), with sqrt(R* delta) of then, (n, 1)."""
        e, nu, log = self.young, self.poisson, np.log(self.restitution)
        e_star, g_star = e / (2 * (1 - nu**2)), e / (4 * (2 - nu) * (1 + nu))
        loss = -2 * np.sqrt(5 / 6) * log / np.sqrt(log**2 + np.pi**2)
        elastic, was = past[:, :3], past[:, 3]
        circle = np.sqrt(radius * overlap)
        stiff, shear = 2 * e_star * circle, 8 * g_star * circle
        opening = (slip * normal).sum(axis=1)
        across = slip - opening[:, None] * normal
        press = 4 / 3 * e_star * circle * overlap - loss * np.sqrt(stiff * mass) * opening
        drag = (loss * np.sqrt(shear * mass))[:, None] * across

        eased = circle < was
        elastic = np.where(eased[:, None], elastic * (circle / np.where(eased, was, 1))[:, None], elastic)
        flat = elastic - (elastic * normal).sum(axis=1, keepdims=True) * normal
        size, left = np.linalg.norm(elastic, axis=1), np.linalg.norm(flat, axis=1)
        elastic = flat * np.where(left > 0, size / np.where(left > 0, left, 1), 0)[:, None]
        elastic = elastic + shear[:, None] * dt * across
        grip, limit = elastic + drag, self.friction * np.abs(press)
        size = np.linalg.norm(grip, axis=1)
        self.slides = size > limit
        if self.levers == "radius":
            bare = (elastic == 0).all(axis=1)
            limit = np.where(bare, 0, limit)
        held = np.where(self.slides, limit / np.where(size > 0, size, 1), 1)[:, None] * grip
        kept = ~self.slides | bare if self.levers == "radius" else ~self.slides
        elastic = np.where(kept[:, None], elastic, held - drag)
        self.stored = 8 / 15 * e_star * circle * overlap**2 + (elastic**2).sum(axis=1) / (2 * shear + 1e-300)
        return held - press[:, None] * normal, np.column_stack([elastic, circle])


class Grains:
    """Spheres and planes (point, normal), under one material and a constant acceleration.

    Between loads ``past`` and ``held`` keep what contacts remember, of pairs i < j and of grains at planes.
    ``sliding`` and ``sticking`` count contacts of all loads so far. ``virial`` is the sum of r F over
    pairs, J, (3, 3), which presses outwards where it is positive.
    """

    def __init__(self, material, position, velocity, spin, radius, mass, planes=(), acceleration=(0, 0, 0)):
        self.material, self.radius, self.mass = material, np.asarray(radius), np.asarray(mass)
        self.x, self.v, self.w = (np.array(values, float) for values in (position, velocity, spin))
        self.planes = [(np.asarray(p, float), np.asarray(n) / np.linalg.norm(n)) for p, n in planes]
        self.acceleration = np.asarray(acceleration, float)
        n = len(self.x)
        self.past, self.held = np.zeros((n, n, 4)), np.zeros((n, len(self.planes), 4))
        self.sliding = self.sticking = 0
        self.load(0.0)

    def load(self, dt):
        """Sum forces and torques, ``dt`` after the last time."""
        self.force, self.torque = self.mass[:, None] * self.acceleration, np.zeros_like(self.x)
        self.stored = 0.0
        self._pairs(dt)
        for k, plane in enumerate(self.planes):
            self._plane(k, *plane, dt)

    def _contact(self, *contact):
        force, known = self.material.contact(*contact)
        self.sliding += self.material.slides.sum()
        self.sticking += (~self.material.slides).sum()
        self.stored += self.material.stored.sum()
        return force, known

    def apart(self):
        """From i to j: how far each other is, m, and its velocity, m/s, both (n, n, 3)."""
        return self.x[None] - self.x[:, None], self.v[None] - self.v[:, None]

    def _pairs(self, dt):
        gap, passing = self.apart()
        distance = np.linalg.norm(gap, axis=2)
        overlap = self.radius[:, None] + self.radius - distance
        i, j = np.nonzero(np.triu(overlap >= 0, 1))
        delta, a, b = overlap[i, j], self.radius[i], self.radius[j]
        n = gap[i, j] / distance[i, j][:, None]
        arm, other = (a - delta / 2)[:, None], (b - delta / 2)[:, None]
        if self.material.levers == "contact":
            turn = np.cross(arm * self.w[i] + other * self.w[j], n)
        else:
            turn = np.cross(a[:, None] * self.w[i] + b[:, None] * self.w[j], n)
        slip = passing[i, j] - turn
        mass = self.mass[i] * self.mass[j] / (self.mass[i] + self.mass[j])
        force, known = self._contact(n, delta, a * b / (a + b), mass, slip, self.past[i, j], dt)
        self.past[:] = 0
        self.past[i, j] = known
        couple = np.cross(n, force)
        self.virial = -gap[i, j].T @ force
        np.add.at(self.force, i, force)
        np.add.at(self.force, j, -force)
        np.add.at(self.torque, i, arm * couple)
        np.add.at(self.torque, j, other * couple)

    def _plane(self, k, point, normal, dt):
        overlap = self.radius - (self.x - point) @ normal
        (i,) = np.nonzero(overlap >= 0)
        n, arm = np.broadcast_to(-normal, (len(i), 3)), (self.radius[i] - overlap[i] / 2)[:, None]
        if self.material.levers == "radius":
            arm = self.radius[i][:, None]
        slip = -self.v[i] - np.cross(arm * self.w[i], n)
        force, known = self._contact(n, overlap[i], self.radius[i], self.mass[i], slip, self.held[i, k], dt)
        self.held[:, k] = 0
        self.held[i, k] = known
        self.force[i] += force
        self.torque[i] += arm * np.cross(n, force)

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
        """Take grain i away; the others go on as they are."""
        for name in ("x", "v", "w", "radius", "mass", "held"):
            setattr(self, name, np.delete(getattr(self, name), i, axis=0))
        self.past = np.delete(np.delete(self.past, i, axis=0), i, axis=1)
        # Forces are summed again as velocities now are; no time has gone by that contacts remember.
        past, held = self.past.copy(), self.held.copy()
        self.load(0.0)
        self.past, self.held = past, held

    def energy(self):
        """Kinetic, of spin, and stored in contacts, J."""
        moving = (self.mass * (self.v**2).sum(axis=1)).sum()
        return (moving + 0.4 * (self.mass * self.radius**2 * (self.w**2).sum(axis=1)).sum()) / 2 + self.stored
