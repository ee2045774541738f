"""How a sphere that is pushed drags others along: D_ij = kT/(6 pi eta) (a I + b r r^T), r from i to j.

Both tensors have no divergence, sum_j dD_ij/dr_j = 0, so that none has to be added to the drift (B16 6.2.2).
They are of an infinite fluid.
"""

from tisim.backend.taichi import ti

NEAR = 1e-9
"""Spheres nearer than this part of the sum of their radii are in one place: no direction is between them."""


@ti.data_oriented
class Oseen:
    """Oseen's tensor is that of points, a = 3/(4r), b = a/r^2 (B16 Eq. 6.9); it is not positive definite for
    r < 3/2 sqrt(R_i R_j)."""

    sound = False

    @ti.func
    def of(self, one, other, r):
        """Return a (1/m) and b (1/m^3) for two radii (m) at a distance r (m)."""
        a = 0.75 / r
        return ti.Vector([a, a / (r * r)])


@ti.data_oriented
class RotnePrager:
    """This is the tensor of J. Rotne and S. Prager (1969) and H. Yamakawa (1970), for any radii, overlapping
    or not.

    With R the larger radius, s = R_i + R_j, d = R_i - R_j, and b r^2 the second of each pair,

        3/(4r) (1 + (R_i^2 + R_j^2)/(3 r^2)),              3/(4r) (1 - (R_i^2 + R_j^2)/r^2)     r > s
        (s - (d^2 + 3 r^2)^2/(16 r^3))/(2 R_i R_j),        3 (d^2 - r^2)^2/(32 r^3 R_i R_j)     |d| < r <= s
        1/R,                                               0                                    r <= |d|

    (P. J. Zuk, E. Wajnryb, K. A. Mizerski, P. Szymczak, J. Fluid Mech. 741, R5 (2014), Eqs 3.7-3.9; B16
    Eq. 6.10 for equal radii). It is positive definite everywhere, but for spheres in each other's place:
    those move as one, and the matrix is singular.
    """

    sound = True

    @ti.func
    def of(self, one, other, r):
        """Return a (1/m) and b (1/m^3) for two radii (m) at a distance r (m)."""
        # In units of s, which keeps powers within what f32 can hold; few divisions, as these take longest.
        unit = 1.0 / (one + other)
        x, d, p = ti.max(r * unit, NEAR), ti.abs(one - other) * unit, one * other * unit * unit
        v, half = 1.0 / x, 0.5 / p
        square, inverse, sizes = x * x, v * v, 1.0 - 2.0 * p
        around, within = d * d + 3.0 * square, d * d - square
        apart, inside = x > 1.0, x <= ti.max(d, NEAR)
        a = ti.select(
            apart,
            0.75 * v * (1.0 + sizes * inverse / 3.0),
            half * (1.0 - around * around * inverse * v / 16.0),
        )
        b = ti.select(
            apart, 0.75 * v * (1.0 - sizes * inverse), half * within * within * inverse * v * 3.0 / 16.0
        )
        # The larger radius is (1 + d)/2 in these units.
        a = ti.select(inside, 2.0 / (1.0 + d), a)
        b = ti.select(inside, 0.0, b)
        return ti.Vector([a * unit, b * inverse * unit * (unit * unit)])


@ti.data_oriented
class Mobility:
    """Mobility gives the blocks of a world over kT/(6 pi eta), 1/m; 0 between particles of which one cannot
    move."""

    short_ranged = False

    def __init__(self, fluid, tensor) -> None:
        self.s, self.fluid, self.sound, self.tensor = fluid.s, fluid, tensor.sound, tensor

    @ti.func
    def pair(self, w, i, j, distance):
        """Return a (1/m) and b (1/m^3) of the block of particles i and j."""
        s = self.s
        parts = self.tensor.of(s.radius[w, i], s.radius[w, j], distance)
        if ti.static(self.fluid.holds):
            parts *= ti.cast(self.fluid.mobile(w, i) * self.fluid.mobile(w, j), s.real)
        return parts

    @ti.func
    def times(self, parts, r, vector):
        """Return a block times a vector."""
        return parts[0] * vector + parts[1] * r.dot(vector) * r
