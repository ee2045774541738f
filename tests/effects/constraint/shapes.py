"""Scenes of rigid shapes, and NumPy references of their motion."""

import numpy as np
from scipy.integrate import solve_ivp
from scipy.optimize import lsq_linear, minimize, minimize_scalar
from scipy.spatial.transform import Rotation

from tests.scenes import fixed
from tisim import Particles, Scene
from tisim.effects import RigidMixture, RigidRods, RigidSuperquadrics
from tisim.shapes import SpherocylinderShape, SuperquadricShape

D, DENSITY = 1e-3, 2500.0
ROD = SpherocylinderShape(length=4 * D, diameter=D)
BALL = SpherocylinderShape(length=0.0, diameter=2 * D)
EGG = SuperquadricShape(semi_axes=(1e-3, 0.7e-3, 2e-3), exponents=(2.0, 2.0, 2.0))
BRICK = SuperquadricShape(semi_axes=(1e-3, 0.7e-3, 2e-3), exponents=(8.0, 8.0, 8.0))
LYING = Rotation.from_rotvec([0, np.pi / 2, 0]).as_quat(scalar_first=True)
"""An orientation that turns z to x."""


def moving(body, place, effects=(), dt=1e-6, steps=1, density=DENSITY, **more):
    """Bodies of one shape, or of several, rods first; further arguments are those of Particles.of_shapes."""
    names = ("velocity", "orientation", "angular_velocity", "shape", "size", "quantities")
    given = {name: more.pop(name) for name in names if name in more}
    shapes = body if isinstance(body, tuple) else (body,)
    rods = tuple(one for one in shapes if isinstance(one, SpherocylinderShape))
    others = shapes[len(rods) :]
    law = RigidRods(rods=rods) if rods else RigidSuperquadrics(superquadrics=others)
    if rods and others:
        law = RigidMixture(rods=rods, superquadrics=others)
    return Scene(
        particles=Particles.of_shapes(shapes, place, density, **given),
        effects=(law, *effects),
        stepper=more.pop("stepper", fixed(dt)),
        duration=dt * steps,
        **more,
    )


def energy(state):
    """Kinetic energy (J) of all bodies."""
    straight = 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1)).sum()
    return straight + 0.5 * (state["angular_momentum"] * state["spin"]).sum()


def momentum(state):
    """Momentum (kg m/s)."""
    return (state["mass"][:, None] * state["velocity"]).sum(axis=0)


def whole_momentum(state):
    """Angular momentum (kg m^2/s) about the origin."""
    p = state["mass"][:, None] * state["velocity"]
    return (state["angular_momentum"] + np.cross(state["position"], p)).sum(axis=0)


def axis(state, k=2):
    """Principal axis k of each body in space, shape (n, 3)."""
    return Rotation.from_quat(state["orientation"], scalar_first=True).apply(np.eye(3)[k])


def gap(shape, separation, turns):
    """Gap (m), normal from i to j, and both points of contact relative to the centres, of two equal bodies,
    by numerical optimisation."""
    if isinstance(shape, SpherocylinderShape):
        half, radius = shape.length / 2, shape.radius
        ends = np.stack([turns[0].apply([0, 0, half]), -turns[1].apply([0, 0, half])], axis=1)
        a, b = lsq_linear(ends, separation, (-1, 1), method="bvls", tol=1e-15).x
        apart = separation - ends @ [a, b]
        distance = np.linalg.norm(apart)
        n = apart / distance
        return distance - 2 * radius, n, a * ends[:, 0] + radius * n, -b * ends[:, 1] - radius * n

    def points(n):
        return turns[0].apply(shape.support(turns[0].inv().apply(n))), turns[1].apply(
            shape.support(turns[1].inv().apply(-n))
        )

    def unit(x):
        n = first + x[0] * across[0] + x[1] * across[1]
        return n / np.linalg.norm(n)

    def nearer(x):
        n, (here, there) = unit(x), points(unit(x))
        return -(n @ (separation + there - here)) / D

    first, across = separation / np.linalg.norm(separation), []
    across = np.linalg.svd(first[None])[2][1:]
    best = minimize(nearer, [0, 0], method="BFGS", options={"gtol": 1e-11})
    n = unit(best.x)
    here, there = points(n)
    return -best.fun * D, n, here, there


