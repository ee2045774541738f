"""Forces on single particles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base.effect import Effect
from tisim.state.fields import Field


class Force(Effect):
    """A force acts on each particle by itself, and depends on its state, its place and the time."""

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # Not known of a law that does not say it.
        return None

    def turns(self, effects: Sequence[Effect]) -> bool:
        """Return whether it exerts torques, given its options and all effects of the scene."""
        return self.offers("torque") or self.offers("load")

    @ti.func
    def force(self, s, w, i, t):
        """Return the force on particle i of world w at time t (s), in N."""
        return 0.0 * s.velocity[w, i]

    @ti.func
    def torque(self, s, w, i, t):
        """Return the torque on particle i about its centre, in N m."""
        return 0.0 * s.velocity[w, i]

    @ti.func
    def load(self, s, w, i, t, dt, commit):
        """Return force (N) and torque (N m) on particle i together; ``dt`` (s) have gone by since what i
        remembers, in the fields of ``memory_fields``, was brought up to date; it now is, if ``commit``."""
        return self.force(s, w, i, t), self.torque(s, w, i, t)

    def memory_fields(self, effects: Sequence[Effect]) -> tuple[Field, ...]:
        """Return the fields in which particles remember what it has done to them, given all effects of the
        scene; by default none. A bound force finds them with ``remembers``."""
        return ()

    @ti.func
    def velocity_jacobian(self, s, w, i, t):
        """Return the derivatives of ``force``: [a, b] that of component a by component b of the velocity of
        i, in N s/m.

        Like ``force`` it is of the trial state. Implicit steppers solve with it what is linear in velocity
        exactly; a force that does not define it they take as given.
        """
        return ti.Matrix.zero(s.real, 3, 3)
