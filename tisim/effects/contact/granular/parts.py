"""The contracts of the parts of a granular contact law.

In all of them ``pair`` is the index of the pair of materials (see tisim/materials/material_law.py),
``radius`` is R* and ``mass`` m*; 1/R* = 1/R_i + 1/R_j and 1/m* = 1/m_i + 1/m_j. ``limit`` is the normal force
(N) of Coulomb's limit. A part with history gives the number of its values in ``memory``; they are 0 when a
contact begins. If ``vector`` is set, the first three are a vector across the normal, which has been rotated
with the contact before the part receives it (see spring.py). Parts that resist a motion return their
``spring``, ``dashpot`` and ``coulomb`` coefficients. If steps are too long for these, and there is friction,
the world stops (see step_limit.py).
"""

from __future__ import annotations

import math
from typing import ClassVar, TypeVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.materials.material_law import MaterialLaw
from tisim.materials.materials import Touching

Overlap = TypeVar("Overlap", float, np.ndarray)


class ContactPart(MaterialLaw):
    """A contact part is a part of a granular contact law."""

    contract: ClassVar[bool] = True


class NormalForce(ContactPart):
    """A normal force is the elastic force along the line of centres, which pushes grains apart.

    restitution_factor : ratio of the damping c sqrt(S m*) to the damping of a linear spring, S = k, that
    gives an impact the same restitution. adhesive : whether it also attracts. beyond_contact : whether a
    contact persists after the surfaces part; its existence is then stored in the history, ``memory``.
    """

    contract: ClassVar[bool] = True
    restitution_factor: ClassVar[float] = 1.0
    adhesive: ClassVar[bool] = False
    beyond_contact: ClassVar[bool] = False
    memory: ClassVar[int] = 0

    def push(self, pair: Touching, radius: float | np.ndarray, overlap: Overlap) -> Overlap:
        """Return the elastic force (N) at an overlap (m) and this R* (m); infinity if a law does not define
        it. The overlap may be an array, and then R* too. It is used to check that it exceeds
        overlap-dependent cohesion at an overlap of R*, to find the critical time step from its slope, and to
        draw the forces of contacts."""
        return overlap * math.inf

    @ti.func
    def circle(self, w, pair, radius, overlap):
        """Return the radius a (m) of the contact circle."""
        return ti.sqrt(radius * overlap)

    @ti.func
    def stiffness(self, w, pair, circle):
        """Return the stiffness S_n (N/m), the slope of the force over the overlap."""
        return 0.0 * circle

    @ti.func
    def elastic(self, w, pair, radius, overlap, circle):
        """Return the elastic force (N), positive if repulsive."""
        return 0.0 * circle

    @ti.func
    def pull_off(self, w, pair, radius):
        """Return the pull-off force (N) if the law is adhesive."""
        return 0.0 * radius

    @ti.func
    def spread_jumps(self, w, pair, radius, mass, overlap, opening, begun, dt):
        """Return the correction of the elastic force (N) in the steps in which a contact begins or ends (see
        jump.py), and its history value, given the previous value ``begun``, which is above 0 if there is a
        contact.

        opening : speed at which the surfaces separate, m/s.
        """
        return 0.0 * overlap, 1.0

    @ti.func
    def separation_gap(self, w, pair, radius):
        """Return the gap (m) up to which an existing contact lasts."""
        return 0.0 * radius

    @ti.func
    def reach(self, w, radius):
        """Return the widest of these gaps (m) over all materials, at this R*."""
        return 0.0 * radius


class Damping(ContactPart):
    """Damping dissipates the energy of relative motion of two touching grains."""

    contract: ClassVar[bool] = True

    @ti.func
    def coefficient(self, w, pair, stiffness, mass, factor):
        """Return the coefficient (N s/m) of a dashpot beside a spring of some stiffness (N/m); ``factor`` is
        the ``restitution_factor`` of the normal force."""
        return 0.0 * stiffness


