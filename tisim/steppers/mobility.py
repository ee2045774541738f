"""How a sphere that is pushed drags others along: D_ij = kT/(6 pi eta) (a I + b r r^T), r from i to j.

Both tensors have no divergence, sum_j dD_ij/dr_j = 0, so that none has to be added to the drift (B16 6.2.2).
They are of an infinite fluid.
"""

from tisim._taichi import ti

NEAR = 1e-9
"""Of the sum of radii: spheres nearer than this are in one place, without a direction between them."""


@ti.data_oriented
class Oseen:
    """a = 3/(4r), b = a/r^2: of points (B16 Eq. 6.9). Not positive definite for r < 3/2 sqrt(R_i R_j)."""

    sound = False

    @ti.func
    def of(self, one, other, r):
        """a (1/m) and b (1/m^3) for two radii at a distance. m."""
        a = 0.75 / r
        return ti.Vector([a, a / (r * r)])


@ti.data_oriented
class RotnePrager:
    """That of J. Rotne and S. Prager (1969) and H. Yamakawa (1970), for any radii, overlapping or not.

    With R the larger radius, s = R_i + R_j, d = R_i - R_j, and b r^2 the second of each pair,

        3/(4r) (1 + (R_i^2 + R_j^2)/(3 r^2)),              3/(4r) (1 - (R_i^2 + R_j^2)/r^2)     r > s
        (s - (d^2 + 3 r^2)^2/(16 r^3))/(2 R_i R_j),        3 (d^2 - r^2)^2/(32 r^3 R_i R_j)     |d| < r <= s
        1/R,                                               0                                    r <= |d|

    (P. J. Zuk, E. Wajnryb, K. A. Mizerski, P. Szymczak, J. Fluid Mech. 741, R5 (2014), Eqs 3.7-3.9; B16
    Eq. 6.10 for equal radii). Positive definite everywhere, but for spheres in each other's place: those move
    as one, and the matrix is singular.
    """

    sound = True

    @ti.func
    def of(self, one, other, r):
        """a (1/m) and b (1/m^3) for two radii at a distance. m."""
        s = one + other
        # In units of s, which keeps powers within what f32 can hold.
        x, d, p = ti.max(r / s, NEAR), ti.abs(one - other) / s, one * other / (s * s)
        square, cube = x * x, x * x * x
        sizes = 1.0 - 2.0 * p
        far = 0.75 / x
        a, b = far * (1.0 + sizes / (3.0 * square)), far * (1.0 - sizes / square)
        around, within = d * d + 3.0 * square, d * d - square
        apart, inside = x > 1.0, x <= ti.max(d, NEAR)
        a = ti.select(apart, a, (1.0 - around * around / (16.0 * cube)) / (2.0 * p))
        b = ti.select(apart, b, 3.0 * within * within / (32.0 * cube * p))
        a = ti.select(inside, s / ti.max(one, other), a)
        b = ti.select(inside, 0.0, b)
        return ti.Vector([a / s, b / square / s / (s * s)])


@ti.data_oriented
class Mobility:
    """The matrix of a world, each block over sqrt(D_ii D_jj): 1 on its diagonal; 0 between particles of which
    one cannot move."""

    short_ranged = False

    def __init__(self, fluid, tensor) -> None:
        self.s, self.fluid, self.sound = fluid.s, fluid, tensor.sound
        self.tensor = tensor

    @ti.func
    def pair(self, w, i, j, distance):
        """The coefficients of I and of r r^T (1/m^2) of a block."""
        s = self.s
        one, other = s.radius[w, i], s.radius[w, j]
        moving = ti.cast(self.fluid.mobile(w, i) * self.fluid.mobile(w, j), s.real)
        return moving * ti.sqrt(one * other) * self.tensor.of(one, other, distance)

    @ti.func
    def pushed(self, w, i, j, separation, parts):
        """Velocity that the force on j gives i, D_ij F_j / kT. m/s."""
        s = self.s
        f = self.fluid.softness(w) / ti.sqrt(s.radius[w, i] * s.radius[w, j]) * s.force[w, j]
        return parts[0] * f + parts[1] * separation.dot(f) * separation
