"""The velocity of a flow on a grid, and its gradient, at any place, in kernels."""

from typing import TYPE_CHECKING, Any, ClassVar

from tisim.backend.taichi import ti


class InterpolatedFlow:
    """The functions with which kernels interpolate the flow of ``PoreFlow``, whose docstring explains the
    method.

    They read rows of numbers of a world: ``grid``, the velocity on the faces; ``depth``, the distance of the
    corners of cells from the nearest surface, in multiples of ``unit`` (m); ``sides``, the cells along each
    axis without and with those in walls; ``mean``, the velocity outside of the box; and ``scale``, the
    superficial speed (m/s) by which velocities are multiplied.
    """

    if TYPE_CHECKING:
        grid: ClassVar[Any]
        depth: ClassVar[Any]
        unit: ClassVar[Any]
        sides: ClassVar[Any]
        mean: ClassVar[Any]
        scale: ClassVar[Any]
        low: Any
        high: Any
        walled: Any
        outside: Any

    @ti.func
    def interpolate(self, w, r):
        """Return velocity (m/s) and gradient (1/s) at r (m)."""
        place, inside, per = self.place(w, r)
        near, normal, thickness = self.surface(w, place, per)
        # In the layer, the velocity above r at its edge.
        part = ti.min(ti.max(near, 0.0), 1.0)
        place += (1.0 - part) * thickness * per * normal
        v, slope = self.between(w, place, per)
        along = v.dot(normal)
        edge = v
        v = part * edge + (part * part - part) * along * normal
        if near < 1.0:
            slope -= (slope @ normal).outer_product(normal)
            slope = part * slope + (part * part - part) * normal.outer_product(normal @ slope)
            rise = (edge + (2.0 * part - 1.0) * along * normal) / thickness
            slope += ti.select(near > 0.0, rise, 0.0 * rise).outer_product(normal)
        for a in ti.static(range(3)):
            for b in ti.static(range(3)):
                slope[a, b] = ti.select(inside, self.scale(w, 0) * slope[a, b], 0.0)
            v[a] = self.scale(w, 0) * ti.select(inside, v[a], self.mean(w, a))
        return v, slope

    @ti.func
    def surface(self, w, place, per):
        """Return the distance of a place from the nearest surface, in layers, the unit vector along which it
        increases, which is 0 far away, and the thickness of the layer (m)."""
        corner = ti.floor(place)
        x, first = place - corner, ti.cast(corner, ti.i32)
        near, normal = 0.0 * x[0], 0.0 * x
        n, at = self.shape(w), ti.Matrix.zero(ti.i32, 3, 2)
        for b, i in ti.static(ti.ndrange(3, 2)):
            at[b, i] = wrapped(first[b] + i, n[b])
        for i, j, k in ti.static(ti.ndrange(2, 2, 2)):
            d = self.depth(w, (at[0, i] * n[1] + at[1, j]) * n[2] + at[2, k])
            p, q, s = x[0] if i else 1.0 - x[0], x[1] if j else 1.0 - x[1], x[2] if k else 1.0 - x[2]
            near += p * q * s * d
            normal[0] += (d if i else -d) * q * s
            normal[1] += p * (d if j else -d) * s
            normal[2] += p * q * (d if k else -d)
        normal *= per
        size = normal.norm()
        normal *= ti.select(size > 0.0, 1.0 / ti.select(size > 0.0, size, 1.0), 0.0)
        # One cell along the normal, of cells with different sides.
        across = (per * normal).norm()
        thickness = 1.0 / ti.select(across > 0.0, across, per.max())
        return near * self.unit(w, 0) / thickness, normal, thickness

    @ti.func
    def between(self, w, place, per):
        """Return velocity and gradient (1/m) from splines, in units of the superficial speed."""
        v, slope = 0.0 * place, 0.0 * place.outer_product(place)
        n = self.shape(w)
        for a in ti.static(range(3)):
            at, weight, change = self.splines(place, n, a)
            for i in ti.static(range(3 if a == 0 else 2)):
                for j in ti.static(range(3 if a == 1 else 2)):
                    for k in ti.static(range(3 if a == 2 else 2)):
                        u = self.grid(w, ((a * n[0] + at[0, i]) * n[1] + at[1, j]) * n[2] + at[2, k])
                        v[a] += u * weight[0, i] * weight[1, j] * weight[2, k]
                        slope[a, 0] += u * change[0, i] * weight[1, j] * weight[2, k]
                        slope[a, 1] += u * weight[0, i] * change[1, j] * weight[2, k]
                        slope[a, 2] += u * weight[0, i] * weight[1, j] * change[2, k]
            for b in ti.static(range(3)):
                slope[a, b] *= per[b]
        return v, slope

    @ti.func
    def place(self, w, r):
        """Return r in cells from the lower corner, moved into the box or the middle of a wall; whether the
        velocity there is interpolated; and the cells per length (1/m) by which it changes."""
        place, inside, per = 0.0 * r, True, 0.0 * r
        for a in ti.static(range(3)):
            n, whole = self.sides(w, a), self.sides(w, 3 + a)
            per[a] = n / (self.high(w)[a] - self.low(w)[a])
            place[a] = (r[a] - self.low(w)[a]) * per[a]
            if ti.static(self.walled[a]):
                place[a] = ti.min(ti.max(place[a], -0.5), n + 0.5)
                per[a] = ti.select(place[a] > -0.5 and place[a] < n + 0.5, per[a], 0.0)
            elif ti.static(self.outside == "uniform"):
                inside = inside and place[a] >= 0.0 and place[a] <= n
                place[a] = ti.min(ti.max(place[a], 0.0), n)
            else:
                place[a] -= whole * ti.floor(place[a] / whole)
        return place, inside, per

    @ti.func
    def splines(self, place, n, a: ti.template()):  # type: ignore[valid-type]
        """Return the indices of the faces along each axis on which component a depends, of n in all, their
        weights, and the derivatives of these by the place."""
        at = ti.Matrix.zero(ti.i32, 3, 3)
        weight, change = ti.Matrix.zero(float, 3, 3), ti.Matrix.zero(float, 3, 3)
        for b in ti.static(range(3)):
            if ti.static(a == b):
                nearest = ti.floor(place[b] + 0.5)
                x = place[b] - nearest
                for i in ti.static(range(3)):
                    at[b, i] = wrapped(ti.cast(nearest, ti.i32) - 1 + i, n[b])
                weight[b, 0], weight[b, 1], weight[b, 2] = (
                    0.5 * (0.5 - x) ** 2,
                    0.75 - x * x,
                    0.5 * (0.5 + x) ** 2,
                )
                change[b, 0], change[b, 1], change[b, 2] = x - 0.5, -2.0 * x, x + 0.5
            else:
                lower = ti.floor(place[b] - 0.5)
                x = place[b] - 0.5 - lower
                for i in ti.static(range(2)):
                    at[b, i] = wrapped(ti.cast(lower, ti.i32) + i, n[b])
                weight[b, 0], weight[b, 1] = 1.0 - x, x
                change[b, 0], change[b, 1] = -1.0, 1.0
        return at, weight, change

    @ti.func
    def shape(self, w):
        """Return the cells of the grid along each axis, with cells inside walls."""
        return ti.Vector([ti.cast(self.sides(w, 3 + a), ti.i32) for a in ti.static(range(3))])


@ti.func
def wrapped(i, n):
    """Return the index of the periodic image, among n cells, of cell i."""
    # Faster than the remainder of whole numbers.
    k = i - n * ti.cast(ti.floor(ti.cast(i, float) / n), ti.i32)
    # A place that is no number must not read other memory.
    return ti.max(0, ti.min(k, n - 1))
