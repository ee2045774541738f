"""The state at the beginning of a step, kept until the step is accepted."""

from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite
from tisim.state.fields import Field
from tisim.steppers.context import StepContext

FORCE_BEFORE = Field("force_before", "N", 3, "keep", scratch=True)
TORQUE_BEFORE = Field("torque_before", "N m", 3, "keep", scratch=True)
STATE_BEFORE = (
    Field("position_before", "m", 3, "keep", scratch=True),
    Field("velocity_before", "m/s", 3, "keep", scratch=True),
    FORCE_BEFORE,
)
CHANGE = Field("iterate_change", "m", 1, "keep", scratch=True)
"""Difference of the last two iterates of a particle."""
TURNING_BEFORE = (Field("spin_before", "rad/s", 3, "keep", scratch=True), TORQUE_BEFORE)


def saved_fields(turning: bool) -> tuple[Field, ...]:
    """Return the fields of the saved state, in a scene with or without torques."""
    return (*STATE_BEFORE, *(TURNING_BEFORE if turning else ()))


@ti.data_oriented
class SavedState:
    """The state of particles at the beginning of a step, to be restored."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.domain, self.turning = context.s, context.domain, context.turning

    @ti.func
    def save(self, w, i):
        """Save the state of a particle at the beginning of a step."""
        s = self.s
        s.position_before[w, i], s.velocity_before[w, i] = s.position[w, i], s.velocity[w, i]
        s.force_before[w, i] = s.force[w, i]
        if ti.static(self.turning):
            s.spin_before[w, i], s.torque_before[w, i] = s.spin[w, i], s.torque[w, i]

    @ti.func
    def restore(self, w, i):
        """Put a particle back to the beginning of the step."""
        s = self.s
        s.position[w, i], s.velocity[w, i] = s.position_before[w, i], s.velocity_before[w, i]
        s.force[w, i] = s.force_before[w, i]
        if ti.static(self.turning):
            s.spin[w, i], s.torque[w, i] = s.spin_before[w, i], s.torque_before[w, i]

    @ti.func
    def sound(self, w, r):
        """Return whether the place r (m) is finite and can be represented."""
        return finite(r.norm_sqr()) and not self.domain.lost(w, r)
