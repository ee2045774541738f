"""Common parts of uniformly magnetised bodies of any shape."""

import math
from collections.abc import Sequence
from typing import Any, ClassVar

from scipy.constants import mu_0

from tisim.backend.taichi import ti
from tisim.components.component import Component, Vector
from tisim.sources.base import add_point, parameter
from tisim.sources.switched import NO_END, Switched
from tisim.state.bound import Peers


class Body(Component):
    """The contract of a solid body that may be magnetised; k is its row in the list of the source."""

    contract: ClassVar[bool] = True

    centre: Vector = parameter("m", "centre", (0.0, 0.0, 0.0))
    magnetisation: Vector = parameter("A/m", "magnetisation M", (0.0, 0.0, 0.0))

    @ti.func
    def nearest(self, w, k, r):
        """Return the distance of r (m) from the surface of body k, negative inside, and the unit vector along
        which it increases."""
        return 0.0 * r[0], 0.0 * r

    @ti.func
    def flux_density(self, w, k, r):
        """Return the flux density B (T) of body k at r."""
        return 0.0 * r

    @ti.func
    def flux(self, w, k, r):
        """Return B (T) and its gradient dB_i/dr_j (T/m), which is valid for r off the surface."""
        return 0.0 * r, 0.0 * r.outer_product(r)

    @ti.func
    def flux_mostly(self, w, k, r):
        """Return B and its gradient without a loop or a branch, so that compilers vectorise over points, and
        whether they are valid. If they are not, or if a body has no such method, ``flux`` must be used."""
        return 0.0 * r, 0.0 * r.outer_product(r), False


class Magnets(Switched):
    """The contract of a source that sums the fields of a list of bodies, each with its given magnetisation;
    bodies do not magnetise each other. They are magnetised from ``begin`` until ``end``, like soft magnets
    without remanence in an applied field that is switched on and off."""

    contract: ClassVar[bool] = True
    quantity: ClassVar[str] = "magnetic_flux_density"
    each: ClassVar[Any]
    """The bodies, in the bound source."""

    begin: float = parameter("s", "time from which on the bodies are magnetised", 0.0, ge=0)
    end: float = parameter("s", "time at which the bodies lose their magnetisation", NO_END, gt=0)

    def bodies(self) -> Sequence[Any]:
        """Return the bodies of all lists."""
        return [body for name, _ in self.lists() for body in getattr(self, name)]

    def strongest(self) -> float:
        # The field of a single body is at most mu_0 M everywhere.
        return mu_0 * sum(math.hypot(*body.magnetisation) for body in self.bodies())

    def shortest_length(self) -> float:
        return min((body.radius for body in self.bodies()), default=math.inf)

    @ti.func
    def magnetised(self, w, t):
        """Return the number of bodies that are magnetised at time t (s): all or none."""
        number = self.each.size(w)
        if ti.static(self.kinked):
            number = ti.select(self.acts(w, t), number, 0)
        return number

    @ti.func
    def value(self, w, r, t):
        return self.direct_value(w, r, t)

    @ti.func
    def gradient(self, w, r, t):
        return self.value_and_gradient(w, r, t)[1]

    @ti.func
    def value_and_gradient(self, w, r, t):
        return self.direct(w, r, t)

    @ti.func
    def add_tile(self, w, r: ti.template(), t, value: ti.template(), gradient: ti.template()):  # type: ignore
        self.add_direct(w, r, t, value, gradient)

    @ti.func
    def direct_value(self, w, r, t):
        """Return the field at r (m), the sum over the bodies one by one."""
        b = 0.0 * r
        for k in range(self.magnetised(w, t)):
            b += self.each.flux_density(w, k, r)
        return b

    @ti.func
    def direct(self, w, r, t):
        """Return the field at r (m) and its gradient, the sums over the bodies one by one."""
        b, gradient = 0.0 * r, 0.0 * r.outer_product(r)
        for k in range(self.magnetised(w, t)):
            one, slope = self.each.flux(w, k, r)
            b += one
            gradient += slope
        return b, gradient

    @ti.func
    def add_direct(self, w, r: ti.template(), t, value: ti.template(), gradient: ti.template()):  # type: ignore
        """Add the sums over the bodies one by one, at a tile of points (see ``add_tile``)."""
        # First the points for which the vectorised form is valid, then the others one by one; a tile of one
        # point has no vectors.
        size = ti.static(r[0].n)
        for k in range(self.magnetised(w, t)):
            left, wrong = ti.Vector([1] * size, ti.i32), size
            if ti.static(size > 1):
                wrong = 0
                for lane in range(size):
                    place = ti.Vector([r[0][lane], r[1][lane], r[2][lane]])
                    b, slope, right = self.each.flux_mostly(w, k, place)
                    left[lane] = ti.select(right, 0, 1)
                    wrong += left[lane]
                    add_point(value, gradient, lane, ti.select(right, b, 0.0), ti.select(right, slope, 0.0))
            if wrong > 0:
                for lane in range(size):
                    if left[lane] > 0:
                        place = ti.Vector([r[0][lane], r[1][lane], r[2][lane]])
                        b, slope = self.each.flux(w, k, place)
                        add_point(value, gradient, lane, b, slope)

    @ti.func
    def nearby(self, w, r, radius):
        """Return a range of places in the list of bodies near r (m), in which are all bodies that a sphere of
        a radius (m) at r may touch; whether the list is ``near_body``, otherwise places are indices; and a
        distance (m), at least the radius, within which no other body is, infinite if the range has all."""
        return 0, self.each.size(w), False, 0.0 * radius + ti.math.inf

    @ti.func
    def near_body(self, w, e):
        """Return the index of the body at a place of the list of bodies near r."""
        return e

    def connect(self, peers: Peers) -> dict[str, Any]:
        ((bodies, _),) = self.lists()
        return {"each": getattr(peers.bound(self), bodies)}
