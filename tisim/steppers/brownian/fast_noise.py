"""Hydrodynamic interaction with noise of approximate covariance, from one sum over pairs: TEA-HI.

The truncated expansion of T. Geyer and U. Winter, J. Chem. Phys. 130, 114905 (2009), as in B16 6.3, with
rho_ij = D_ij / sqrt(D_ii D_jj) and N particles:

    z_i = sqrt(D_ii) C_i (g_i + beta sum_(j != i) rho_ij g_j),   C_i^-2 = 1 + beta^2 sum_(j != i) rho_ij^2,
    beta = (1 - sqrt(1 - q))/q,   q = (N - 1) eps^2 - (N - 2) eps,   eps the mean of rho_ij, j != i.

Variances are exact; covariances are exact if all rho_ij are equal. N and the mean (of tr rho_ij / 3) refer to
one axis, because the elements between different axes have mean 0: with all 3 N coordinates in one mean, the
covariances of two touching spheres are wrong by 9 % of D_ii instead of 2 %. In clouds the errors are much
larger, because one beta cannot suit all distances: a quarter of D_ij in a cloud with a volume fraction of 5 %
(tests/steppers/brownian/test_hydrodynamics.py). Only sums are stored.
"""

from tisim.backend.taichi import ti
from tisim.pairs.pair_sum import PairSum
from tisim.program.phases import Phase
from tisim.state.fields import Field
from tisim.state.status import WorldStatus
from tisim.steppers.brownian.exact_noise import GAUSS, Draw

SUMS = (
    GAUSS,
    Field("coupled_noise", "", 3, "keep", scratch=True),
    Field("coupling_squares", "", 3, "keep", scratch=True),
    Field("coupling", "", 1, "keep", scratch=True),
)
"""The sums of a particle: sum_j rho_ij g_j, sum_j rho_ij^2 for each coordinate, and the traces of rho_ij."""


@ti.data_oriented
class Fast:
    """The noise of a world by the truncated expansion."""

    def __init__(self, fluid, mobility, domain) -> None:
        self.s, self.fluid, self.mobility, self.domain = fluid.s, fluid, mobility, domain

    def phases(self):
        """Return the phases that prepare a step."""
        return (Draw(self.fluid), Couple(self), Weigh(self.fluid))

    @ti.func
    def push_velocity(self, w, i):
        """Return the velocity (m/s) of particle i due to forces, sum_j D_ij F_j / kT."""
        return self.s.velocity[w, i]

    @ti.func
    def scattered(self, w, i):
        """Return a random vector z_i (m/s^0.5) with <z_i z_j> = D_ij approximately."""
        s = self.s
        beta = ti.cast(s.beta[w], s.real)
        scale = 1.0 / ti.sqrt(1.0 + beta * beta * s.coupling_squares[w, i])
        return ti.sqrt(self.fluid.diffusivity(w, i)) * scale * (s.gauss[w, i] + beta * s.coupled_noise[w, i])


class Couple(PairSum):
    """This phase forms all sums over the other particles: velocities due to forces, noise, squares and
    traces. If the tensor may be indefinite, it also stops a world at pairs for which it is not positive
    definite."""

    by_inverse = True

    def __init__(self, fast) -> None:
        super().__init__(fast.s, fast.domain, (fast.mobility,), None)
        self.fluid, self.sound = fast.fluid, fast.mobility.sound
        self.components = 10 if self.sound else 11

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        return self.term_by_inverse(effect, w, i, j, separation, 1.0 / distance, t)

    @ti.func
    def term_by_inverse(self, effect: ti.template(), w, i, j, separation, inverse, t):  # type: ignore[valid-type]
        r, size, square = separation, self.s.radius[w, j], separation.norm_sqr()
        parts = effect.pair(w, i, j, square * inverse, inverse)
        push_velocity = effect.times(parts, r, self.s.force[w, j])
        noise = effect.times(parts, r, ti.sqrt(size) * self.s.gauss[w, j])
        a, b = parts[0], parts[1]
        along = a + b * square
        # The diagonal of (a I + b r r^T)^2; the second term is multiplied by squares of r below.
        alike, apart = size * a * a, size * b * (a + along)
        total = ti.Vector.zero(self.s.real, self.components)
        for k in ti.static(range(3)):
            total[k], total[3 + k] = push_velocity[k], noise[k]
            total[6 + k] = alike + apart * (r[k] * r[k])
        total[9] = ti.sqrt(size) * (2.0 * a + along)
        for k in ti.static(range(10, self.components)):
            total[k] = ti.select(along * along * size * self.s.radius[w, i] < 1.0, 0.0, 1.0)
        return total

    @ti.func
    def finish(self, w, i, total, t):
        s = self.s
        size = s.radius[w, i]
        push_velocity = self.fluid.push_velocity(w, i, self.fluid.mobility(w, i))
        for k in ti.static(range(3)):
            s.velocity[w, i][k] = push_velocity[k] + self.fluid.softness(w) * total[k]
            s.coupled_noise[w, i][k] = ti.sqrt(size) * total[3 + k]
            s.coupling_squares[w, i][k] = size * total[6 + k]
        s.coupling[w, i] = ti.sqrt(size) * total[9]
        for k in ti.static(range(10, self.components)):
            if total[k] > 0.0:
                s.fail(w, WorldStatus.NOT_POSITIVE_DEFINITE, i)


class Weigh(Phase):
    """This phase finds beta from the mean of rho_ij."""

    def __init__(self, fluid) -> None:
        self.s, self.fluid = fluid.s, fluid

    @ti.func
    def run(self, w, _k):
        s = self.s
        total, n = ti.cast(0.0, ti.f64), ti.cast(0.0, ti.f64)
        for i in range(s.count[w]):
            total += ti.cast(s.coupling[w, i], ti.f64)
            n += ti.cast(self.fluid.mobile(w, i), ti.f64)
        mean = total / (3.0 * ti.max(n * (n - 1.0), 1.0))
        q = (n - 1.0) * mean * mean - (n - 2.0) * mean
        # The same as above, but without 0/0 if nothing is coupled.
        s.beta[w] = 1.0 / (1.0 + ti.sqrt(ti.max(1.0 - q, 0.0)))
