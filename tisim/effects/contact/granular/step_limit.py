"""Which steps can follow the springs and dashpots of a contact or a bond: one rule for all ways to move."""

from __future__ import annotations

from tisim.backend.taichi import ti

SLIDING = 3.5
"""m* over the reduced mass of surfaces of solid spheres that slide, as these turn too."""
TURNING = 2.5
"""m R^2 over the moment of inertia of a solid sphere."""


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
def rolling_inertia(lever, share):
    """Return m* over the reduced mass of surfaces of two solid spheres that roll on each other, I*/R*^2 with
    1/I* = 1/I_i + 1/I_j, and m* over that by which a couple makes them slide.

    lever : R*/R_i; that of j is the rest to 1. share : m*/m_i; that of j is the rest to 1.
    """
    back, rest = 1.0 - lever, 1.0 - share
    rolls, slides = lever * lever * share + back * back * rest, lever * share - back * rest
    return TURNING * ti.Vector([rolls, slides])
