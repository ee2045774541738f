"""The longest steps for the springs and dashpots of a contact or a bond: one rule for all kinds of motion."""

from __future__ import annotations

from tisim.backend.taichi import ti

TURNING = 2.5
"""m R^2 over the moment of inertia of a solid sphere."""
TRAVEL = 2.0
"""Largest relative motion of two touching grains in a step, over the smaller radius, and largest approach of
a grain to a wall, over its radius. In longer steps a contact may be over, or deeper than a radius, before it
is first detected. Steps of a fiftieth of an impact move surfaces by 0.06 of its largest overlap."""


@ti.func
def least_mass(stiffness, damping, dt):
    """Return the smallest reduced mass (kg) for which steps of dt (s) with half kicks are stable with a
    spring (N/m) and a dashpot (N s/m); for a rotation (N m/rad, N m s/rad) the moment of inertia (kg m^2).

    The dashpot acts with the velocity of half a step ago. With S = k dt^2 / m and g = c dt / m an amplitude
    therefore changes from step to step by the roots of z^2 - (2 - S - g) z + 1 - g; beyond S + 2 g = 4 one of
    them is below -1.
    """
    return 0.25 * dt * (stiffness * dt + 2.0 * damping)


@ti.func
def least_held(friction, stiffness, damping, dt):
    """Return the ``least_mass`` of a motion that friction resists; without friction no force acts, and it is
    0."""
    return ti.select(friction > 0.0, least_mass(stiffness, damping, dt), 0.0)


@ti.func
def can_follow(least, inverse):
    """Return whether steps are stable for a motion, given its ``least_mass`` (kg) and inverse mass (1/kg)."""
    return least * inverse < 1.0


@ti.func
def can_follow_both(first, second, one, other, both):
    """Return whether steps are stable for two coupled motions, such as sliding and rolling of unlike grains,
    given the ``least_mass`` of each, their inverse masses, and the inverse mass that couples them.

    Accelerations are B F, with the forces F of both and B = ((one, both), (both, other)). Steps are stable if
    B times the diagonal matrix of the least masses has no eigenvalue above 1.
    """
    free, loose = 1.0 - one * first, 1.0 - other * second
    return (free > 0.0) & (loose > 0.0) & (free * loose > (both * first) * (both * second))


@ti.func
def inverse_masses(lever, share, depth, free):
    """Return a vector of inverse masses of two solid spheres, over 1/m*: for normal motion, sliding, rolling,
    and the coupling by which a couple causes sliding.

    For sliding it is 1 + 5/2 (m*/m_i (l_i/R_i)^2 + m*/m_j (l_j/R_j)^2) with the levers l_i = R_i - delta/2,
    which is 7/2 if surfaces just touch; for rolling m* R*^2 / I* with 1/I* = 1/I_i + 1/I_j.

    lever : R*/R_i; the value of j is one minus this. share : m*/m_i; the value of j is one minus this.
    depth : overlap over R*. free : 1, or 0 if forces move neither body, so that no step is too long.
    """
    back, rest = 1.0 - lever, 1.0 - share
    arm, other = 1.0 - 0.5 * depth * lever, 1.0 - 0.5 * depth * back
    slides = 1.0 + TURNING * (arm * arm * share + other * other * rest)
    rolls = TURNING * (lever * lever * share + back * back * rest)
    return free * ti.Vector([1.0, slides, rolls, TURNING * (arm * lever * share - other * back * rest)])


@ti.func
def wall_inverse_masses(depth, free):
    """Return the same for a solid sphere at a wall; ``depth`` is the overlap over its radius."""
    arm = 1.0 - 0.5 * depth
    return free * ti.Vector([1.0, 1.0 + TURNING * arm * arm, TURNING, TURNING * arm])
