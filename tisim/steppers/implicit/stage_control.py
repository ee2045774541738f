"""Step control of the collocation stepper: by an estimate of its error, and by how its sweeps converge."""

from __future__ import annotations

from pydantic import Field

from tisim.backend.taichi import ti
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.component import parameter
from tisim.steppers.implicit.span import Per, compared
from tisim.steppers.implicit.step_control import LEAST_SAFETY, ImplicitControl
from tisim.steppers.step_control import SHORTEST_STEP

CONTRACTION = 0.25
"""What a sweep is to multiply the error by, at most, where convergence limits the step."""


class StageControl(ImplicitControl):
    """Steps whose error, and that of the sweeps that solve them, is that asked for.

    error : of position, summed over the particles. per : "step", a bound of the error of a step over the
    displacement in it, mostly far above the error itself; or "run", the error at the end over the size of the
    motion (span.py), by the leading term of the method's own error. sweeps : as many as a step may take.
    part : what may be left of the error when sweeps end. safety : how much of the error the next step aims
    at. resolution : part of its radius that is added to a particle's displacement or size of motion: for one
    that starts from rest the ratio of error and displacement has no limit.

    With ``per="run"`` the error at the end was 0.03 to 30 times that asked for in 13 scenes, less under drag
    (docs/steppers.md); a chaotic motion multiplies it without bound.

    Sweeps end once the change in the last one, times the factor by which a sweep makes the error smaller, is
    below ``part`` of the error. The factor is that of the last two sweeps; in the first, that of the last
    steps for the present length. Source: as for implicit Runge-Kutta methods, E. Hairer, G. Wanner, Solving
    Ordinary Differential Equations II, Eq. (IV.8.10) and (IV.8.11).
    """

    error: float = parameter("", 1e-6, gt=0)
    part: float = parameter("", 0.3, gt=0)
    sweeps: int = Field(10, ge=2)
    safety: float = parameter("", 0.85, ge=LEAST_SAFETY, lt=1)
    resolution: float = parameter("", 1e-3, ge=0)
    per: Per = "step"
    first: float = parameter("s", 1e-6, ge=SHORTEST_STEP)
    longest: float = parameter("s", 1.0, ge=SHORTEST_STEP)

    accuracy_parameters = (AccuracyParameter(error=1),)

    @property
    def at_end(self) -> bool:
        return self.per == "run"

    def order(self, stages: int) -> int:
        """The power of dt with which an estimate of error falls, over what it is compared with."""
        return 2 * stages - 2 if self.at_end else stages

    @ti.func
    def scale(self, s, w, i, moved, dt):
        """What the error of a particle that has moved so far in a step of dt (s) is compared with. m."""
        return compared(self, s, w, i, moved, dt)

    @ti.func
    def solved(self, w, left):
        """Whether sweeps may end, with this much error left."""
        return left <= ti.cast(self.part(w) * self.error(w), ti.f64)

    @ti.func
    def accepts(self, w, error):
        """Whether a solved step is accurate enough."""
        return error <= ti.cast(self.error(w), ti.f64)

    @ti.func
    def factor(self, w, contraction, error, order):
        """What the next step is to be multiplied by: the error falls as dt^order, the contraction as dt^2."""
        asked = ti.cast(self.error(w), ti.f64)
        wanted = ti.cast(self.safety(w), ti.f64) * ti.pow(asked, 1.0 / order)
        by_error = self.limited(w, wanted, ti.pow(error, 1.0 / order))
        return ti.min(by_error, self.limited(w, ti.sqrt(CONTRACTION), ti.sqrt(contraction)))
