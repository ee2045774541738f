"""Groups of particles with a prescribed motion, or at rest."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np
from pydantic import model_validator

from tisim.backend.taichi import ti
from tisim.components.component import Component
from tisim.domains.domain import Domain
from tisim.effects.base import Constraint, Field, option
from tisim.effects.walls.motion import Fixed, Motion, MotionState, resultant, resultant_units
from tisim.errors import must
from tisim.state.state import HEAVY

REFERENCE = Field("reference_position", "m", 3, "keep", default="position")
"""Position at time 0 of a particle with a prescribed motion."""


class PrescribedMotion(Constraint):
    """Particles of a group follow a prescribed motion regardless of the forces on them, or are frozen.

        r(t) = M(t) M(0)^-1 r(0),    v = velocity of M at r,    spin = angular velocity of M

    M(t) maps the body to its position at time t; a frozen group stays at rest. The group contains the
    particles whose field ``group`` has its number at the start, and those that join it later
    (``join_group``); particles with the number 0 move freely. The motion also sets velocities and spins at
    the start, replacing given values. The particles act on others as usual. In granular contacts they have
    the mass of a wall. Short-ranged laws do not act between particles of the group; dipole interactions and
    sums over all pairs do. The result contains the total force (N) on the group, including gravity, as
    ``measures["NAME_force_x"]`` and so on, and the total torque (N m) about the origin or the centre of
    rotation as ``NAME_torque_x``.

    It corresponds to fix freeze and fix move of LAMMPS.
    """

    fields = (*Constraint.fields, "group", REFERENCE)
    repeatable: ClassVar[bool] = True
    mark: ClassVar = "group"

    group: int = option("number of the group of particles", 1, gt=0)
    motion: Motion = option("how the group moves", Fixed())

    @model_validator(mode="after")
    def _prescribed(self) -> PrescribedMotion:
        rule = "one that is known ahead, such as fixed, translation, oscillation or rotation"
        must(not self.motion.quantities, f"{self.label}.motion", rule, self.motion.kind())
        return self

    def members(self) -> dict[str, Component]:
        return {"motion": self.motion}

    def held(self, start: Mapping[str, np.ndarray], domain: Domain) -> np.ndarray:
        held: np.ndarray = start.get("group", np.zeros(len(start["mass"]))) == self.group
        return held

    def bodies(self, start: Mapping[str, np.ndarray]) -> np.ndarray:
        return np.where(start.get("group", np.zeros(len(start["mass"]))) == self.group, self.group, -1)

    def marks(self) -> str:
        return str(self.group)

    def reached_speed(self, duration: float, extent: float) -> float:
        return self.motion.top_speed(extent)

    def bind_fields(self, s: Any) -> dict[str, Any]:
        return {"kept": MotionState({})}

    def measures(self, state: Mapping[str, np.ndarray]) -> dict[str, float]:
        own, none = state["group"] == self.group, np.zeros_like(state["position"])
        position, force, torque = (
            state.get(name, none)[own].astype(float) for name in ("position", "force", "torque")
        )
        return resultant(self.label, position, force, torque, self.motion.centre_of_torque())

    def measured(self) -> dict[str, str]:
        return resultant_units(self.label)

    @ti.func
    def holds(self, s, w, i):
        return s.group[w, i] == self.group

    @ti.func
    def joined(self, s, w, i, j):
        return s.group[w, i] == self.group and s.group[w, j] == self.group

    @ti.func
    def begin(self, s, w, i):
        s.body_mass[w, i] = HEAVY * s.mass[w, i]
        if s.time[w] == 0.0:
            # The start may be the end of another run.
            s.reference_position[w, i] = s.position[w, i]

    @ti.func
    def join(self, s, w, i):
        """Add a free particle to the group, at its present position."""
        start, place = ti.cast(0.0, ti.f64), s.position[w, i]
        body = self.motion.to_body(self.kept, w, place, s.time[w])
        s.group[w, i], s.body_mass[w, i] = self.group, HEAVY * s.mass[w, i]
        s.reference_position[w, i] = self.motion.from_body(self.kept, w, body, start)
        s.velocity[w, i], s.spin[w, i] = self.velocity(s, w, i, s.time[w])

    @ti.func
    def position(self, s, w, i, t):
        place = self.motion.to_body(self.kept, w, s.reference_position[w, i], ti.cast(0.0, ti.f64))
        return self.motion.from_body(self.kept, w, place, t)

    @ti.func
    def velocity(self, s, w, i, t):
        place = self.position(s, w, i, t)
        return self.motion.velocity_at(self.kept, w, place, t), self.motion.angular_velocity(w)

    @ti.func
    def velocity_midway(self, s, w, i, t, dt):
        step = ti.cast(dt, ti.f64)
        place = 0.5 * (self.position(s, w, i, t - step) + self.position(s, w, i, t))
        velocity = self.motion.velocity_at(self.kept, w, place, t - 0.5 * step)
        return velocity, self.motion.angular_velocity(w)
