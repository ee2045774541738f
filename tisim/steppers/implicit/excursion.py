"""How far particles have been from where they started: what an error at the end of a run is compared with.

A control that aims at the end gives a step its share of the error, as much of it as the step is of the run:
the error per unit step (L. F. Shampine, Math. Comp. 31 (1977) 500-512; E. Hairer, S. P. Norsett, G. Wanner,
Solving Ordinary Differential Equations I, section II.4). What errors are compared with is not the step's own
displacement but the size of the motion so far, so that they may be added up over the run.
"""

from typing import Literal

from tisim.backend.taichi import ti
from tisim.program.phases import PerParticle
from tisim.state.fields import Field

Per = Literal["step", "run"]
"""This says what an error that is asked for is of: a step, over the displacement in it, or the end of a run,
over the size of the motion."""
TOTAL_DISPLACEMENT = Field("total_displacement", "m", 3, "keep", scratch=True)
"""This field is the displacement of a particle since its start, through faces of a box too."""
EXCURSION = Field("excursion", "m", 1, "keep", scratch=True)
"""This field is the largest distance of a particle from its start, at the ends of steps."""


def excursion_fields(at_end: bool) -> tuple[Field, ...]:
    """Return the fields that the control takes when it aims at the end of the run."""
    return (TOTAL_DISPLACEMENT, EXCURSION) if at_end else ()


@ti.func
def error_scale(control: ti.template(), s, w, i, moved, dt):  # type: ignore[valid-type]
    """Return what the error of a particle that has moved so far in a step of dt (s) is compared with (m)."""
    size, share = moved, ti.cast(1.0, s.real)
    if ti.static(control.at_end):
        size, share = ti.max(s.excursion[w, i], moved), dt / ti.cast(s.end[w], s.real)
    return share * (size + control.resolution(w) * s.radius[w, i])


@ti.func
def note_excursion(s, w, i, moved):
    """Note the displacement (m, a vector) in a step that is accepted."""
    s.total_displacement[w, i] = s.total_displacement[w, i] + moved
    s.excursion[w, i] = ti.max(s.excursion[w, i], s.total_displacement[w, i].norm())


class NoteExcursion(PerParticle):
    """This phase notes the displacements in a step. ``solve`` tells them."""

    def __init__(self, solve) -> None:
        super().__init__(solve.s)
        self.solve = solve

    @ti.func
    def run(self, w, i):
        note_excursion(self.s, w, i, self.solve.step_displacement(w, i, ti.cast(self.s.dt[w], self.s.real)))
