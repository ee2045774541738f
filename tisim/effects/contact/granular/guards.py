"""Conditions that stop the world of a contact law: steps that are too long, and unbalanced cohesion."""

from __future__ import annotations

from typing import TYPE_CHECKING, Any

from tisim.backend.taichi import ti
from tisim.effects.contact.granular.step_limit import (
    can_follow,
    can_follow_both,
    least_held,
    least_mass,
)


class ContactGuards:
    """Contact guards check the springs, dashpots and cohesion of the parts of a law.

    The attributes are the parts of tisim/effects/contact/granular/granular.py.
    """

    if TYPE_CHECKING:
        normal: Any
        rolling: Any
        twisting: Any
        cohesion: Any
        by_overlap: Any
        has: Any

    @ti.func
    def steps_follow(
        self, w, pair, circle, radius, mass, inverses, stiffness, damping, spring, dashpot, friction, dt
    ):
        """Return whether steps of dt (s) are short enough for normal motion, sliding, rolling and twisting.

        stiffness, damping : S_n (N/m) and gamma_n (N s/m). spring, dashpot, friction : of the tangential
        force.
        """
        inverse, rolls, twists = inverses / mass, 0.0 * mass, 0.0 * mass
        slides = least_held(friction, spring, dashpot, dt)
        if ti.static(self.has("rolling")):
            stiff, drag = (
                self.rolling.spring(w, pair, stiffness),
                self.rolling.dashpot(w, pair, stiffness, mass),
            )
            rolls = least_held(self.rolling.coulomb(w, pair), stiff, drag, dt)
        if ti.static(self.has("twisting")):
            turn, loss = (
                self.twisting.spring(w, pair, circle, spring),
                self.twisting.dashpot(w, pair, circle, dashpot),
            )
            arm = self.twisting.coulomb(w, pair, circle, friction)
            # As a mass, I/R*^2: moments of inertia of the smallest grains underflow in f32.
            twists = least_held(arm, turn, loss, dt) / radius / radius
        follows = can_follow(least_mass(stiffness, damping, dt), inverse[0]) & can_follow(twists, inverse[2])
        return follows & can_follow_both(slides, rolls, inverse[1], inverse[2], inverse[3])

    @ti.func
    def holds_apart(self, w, pair, radius):
        """Return whether the elastic force exceeds overlap-dependent cohesion at an overlap of R* (m)."""
        holds = True
        if ti.static(self.by_overlap):
            push = self.normal.elastic(w, pair, radius, radius, radius)
            holds = self.cohesion.pull(w, pair, radius, radius) < push
        return holds
