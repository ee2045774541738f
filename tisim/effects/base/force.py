"""Forces on single particles."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from typing import ClassVar

import numpy as np

from tisim.backend.taichi import ti
from tisim.effects.base.effect import Effect
from tisim.state.fields import Field


class Force(Effect):
    """A force acts on each particle individually; it depends on the state of the particle and the time."""

    contract: ClassVar[bool] = True
    repeatable: ClassVar[bool] = True
    homogeneous: ClassVar[bool] = False

    def critical_step(
        self, start: Mapping[str, np.ndarray], speed: float, effects: Sequence[Effect]
    ) -> float | None:
        # Unknown for a law that does not define it.
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
        """Return force (N) and torque (N m) on particle i together. ``dt`` (s) is the time since the history
        of i in ``memory_fields`` was last updated; it is updated now if ``commit``."""
        return self.force(s, w, i, t), self.torque(s, w, i, t)

    def memory_fields(self, effects: Sequence[Effect]) -> tuple[Field, ...]:
        """Return the fields that hold the history of its force on particles, given all effects of the scene;
        by default none. A bound force finds them with ``bind_fields``."""
        return ()

    @ti.func
    def velocity_jacobian(self, s, w, i, t):
        """Return the derivatives of ``force`` by velocity, in N s/m: element [a, b] is the derivative of
        component a by component b of the velocity of i.

        Like ``force`` it depends on the trial state. Implicit steppers use it to solve the linear part of the
        velocity dependence exactly; they treat a force without it as given.
        """
        return ti.Matrix.zero(s.real, 3, 3)
