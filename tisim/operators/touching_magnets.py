"""The contract of operators that find the magnet that a particle touches."""

from __future__ import annotations

from typing import Any, ClassVar

from tisim.backend.taichi import ti
from tisim.operators.base import Operator
from tisim.sources.magnetic.magnets import Magnets
from tisim.state.bound import Peers


class TouchingMagnets(Operator):
    """Magnets are numbered from 0 through the lists of the scene in order. A particle touches a magnet if its
    surface meets the surface of the magnet, or if it is inside it."""

    contract: ClassVar[bool] = True

    def connect(self, peers: Peers) -> dict[str, Any]:
        return {**super().connect(peers), "magnets": peers.of(Magnets)}

    @ti.func
    def touched(self, w, r, radius):
        """Return the number of the nearest magnet if a sphere at r (m) touches it, or -1; the distance of r
        from its surface (m), negative inside; and the unit vector along which this distance increases.

        If it touches none, the distance may be less than that from the nearest magnet, but never more.
        """
        before, by, least, outward = 0, -1, 0.0 * radius + ti.math.inf, 0.0 * r
        complete = least
        for magnets in ti.static(self.magnets):
            first, end, listed, reach = magnets.nearby(w, r, radius)
            complete = ti.min(complete, reach)
            for e in range(first, end):
                k = e
                if listed:
                    k = magnets.near_body(w, e)
                distance, normal = magnets.each.nearest(w, k, r)
                if distance <= least:
                    least, by, outward = distance, before + k, normal
            before += magnets.each.size(w)
        if least > radius:
            by, least = -1, ti.min(least, complete)
        return by, least, outward

    @ti.func
    def outward(self, w, number, r):
        """Return the unit vector along which the distance of r (m) from a magnet, given by its number,
        increases."""
        before, outward = 0, 0.0 * r
        for magnets in ti.static(self.magnets):
            k = number - before
            if k >= 0 and k < magnets.each.size(w):
                _distance, outward = magnets.each.nearest(w, k, r)
            before += magnets.each.size(w)
        return outward
