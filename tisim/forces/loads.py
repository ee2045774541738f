"""The load on a particle: force, torque if effects turn particles, and the virial if the scene has it.

All components are in one vector, so that they are summed together.
"""

from __future__ import annotations

from typing import TYPE_CHECKING

from tisim.backend.taichi import ti
from tisim.state.fields import Field

if TYPE_CHECKING:
    from tisim.state.state import State

FORCE = Field("force", "N", 3, "sum")
TORQUE = Field("torque", "N m", 3, "sum")
VIRIAL = Field("virial", "J", 1, "keep", slots=9)
"""Half of the virial of the pairs of a particle: xx, xy, xz, yx, ... zz."""


@ti.data_oriented
class Loads:
    """Loads define the components of the summed forces, and read and write them in a state.

    A loop over particles that do not interact has a state of its own, so ``read`` and ``write`` take the
    state as an argument.

    turning : whether there are torques. virial : whether there is a virial.
    size : number of components of a force with its torque. components : number of all components.
    """

    def __init__(self, s: State, turning: bool) -> None:
        self.real, self.turning, self.virial = s.real, turning, VIRIAL in s.fields
        self.wrench, self.size = (_force_and_torque, 6) if turning else (_force_alone, 3)
        self.summand = self.load_and_virial if self.virial else _load_alone
        self.components = self.size + (VIRIAL.slots if self.virial else 0)

    @ti.func
    def load_and_virial(self, load, separation):
        """Return a load exerted by a particle at ``separation`` (m), with the half of its virial that belongs
        to the loaded particle."""
        total = ti.Vector.zero(self.real, self.components)
        for k in ti.static(range(self.size)):
            total[k] = load[k]
        for a, b in ti.static(ti.ndrange(3, 3)):
            total[self.size + 3 * a + b] = -0.5 * separation[a] * load[b]
        return total

    @ti.func
    def write(self, s, w, i, total):
        """Set the load on i by assignment; += would be atomic."""
        for k in ti.static(range(3)):
            s.force[w, i][k] = total[k]
            if ti.static(self.turning):
                s.torque[w, i][k] = total[3 + k]
        if ti.static(self.virial):
            for k in ti.static(range(VIRIAL.slots)):
                s.virial[w, i, k] = total[self.size + k]

    @ti.func
    def read(self, s, w, i):
        """Return the load on i."""
        load = self.wrench(s.force[w, i], s.force[w, i])
        if ti.static(self.turning):
            load = self.wrench(s.force[w, i], s.torque[w, i])
        total = self.summand(load, 0.0 * s.force[w, i])
        if ti.static(self.virial):
            for k in ti.static(range(VIRIAL.slots)):
                total[self.size + k] = s.virial[w, i, k]
        return total


@ti.func
def _force_and_torque(force, torque):
    return ti.Vector([force[0], force[1], force[2], torque[0], torque[1], torque[2]])


@ti.func
def _force_alone(force, torque):
    return force


@ti.func
def _load_alone(load, separation):
    return load
