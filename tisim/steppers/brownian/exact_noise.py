"""Hydrodynamic interaction with noise of the exact covariance, by a Cholesky decomposition.

D = C C^T (B16 Eqs 6.15, 6.16): one decomposition of 9 N^3 operations per world and step; the matrix is
stored.
"""

from tisim.backend import runtime
from tisim.backend.layout import Builder
from tisim.backend.memory import Tree
from tisim.backend.taichi import ti
from tisim.errors import Words, must
from tisim.pairs.pair_sum import PairSum
from tisim.program.phases import PerParticle, Phase
from tisim.state.fields import Field
from tisim.state.status import WorldStatus

GAUSS = Field("gauss", "", 3, "keep", scratch=True)
"""The three standard normal numbers of a particle in a step."""
TILE_ROWS = 16
"""Number of rows of the matrix that are reduced together, so that compilers vectorise the loop."""
COLUMNS = 6
"""Number of columns that are reduced together and share the values read from earlier ones; a multiple of 3,
the columns of a particle. The 6 times 16 sums stay in registers. (Measured: 3 times 32 sums were kept in
memory, and took 1.7 times as long.)"""


@ti.data_oriented
class Exact:
    """The diffusion matrix of every world, over sqrt(D_ii D_jj), later replaced by C^T, with a row for each
    column of C.

    InputError is raised if the matrices of all worlds exceed the memory of the machine.
    """

    def __init__(self, fluid, mobility, domain) -> None:
        self.s, self.fluid, self.mobility, self.domain = fluid.s, fluid, mobility, domain
        # The last columns that are reduced together may extend past the columns of particles.
        self.rows = -(-(3 * self.s.capacity + COLUMNS) // TILE_ROWS) * TILE_ROWS
        rule = f"within the {runtime.memory() / 1e9:.0f} GB that this process may have"
        fits = self.bytes() <= runtime.memory()
        must(fits, "memory for diffusion matrices", rule, Words(f"{self.bytes() / 1e9:.0f} GB"))
        self.matrix = ti.field(self.s.real)
        builder = Builder()
        builder.dense(ti.i, self.s.worlds).dense(ti.jk, (self.rows, self.rows)).place(self.matrix)
        self.tree = Tree(builder)
        # Pivots at the level of rounding errors come from spheres at the same place.
        self.least = 1e-12 if self.s.real == ti.f64 else 1e-5

    def phases(self):
        """Return the phases that prepare a step."""
        return (Draw(self.fluid), Push(self), Fill(self), Factor(self))

    def bytes(self) -> int:
        """Return the device memory that the matrices take, in bytes."""
        return (8 if self.s.real == ti.f64 else 4) * self.s.worlds * self.rows**2

    @ti.func
    def push_velocity(self, w, i):
        """Return the velocity (m/s) of particle i due to forces, sum_j D_ij F_j / kT."""
        return self.s.velocity[w, i]

    @ti.func
    def scattered(self, w, i):
        """Return a random vector z_i = sum_j C_ij g_j (m/s^0.5) with <z_i z_j> = D_ij."""
        z = 0.0 * self.s.gauss[w, i]
        for j in range(i + 1):
            g = self.s.gauss[w, j]
            for a, b in ti.static(ti.ndrange(3, 3)):
                # The part above the diagonal of C, which was left unchanged, must not count.
                z[a] += ti.select(3 * j + b <= 3 * i + a, self.matrix[w, 3 * j + b, 3 * i + a] * g[b], 0.0)
        return ti.sqrt(self.fluid.diffusivity(w, i)) * z


class Draw(PerParticle):
    """This phase draws the noise of a step."""

    def __init__(self, fluid) -> None:
        super().__init__(fluid.s)
        self.fluid = fluid

    @ti.func
    def run(self, w, i):
        self.s.gauss[w, i] = self.fluid.normals(w, i, self.s.steps[w])


class Push(PairSum):
    """This phase sums the velocities due to forces, sum_j D_ij F_j / kT, and stores them in ``velocity``."""

    def __init__(self, exact) -> None:
        super().__init__(exact.s, exact.domain, (exact.mobility,), None)
        self.fluid = exact.fluid

    @ti.func
    def term(self, effect: ti.template(), w, i, j, separation, distance, t):  # type: ignore[valid-type]
        return effect.times(effect.pair(w, i, j, distance, 1.0 / distance), separation, self.s.force[w, j])

    @ti.func
    def finish(self, w, i, total, t):
        self.s.velocity[w, i] = (
            self.fluid.push_velocity(w, i, self.fluid.mobility(w, i)) + self.fluid.softness(w) * total
        )


class Fill(PerParticle):
    """This phase fills in the blocks of a particle with itself and with the particles after it."""

    def __init__(self, exact) -> None:
        super().__init__(exact.s)
        self.m = exact

    @ti.func
    def run(self, w, j):
        m, s = self.m, self.s
        for i in range(j, s.count[w]):
            r = m.domain.separation(w, s.position[w, j], s.position[w, i], s.time[w])
            parts = ti.Vector([ti.cast(1.0, s.real), ti.cast(0.0, s.real)])
            if i != j:
                distance = r.norm()
                parts = m.mobility.pair(w, i, j, distance, 1.0 / distance)
                parts *= ti.sqrt(s.radius[w, i] * s.radius[w, j])
            for a, b in ti.static(ti.ndrange(3, 3)):
                m.matrix[w, 3 * j + b, 3 * i + a] = (parts[0] if a == b else 0.0) + parts[1] * r[a] * r[b]


class Factor(Phase):
    """This phase is Cholesky's decomposition, left-looking, some columns at a time."""

    def __init__(self, exact) -> None:
        self.s, self.m = exact.s, exact
        # 9 N^3 operations of one thread, for which the other threads wait.
        self.others = self.s.capacity**3

    @ti.func
    def run(self, w, _k):
        n = 3 * self.s.count[w]
        for group in range((n + COLUMNS - 1) // COLUMNS):
            first = group * COLUMNS
            for tile in range(first // TILE_ROWS, (n + TILE_ROWS - 1) // TILE_ROWS):
                self.reduce(w, first, tile * TILE_ROWS)
            for column in range(first, ti.min(first + COLUMNS, n)):
                self.close(w, first, column, n)

    @ti.func
    def reduce(self, w, column, row):
        """Subtract the contributions of earlier columns from ``COLUMNS`` columns, in a tile of rows."""
        matrix = ti.static(self.m.matrix)
        left = [ti.Vector([0.0] * TILE_ROWS, self.s.real) for _ in ti.static(range(COLUMNS))]
        for lane in range(TILE_ROWS):
            for c in ti.static(range(COLUMNS)):
                left[c][lane] = matrix[w, column + c, row + lane]
        for k in range(column):
            factors = ti.Vector([matrix[w, k, column + c] for c in ti.static(range(COLUMNS))])
            for lane in range(TILE_ROWS):
                value = matrix[w, k, row + lane]
                for c in ti.static(range(COLUMNS)):
                    left[c][lane] -= factors[c] * value
        for lane in range(TILE_ROWS):
            for c in ti.static(range(COLUMNS)):
                matrix[w, column + c, row + lane] = left[c][lane]

    @ti.func
    def close(self, w, first, column, n):
        """Subtract the contributions of the columns from ``first`` on from a column, and divide it by the
        root of the pivot."""
        matrix = ti.static(self.m.matrix)
        for k in range(first, column):
            x = matrix[w, k, column]
            for row in range(column, n):
                matrix[w, column, row] = matrix[w, column, row] - x * matrix[w, k, row]
        pivot = matrix[w, column, column]
        # Written as a negation, so that it is also true for NaN.
        if not (pivot > -self.m.least):
            self.s.fail(w, WorldStatus.NOT_POSITIVE_DEFINITE, column // 3)
        scale = ti.select(pivot > self.m.least, 1.0 / ti.sqrt(ti.max(pivot, self.m.least)), 0.0)
        for row in range(column, n):
            matrix[w, column, row] *= scale
