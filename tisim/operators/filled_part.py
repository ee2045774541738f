"""The filled part of a region, as seen by kernels."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.effects.base import Constraint, parameter
from tisim.operators.at_intervals import AtIntervals
from tisim.operators.filled_region import FilledRegion
from tisim.state.bound import Peers


class FilledPart(FilledRegion, AtIntervals):
    """The part of a region's volume that grains fill is measured. A grain whose centre is in the region
    counts with its whole volume, a rigid clump with the volume of the union of its spheres."""

    contract: ClassVar[bool] = True
    terms: ClassVar = 1

    fraction: float = parameter("", "part of the region's volume that is filled", gt=0, lt=1, examples=[0.2])

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {**super().connect(peers), "constraints": peers.of(Constraint)}

    @ti.func
    def enough(self, s, w):
        """Return the sum of the cubes of the radii (m^3) of spheres that fill the region to the fraction."""
        return self.fraction(w) * self.volume(w) / ti.cast(4.0 / 3.0 * ti.math.pi, s.real)

    @ti.func
    def each(self, s, w, i):
        """Return the cube of the radius (m^3) of a sphere of the same volume as the grain that particle i
        represents, if the centre of the grain is in the region; else 0."""
        place, cube = s.position[w, i], s.radius[w, i] ** 3
        for constraint in ti.static(self.constraints):
            if constraint.holds(s, w, i):
                place, cube = constraint.home(s, w, i), 0.0 * cube
                if constraint.leads(s, w, i):
                    cube = constraint.volume(s, w, i) / ti.cast(4.0 / 3.0 * ti.math.pi, s.real)
        if not self.contains(w, place):
            cube = 0.0 * cube
        return ti.Vector([ti.cast(cube, ti.f64)])
