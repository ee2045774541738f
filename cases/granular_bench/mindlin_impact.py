"""An oblique impact under the law of Hertz and Mindlin, integrated with only NumPy, at any angle.

Impacts with sliding throughout have a closed form; impacts with sticking have none, and this reference is
used for them. A sphere of mass m and radius R, with I = 2/5 m R^2, meets a partner with which its m* and R*
are formed:

    m* dv_n/dt = -N,    N = 4/3 E* sqrt(R*) delta^1.5 + c sqrt(S_n m*) v_n,    S_n = 2 E* sqrt(R* delta)
    F = T + c sqrt(S_t m*) u,   dT/dt = S_t u + T dln(S_t)/dt if S_t falls,   |F| <= mu N,   S_t = 8 G* a
    m du/dt = -(F / share) (1 + 5 L^2 / (2 R^2)),    L = R - delta / 2
"""

from collections.abc import Sequence

import numpy as np

from tisim.cases.granular_bench.impacts import SUBSTANCES, ParticleImpact

PROFILE_POINTS = 20_000
"""Number of steps in the duration of an elastic impact."""


def shear_modulus(impact: ParticleImpact) -> float:
    """Return G* of an impact with a plane, or with a sphere of the same stiffness, Pa."""
    substance = SUBSTANCES[impact.substance]
    own = substance.young / (2 * (2 - substance.poisson) * (1 + substance.poisson))
    return own if impact.partner in ("plane", "large rigid") else own / 2


def oblique_impacts(
    impacts: Sequence[ParticleImpact], steps: int = PROFILE_POINTS
) -> tuple[np.ndarray, np.ndarray]:
    """Return the velocities along x (m/s) and the spins about y (rad/s) after impacts, shape (impacts,) each.

    The partners are planes or equal spheres. The integration is a leapfrog with ``steps`` in the duration
    of an elastic impact.
    """
    r, m, e, friction, vx, spin = (
        np.array([getattr(one, name) for one in impacts])
        for name in ("radius", "mass", "restitution", "friction", "sideways", "spin")
    )
    speed, radius, mass, modulus = np.array([one.hertz for one in impacts]).T
    shear = np.array([shear_modulus(one) for one in impacts])
    dt = np.array([one.duration for one in impacts]) / steps
    # Equal spheres have the same motion and spin, so the surfaces slide past each other at twice the speed.
    both = np.array([2.0 if one.partner == "equal" else 1.0 for one in impacts])
    logarithm = np.log(e)
    loss = -2 * np.sqrt(5 / 6) * logarithm / np.hypot(logarithm, np.pi)
    closing, overlap = speed.copy(), np.zeros(len(r))
    elastic, before = np.zeros(len(r)), np.zeros(len(r))
    for _ in range(3 * steps):
        overlap = overlap + 0.5 * dt * closing
        touching = overlap > 0
        circle = np.sqrt(radius * np.maximum(overlap, 0))
        normal, tangential = 2 * modulus * circle, 8 * shear * circle
        push = 4 / 3 * modulus * circle * overlap + loss * np.sqrt(normal * mass) * closing
        push = np.where(touching, push, 0.0)
        lever = r - overlap / 2
        slip = both * (vx - lever * spin)
        easing = np.where(before > tangential, tangential / np.maximum(before, 1e-300), 1.0)
        drawn = elastic * easing + tangential * dt * slip
        drag, limit = loss * np.sqrt(tangential * mass) * slip, friction * np.abs(push)
        force = drawn + drag
        slides = np.abs(force) > limit
        force = np.clip(force, -limit, limit)
        elastic = np.where(touching, np.where(slides, force - drag, drawn), 0.0)
        before = tangential
        vx = vx - dt * force / m
        spin = spin + dt * 2.5 * lever * force / (m * r**2)
        closing = closing - dt * push / mass
        overlap = overlap + 0.5 * dt * closing
    return vx, spin
