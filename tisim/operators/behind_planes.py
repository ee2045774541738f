"""The contract of operators that act on grains behind planes."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint
from tisim.geometry.plane import Plane
from tisim.operators.base import Operator, option
from tisim.state.bound import Peers


class BehindPlanes(Operator):
    """A grain is behind a plane when its centre is on the side opposite to the normal; a rigid clump, when
    its centre of mass is."""

    contract: ClassVar[bool] = True
    any_order: ClassVar[bool] = True

    planes: tuple[Plane, ...] = option("planes behind which the operator acts on grains", min_length=1)

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {"constraints": peers.of(Constraint)}

    @ti.func
    def is_behind(self, s, w, i):
        """Return whether particle i, or the body that holds it, is behind one of the planes."""
        place = s.position[w, i]
        for constraint in ti.static(self.constraints):
            if constraint.holds(s, w, i):
                place = constraint.home(s, w, i)
        behind = 0
        for k in range(self.planes.size(w)):
            if self.planes.distance(w, k, place) < 0.0:
                behind = 1
        return behind
