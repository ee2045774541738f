"""The distances of particles from their starts, with which an error at the end of a run is compared.

A control of the error at the end gives each step a share of the error, in proportion to its length: the error
per unit step (L. F. Shampine, Math. Comp. 31 (1977) 500-512; E. Hairer, S. P. Norsett, G. Wanner, Solving
Ordinary Differential Equations I, section II.4). The errors are relative to the size of the motion so far,
and not to the displacement in the step, so that they may be added up over the run.
"""

from typing import Literal

from tisim.backend.taichi import ti
from tisim.program.phases import PerParticle
from tisim.state.fields import Field

Per = Literal["step", "run"]
"""Reference of a requested error: a step, relative to the displacement in it, or the end of a run, relative
to the size of the motion."""
TOTAL_DISPLACEMENT = Field("total_displacement", "m", 3, "keep", scratch=True)
"""Displacement of a particle since its start, counted through faces of a periodic box."""
EXCURSION = Field("excursion", "m", 1, "keep", scratch=True)
"""Largest distance of a particle from its start, at the ends of steps."""


def excursion_fields(at_end: bool) -> tuple[Field, ...]:
    """Return the fields for a control of the error at the end of the run."""
    return (TOTAL_DISPLACEMENT, EXCURSION) if at_end else ()


@ti.func
def error_scale(control: ti.template(), s, w, i, moved, dt):  # type: ignore[valid-type]
    """Return the scale (m) of the error of a particle that has moved by ``moved`` (m) in a step of dt (s)."""
    size, share = moved, ti.cast(1.0, s.real)
    if ti.static(control.at_end):
        size, share = ti.max(s.excursion[w, i], moved), dt / ti.cast(s.end[w], s.real)
    return share * (size + control.resolution(w) * s.radius[w, i])


@ti.func
def note_excursion(s, w, i, moved):
    """Record the displacement (m, a vector) in an accepted step."""
    s.total_displacement[w, i] = s.total_displacement[w, i] + moved
    s.excursion[w, i] = ti.max(s.excursion[w, i], s.total_displacement[w, i].norm())


class NoteExcursion(PerParticle):
    """This phase records the displacements in a step, which it gets from ``solve``."""

    def __init__(self, solve) -> None:
        super().__init__(solve.s)
        self.solve = solve

    @ti.func
    def run(self, w, i):
        note_excursion(self.s, w, i, self.solve.step_displacement(w, i, ti.cast(self.s.dt[w], self.s.real)))