class TangentialForce(ContactPart):
    """A tangential force resists the sliding of surfaces, up to Coulomb's limit."""

    contract: ClassVar[bool] = True
    memory: ClassVar[int] = 0
    vector: ClassVar[bool] = False

    def ratio(self, pair: Touching) -> float:
        """Return the tangential over the normal stiffness; 0 without a spring."""
        return 0.0

    @ti.func
    def force(self, w, pair, normal, stiffness, damping, limit, sliding, past, dt):
        """Return the force (N) on i, in the plane of contact, and the history.

        stiffness, damping : S_n (N/m) and gamma_n (N s/m) of the normal force. sliding : velocity (m/s) of
        the surface of j relative to the surface of i.
        """
        return 0.0 * normal, past

    @ti.func
    def spring(self, w, pair, stiffness):
        """Return the tangential stiffness S_t (N/m), given S_n."""
        return 0.0 * stiffness

    @ti.func
    def dashpot(self, w, pair, damping):
        """Return the tangential damping (N s/m), given the normal damping."""
        return 0.0 * damping

    @ti.func
    def coulomb(self, w, pair):
        """Return the coefficient of friction."""
        return 0.0


class RollingResistance(ContactPart):
    """Rolling resistance opposes relative rolling by a couple about an axis in the plane of contact."""

    contract: ClassVar[bool] = True
    memory: ClassVar[int] = 0
    vector: ClassVar[bool] = False

    @ti.func
    def force(self, w, pair, normal, stiffness, mass, limit, rolling, past, dt):
        """Return the force (N) whose moment about an arm of R* n is the couple on i, and the history.

        stiffness : S_n (N/m). rolling : R* Omega x n (m/s), Omega the spin of j relative to i.
        """
        return 0.0 * normal, past

    @ti.func
    def spring(self, w, pair, stiffness):
        """Return the stiffness (N/m) of the rolling spring, given S_n."""
        return 0.0 * stiffness

    @ti.func
    def dashpot(self, w, pair, stiffness, mass):
        """Return the damping (N s/m), given S_n and m*."""
        return 0.0 * stiffness

    @ti.func
    def coulomb(self, w, pair):
        """Return the coefficient of rolling friction."""
        return 0.0


class TwistingResistance(ContactPart):
    """Twisting resistance opposes relative spin about the normal by a couple about the normal."""

    contract: ClassVar[bool] = True
    memory: ClassVar[int] = 0
    needs_tangential: ClassVar[bool] = False

    @ti.func
    def couple(self, w, pair, circle, spring, dashpot, friction, limit, twisting, past, dt):
        """Return the couple (N m) on i about the normal, and the history.

        circle : radius a (m) of the contact. spring, dashpot, friction : S_t (N/m), damping (N s/m) and mu of
        the tangential force. twisting : spin (rad/s) of j relative to i about the normal.
        """
        return 0.0 * twisting, past

    @ti.func
    def spring(self, w, pair, circle, spring):
        """Return the stiffness (N m/rad), given the radius of the contact and S_t."""
        return 0.0 * circle

    @ti.func
    def dashpot(self, w, pair, circle, dashpot):
        """Return the damping (N m s/rad), given the radius of the contact and gamma_t."""
        return 0.0 * circle

    @ti.func
    def coulomb(self, w, pair, circle, friction):
        """Return the largest couple over N (m), given the radius of the contact and mu."""
        return 0.0 * circle


class Cohesion(ContactPart):
    """Cohesion attracts two touching grains.

    adhesive : whether Coulomb's limit includes it as a pull-off force. by_overlap : whether it grows with the
    overlap, so that its balance depends on the normal force. If it is then not below the elastic force at an
    overlap of R*, grains are refused, or their world stops. jumps : whether it sets in at its full value on
    touching; it is then ramped over two steps (see jump.py).
    """

    contract: ClassVar[bool] = True
    adhesive: ClassVar[bool] = False
    by_overlap: ClassVar[bool] = False
    jumps: ClassVar[bool] = False

    def pulls(self, pair: Touching, radius: float | np.ndarray, overlap: Overlap) -> Overlap:
        """Return its force (N) at an overlap (m), or an array of overlaps, at this R* (m), as ``push``."""
        return 0.0 * overlap

    @ti.func
    def pull(self, w, pair, radius, overlap):
        """Return the attractive force (N, >= 0)."""
        return 0.0 * overlap
