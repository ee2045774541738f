"""Which steps can follow the springs and dashpots of a contact or a bond: one rule for all ways to move."""

from __future__ import annotations

from tisim.backend.taichi import ti

TURNING = 2.5
"""m R^2 over the moment of inertia of a solid sphere."""
TRAVEL = 2.0
"""In a step two that touch may move past each other by so many of the smaller radius, and a grain may come
nearer a wall by so many of its own. In longer ones a contact may be over, or deeper than a radius, before
it is first seen. Steps of a fiftieth of an impact move surfaces by 0.06 of its largest overlap."""


@ti.func
def least_mass(stiffness, damping, dt):
    """Return the reduced mass (kg) down to which steps of dt (s) by half kicks can follow a spring (N/m) with
    a dashpot (N s/m); of a rotation (N m/rad, N m s/rad) the moment of inertia (kg m^2).

    The dashpot acts with the velocity of half a step ago, so that with S = k dt^2 / m and g = c dt / m an
    amplitude goes by the roots of z^2 - (2 - S - g) z + 1 - g from step to step; beyond S + 2 g = 4 one of
    them is below -1.
    """
    return 0.25 * dt * (stiffness * dt + 2.0 * damping)


@ti.func
def least_held(friction, stiffness, damping, dt):
    """Return the ``least_mass`` of a motion that friction holds back; without any nothing acts, and it is
    0."""
    return ti.select(friction > 0.0, least_mass(stiffness, damping, dt), 0.0)


@ti.func
def can_follow(least, inverse):
    """Return whether steps can follow a motion, by its ``least_mass`` (kg) and its inverse mass (1/kg)."""
    return least * inverse < 1.0


@ti.func
def can_follow_both(first, second, one, other, both):
    """Return whether steps can follow two motions each of which moves the other, such as sliding and rolling
    of unlike grains, by the ``least_mass`` of each, their inverse masses, and that by which they are coupled.

    Accelerations are B F, with the forces F of both and B = ((one, both), (both, other)). Steps can follow
    them where B times the diagonal matrix of the least masses has no eigenvalue above 1.
    """
    free, loose = 1.0 - one * first, 1.0 - other * second
    return (free > 0.0) & (loose > 0.0) & (free * loose > (both * first) * (both * second))


@ti.func
def inverse_masses(lever, share, depth, free):
    """Return the inverse masses, over 1/m*, of two solid spheres that are pressed, that slide, that roll on
    each other, and that by which a couple makes them slide; a vector.

    Of sliding it is 1 + 5/2 (m*/m_i (l_i/R_i)^2 + m*/m_j (l_j/R_j)^2) with the levers l_i = R_i - delta/2,
    which is 7/2 where surfaces just touch; of rolling m* R*^2 / I* with 1/I* = 1/I_i + 1/I_j.

    lever : R*/R_i; that of j is the rest to 1. share : m*/m_i; that of j is the rest to 1. depth : overlap
    over R*. free : 1, or 0 where neither of the two moves by forces, so that no step is too long for them.
    """
    back, rest = 1.0 - lever, 1.0 - share
    arm, other = 1.0 - 0.5 * depth * lever, 1.0 - 0.5 * depth * back
    slides = 1.0 + TURNING * (arm * arm * share + other * other * rest)
    rolls = TURNING * (lever * lever * share + back * back * rest)
    return free * ti.Vector([1.0, slides, rolls, TURNING * (arm * lever * share - other * back * rest)])


@ti.func
def wall_inverse_masses(depth, free):
    """Return the same of a solid sphere at a wall, with ``depth`` the overlap over its radius."""
    arm = 1.0 - 0.5 * depth
    return free * ti.Vector([1.0, 1.0 + TURNING * arm * arm, TURNING, TURNING * arm])