def gap_beside_rod(shapes, separation, turns):
    """The same for a rod and a superquadric that overlap by less than the radius of the rod.

    Where the rod touches between its ends the common normal is across its axis e, at the angle of the largest
    d; otherwise the sphere at one of its ends touches.
    """
    rod, body = shapes
    half, radius, e = rod.length / 2, rod.radius, turns[0].apply([0, 0, 1])
    u = np.linalg.svd(e[None])[2][1]
    across = np.stack([u, np.cross(e, u)])

    def point(n):
        return turns[1].apply(body.support(turns[1].inv().apply(-n)))

    def apart(n, along):
        return n @ (separation + point(n)) - along * (n @ e) - radius

    def at(angle):
        return np.cos(angle) * across[0] + np.sin(angle) * across[1]

    first = np.arctan2(*(across @ separation)[::-1])
    best = minimize_scalar(
        lambda x: -apart(at(x), 0.0) / D, bounds=(first - 1.5, first + 1.5), method="bounded",
        options={"xatol": 1e-12},
    )  # fmt: skip
    n = at(best.x)
    along = (separation + point(n)) @ e
    if abs(along) > half:
        along = np.clip(along, -half, half)
        frame = np.linalg.svd((separation - along * e)[None])[2]
        frame[0] *= np.sign(frame[0] @ separation)

        def unit(x):
            n = frame[0] + x[0] * frame[1] + x[1] * frame[2]
            return n / np.linalg.norm(n)

        n = unit(minimize(lambda x: -apart(unit(x), along) / D, [0, 0], options={"gtol": 1e-11}).x)
    return apart(n, along), n, along * e + radius * n, point(n)


def turning(shape, x, v, turns, spins, contact=gap, h=1e-7):
    """Angular velocity (rad/s) of the normal of a contact, by central differences over h (s)."""
    ahead, behind = (
        contact(shape, x[1] - x[0] + t * (v[1] - v[0]), Rotation.from_rotvec(t * spins) * turns)[1]
        for t in (h, -h)
    )
    return np.cross(ahead + behind, ahead - behind) / (4 * h)


def reference(scene, shape, push, time, grip=0.0, contact=gap):
    """Position, velocity, rotation and angular momentum of two bodies after a time (s), by an ODE solver.
    ``shape`` is the shape of both, or two shapes. They repel each other by ``push(overlap)`` (N) along the
    normal, and stick by a spring ``grip`` (N/m), which rotates with the normal and, about it, with the mean
    of both spins."""
    start, shapes = scene.start(), shape if isinstance(shape, tuple) else (shape, shape)
    mass = start["mass"][:, None]
    moments = mass * [one.moments() for one in shapes]

    def split(y):
        x, v, q, momenta = (part.reshape(2, -1) for part in np.split(y[:26], [6, 12, 20]))
        turns = Rotation.from_quat(q / np.linalg.norm(q, axis=1)[:, None], scalar_first=True)
        return x, v, q, momenta, turns

    def rate(_t, y):
        x, v, q, momenta, turns = split(y)
        apart, n, here, there = contact(shape, x[1] - x[0], turns)
        spins = turns.apply(turns.apply(momenta, inverse=True) / moments)
        force, stretch = push(max(-apart, 0.0)) * n, np.zeros(3)
        if grip > 0 and apart < 0:
            here, there, held = here + apart / 2 * n, there - apart / 2 * n, y[26:]
            slip = v[1] - v[0] + np.cross(spins[1], there) - np.cross(spins[0], here)
            frame = turning(shape, x, v, turns, spins, contact) + n * (spins.mean(axis=0) @ n)
            stretch, force = slip - (slip @ n) * n + np.cross(frame, held), force - grip * held
        change = 0.5 * np.array(
            [[-w @ p[1:], *(p[0] * w + np.cross(w, p[1:]))] for w, p in zip(spins, q, strict=True)]
        )
        torque = np.stack([np.cross(here, -force), np.cross(there, force)])
        pull = np.stack([-force, force]) / mass
        return np.concatenate([v.ravel(), pull.ravel(), change.ravel(), torque.ravel(), stretch])

    names = ("position", "velocity", "orientation", "angular_momentum")
    y = np.concatenate([*(np.asarray(start[name]).ravel() for name in names), np.zeros(3)])
    spin = moments.max() * 100
    scale = np.concatenate([np.full(6, D), np.full(6, 0.1), np.ones(8), np.full(6, spin), np.full(3, D)])
    end = solve_ivp(rate, (0, time), y, "DOP853", rtol=1e-7, atol=1e-7 * scale, max_step=time / 20)
    return split(end.y[:, -1])
