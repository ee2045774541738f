"""The contracts of the parts of a granular contact law: what each sees of a contact, and what it gives.

In all of them ``pair`` says which materials touch (see tisim/materials/material_law.py), ``radius`` is R*
and ``mass`` m*; 1/R* = 1/R_i + 1/R_j and 1/m* = 1/m_i + 1/m_j. ``limit`` is the normal force (N) that
Coulomb's limit is taken of. A part that remembers something says how many values, in ``memory``; they are 0
when a contact begins. Where the first three are a vector across the normal, ``vector``, they have turned with
the contact when the part is given them (see spring.py). Parts that hold back a motion say by which
``spring``, ``dashpot`` and ``coulomb`` they do: where no step can follow these, and there is friction, the
world stops (see step_limit.py).
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
    """A normal force pushes grains apart along the line of centres, as far as it is elastic.

    restitution_factor : by this a damping c sqrt(S m*) differs from that of a linear spring, S = k, where
    both are to give an impact the same restitution. adhesive : whether it pulls too. beyond_contact : whether
    it holds on to what parts; it then remembers that there is a contact, ``memory``.
    """

    contract: ClassVar[bool] = True
    restitution_factor: ClassVar[float] = 1.0
    adhesive: ClassVar[bool] = False
    beyond_contact: ClassVar[bool] = False
    memory: ClassVar[int] = 0

    def push(self, pair: Touching, radius: float, overlap: Overlap) -> Overlap:
        """Return the elastic force (N) at an overlap (m), or at an array of them, at this R* (m); infinity
        where a law does not say it. At an overlap of R* cohesion by the overlap must not reach it, and its
        slope tells the critical time step."""
        return overlap * math.inf

    @ti.func
    def circle(self, w, pair, radius, overlap):
        """Return the radius a (m) of the circle of contact."""
        return ti.sqrt(radius * overlap)

    @ti.func
    def stiffness(self, w, pair, circle):
        """Return the stiffness S_n (N/m), how the force grows with the overlap."""
        return 0.0 * circle

    @ti.func
    def elastic(self, w, pair, radius, overlap, circle):
        """Return the elastic force (N), positive where it pushes."""
        return 0.0 * circle

    @ti.func
    def pull_off(self, w, pair, radius):
        """Return the force (N) that it takes to part the two, where the law is adhesive."""
        return 0.0 * radius

    @ti.func
    def spread_jumps(self, w, pair, radius, mass, overlap, opening, begun, dt):
        """Return what is added to the elastic force (N) in the steps in which a contact begins or ends (see
        jump.py), and what the contact remembers of this, given ``begun``: above 0, as there is a contact.

        opening : speed at which the surfaces separate, m/s.
        """
        return 0.0 * overlap, 1.0

    @ti.func
    def separation_gap(self, w, pair, radius):
        """Return the gap (m) up to which a contact that has begun lasts."""
        return 0.0 * radius

    @ti.func
    def reach(self, w, radius):
        """Return the widest of these gaps (m), of whatever materials, at this R*."""
        return 0.0 * radius


class Damping(ContactPart):
    """Damping takes energy from the relative motion of two that touch."""

    contract: ClassVar[bool] = True

    @ti.func
    def coefficient(self, w, pair, stiffness, mass, factor):
        """Return the coefficient (N s/m) of a dashpot beside a spring of some stiffness (N/m), ``factor``
        being the ``restitution_factor`` of the normal force."""
        return 0.0 * stiffness


class TangentialForce(ContactPart):
    """A tangential force holds back surfaces that slide past each other, up to Coulomb's limit."""

    contract: ClassVar[bool] = True
    memory: ClassVar[int] = 0
    vector: ClassVar[bool] = False

    def ratio(self, pair: Touching) -> float:
        """Return the tangential stiffness over the normal one; 0 where there is no spring."""
        return 0.0

    @ti.func
    def force(self, w, pair, normal, stiffness, damping, limit, sliding, past, dt):
        """Return the force (N) on i, in the plane of contact, and what is remembered.

        stiffness, damping : S_n (N/m) and gamma_n (N s/m) of the normal force. sliding : velocity (m/s) of
        the surface of j past that of i.
        """
        return 0.0 * normal, past

    @ti.func
    def spring(self, w, pair, stiffness):
        """Return the tangential stiffness S_t (N/m), given S_n."""
        return 0.0 * stiffness

    @ti.func
    def dashpot(self, w, pair, damping):
        """Return the tangential damping (N s/m), given that of the normal force."""
        return 0.0 * damping

    @ti.func
    def coulomb(self, w, pair):
        """Return the coefficient of friction."""
        return 0.0


class RollingResistance(ContactPart):
    """Rolling resistance holds back two that roll on each other, by a couple about an axis in the plane of
    contact."""

    contract: ClassVar[bool] = True
    memory: ClassVar[int] = 0
    vector: ClassVar[bool] = False

    @ti.func
    def force(self, w, pair, normal, stiffness, mass, limit, rolling, past, dt):
        """Return the force (N) whose moment about an arm of R* n is the couple on i, and what is remembered.

        stiffness : S_n (N/m). rolling : R* Omega x n (m/s), Omega the spin of j relative to i.
        """
        return 0.0 * normal, past

    @ti.func
    def spring(self, w, pair, stiffness):
        """Return the stiffness (N/m) by which the force grows, given S_n."""
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
    """Twisting resistance holds back two that twist on each other, by a couple about their normal."""

    contract: ClassVar[bool] = True
    memory: ClassVar[int] = 0
    needs_tangential: ClassVar[bool] = False

    @ti.func
    def couple(self, w, pair, circle, spring, dashpot, friction, limit, twisting, past, dt):
        """Return the couple (N m) on i about the normal, and what is remembered.

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
    """Cohesion pulls two that touch towards each other.

    adhesive : whether Coulomb's limit knows of it, as of the force that parts the two. by_overlap : whether
    it grows with the overlap, so that what two that touch do goes by which normal force is beside it. Where
    it is then not below the elastic force at an overlap of R*, grains are refused, or their world stops.
    jumps : whether it begins in full at the touch; it is then spread over two steps (see jump.py).
    """

    contract: ClassVar[bool] = True
    adhesive: ClassVar[bool] = False
    by_overlap: ClassVar[bool] = False
    jumps: ClassVar[bool] = False

    def pulls(self, pair: Touching, radius: float, overlap: Overlap) -> Overlap:
        """Return its force (N) at an overlap (m), or at an array of them, at this R* (m)."""
        return 0.0 * overlap

    @ti.func
    def pull(self, w, pair, radius, overlap):
        """Return the force (N, >= 0) by which the two are pulled together."""
        return 0.0 * overlap
