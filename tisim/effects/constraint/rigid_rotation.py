"""The rotation of a free rigid body by a time step, as five turns about its principal axes.

    exp(dt/2 T3) exp(dt/2 T2) exp(dt T1) exp(dt/2 T2) exp(dt/2 T3)

T_k is the rotation by the kinetic energy m_k^2 / 2 I_k alone: about axis k of the body at the constant rate
m_k / I_k. The angular momentum in space is unchanged to the last bit. The method is symplectic,
time-reversible, and of second order in dt.

Source: A. Dullweber, B. Leimkuhler, R. McLachlan, J. Chem. Phys. 107 (1997) 5840; in quaternions, as LAMMPS
has it: T. F. Miller III et al., J. Chem. Phys. 116 (2002) 8649 (NO_SQUISH).
"""

from tisim.backend.taichi import ti
from tisim.numerics import elementary
from tisim.numerics.vectors import conjugate, product, rotated

TURNS = ((2, 0.5), (1, 0.5), (0, 1.0), (1, 0.5), (2, 0.5))
"""Axes of the rotations, in order, with the part of the step that each lasts."""


@ti.func
def free_rotation(q, momentum, moments, dt):
    """Return the orientation after dt (s), given the unit quaternion q from the axes of the body to space,
    the angular momentum (kg m^2/s) in space and the principal moments of inertia (kg m^2)."""
    m, turned = rotated(conjugate(q), momentum), q
    for axis, part in ti.static(TURNS):
        angle = part * dt * m[axis] / moments[axis]
        cosine, sine = elementary.cos(0.5 * angle), elementary.sin(0.5 * angle)
        step = ti.Vector.zero(float, 4)
        step[0], step[1 + axis] = cosine, sine
        turned, m = product(turned, step), rotated(conjugate(step), m)
    return turned / turned.norm()


@ti.func
def angular_velocity(q, momentum, moments):
    """Return the angular velocity (rad/s) in space."""
    return rotated(q, rotated(conjugate(q), momentum) / moments)
