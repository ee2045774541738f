"""Hydrodynamic mobility of pairs of spheres: D_ij = kT/(6 pi eta) (a I + b r r^T), r from i to j.

Both tensors have no divergence, sum_j dD_ij/dr_j = 0, so no divergence term has to be added to the drift (B16
6.2.2). They hold for an infinite fluid.
"""

from tisim.backend.taichi import ti


@ti.data_oriented
class Oseen:
    """Oseen's tensor, for point particles: a = 3/(4r), b = a/r^2 (B16 Eq. 6.9). It is not positive definite
    for r < 3/2 sqrt(R_i R_j)."""

    sound = False

    @ti.func
    def of(self, one, other, r, inverse):
        """Return a (1/m) and b (1/m^3) for two radii (m) at a distance r (m); inverse : 1/r."""
        a = 0.75 * inverse
        return ti.Vector([a, a * (inverse * inverse)])


@ti.data_oriented
class RotnePrager:
    """The tensor of J. Rotne and S. Prager (1969) and H. Yamakawa (1970), for any radii, overlapping or not.

    With R the larger radius, s = R_i + R_j, d = R_i - R_j, and b r^2 the second of each pair,

        3/(4r) (1 + (R_i^2 + R_j^2)/(3 r^2)),              3/(4r) (1 - (R_i^2 + R_j^2)/r^2)     r > s
        (s - (d^2 + 3 r^2)^2/(16 r^3))/(2 R_i R_j),        3 (d^2 - r^2)^2/(32 r^3 R_i R_j)     |d| < r <= s
        1/R,                                               0                                    r <= |d|

    (P. J. Zuk, E. Wajnryb, K. A. Mizerski, P. Szymczak, J. Fluid Mech. 741, R5 (2014), Eqs 3.7-3.9; B16 Eq.
    6.10 for equal radii). It is positive definite except for spheres at the same place: these move as one,
    and the matrix is singular.
    """

    sound = True

    @ti.func
    def of(self, one, other, r, inverse):
        """Return a (1/m) and b (1/m^3) for two radii (m) at a distance r (m); inverse : 1/r."""
        # In units of r. The division by the radii is separate, so that it need not wait for the distance.
        x, y, per_product = one * inverse, other * inverse, 1.0 / (one * other)
        squares, gap = 0.25 * (x * x + y * y), (x - y) * (x - y)
        around, within, apart = gap + 3.0, gap - 1.0, x + y < 1.0
        near = (16.0 * (x + y) - around * around) * (r * (per_product / 32.0))
        a = ti.select(apart, inverse * (0.75 + squares), near)
        near = within * within * (per_product * (3.0 / 32.0))
        b = ti.select(apart, inverse * inverse * (0.75 - 3.0 * squares), near)
        # Also true for spheres at the same place, for which the gap is not a number.
        inside = not (gap < 1.0)
        a = ti.select(inside, ti.select(one < other, one, other) * per_product, a)
        return ti.Vector([a, ti.select(inside, 0.0, b * inverse)])


@ti.data_oriented
class Mobility:
    """The blocks of the mobility matrix of a world over 1/(6 pi eta), 1/m; 0 if either particle cannot
    move."""

    short_ranged = False

    def __init__(self, fluid, tensor) -> None:
        self.s, self.fluid, self.sound, self.tensor = fluid.s, fluid, tensor.sound, tensor

    @ti.func
    def pair(self, w, i, j, distance, inverse):
        """Return a (1/m) and b (1/m^3) of the block of particles i and j; inverse : 1 / distance."""
        s = self.s
        parts = self.tensor.of(s.radius[w, i], s.radius[w, j], distance, inverse)
        if ti.static(self.fluid.holds):
            parts *= ti.cast(self.fluid.mobile(w, i) * self.fluid.mobile(w, j), s.real)
        return parts

    @ti.func
    def times(self, parts, r, vector):
        """Return a block times a vector."""
        return parts[0] * vector + parts[1] * r.dot(vector) * r
