"""Brownian particles that do not interact, many at once: one particle in each vector lane of the CPU.

While every particle of a tile takes each interval in one step, nothing branches, and compilers vectorise the
loop over lanes. From the first interval that one of them cannot take in one step, the particles of the tile
advance one by one. The results are the same bit by bit.
"""

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.numerics.ieee import finite
from tisim.pairs.pair_sum import TILE
from tisim.steppers.brownian.independent import IndependentBrownianSteps, euler_step
from tisim.steppers.context import StepContext
from tisim.steppers.intervals import beginning
from tisim.steppers.registers import Registers


def vectorises(context: StepContext) -> bool:
    """Return whether vectors help: on a CPU, if worlds have room for a tile and a step needs only arithmetic,
    without derived quantities and operators."""
    simple = not context.operators and not context.force_sum.derived_solvers
    return simple and runtime.current().device == "cpu" and context.s.capacity >= TILE


class VectorisedBrownianSteps(IndependentBrownianSteps):
    """This phase takes tiles of particles through the intervals of a launch."""

    def __init__(self, context: StepContext, fluid) -> None:
        super().__init__(context, fluid)
        self.lane = Registers(context.s, ("force",), ())
        self.lane_state, self.lane_fluid = self.lane.state, self.lane.with_registers(fluid)
        self.lane_force_sum = self.lane.with_registers(context.force_sum)

    @ti.func
    def run(self, w, i):
        s = self.s
        if i % TILE == 0:
            finished = 0
            if i + TILE <= s.count[w] and self.level(w, i) > 0:
                finished = self.tile(w, i)
                for j in range(i, i + TILE):
                    s.own_interval[w, j] = s.intervals[w] + finished
            if finished < s.launch_intervals[w]:
                for j in range(i, ti.min(i + TILE, s.count[w])):
                    self.advance(w, j)

    @ti.func
    def level(self, w, first):
        """Return 1 if all particles of a tile are at the beginning of the launch and have only whole
        intervals before them; else 0."""
        s = self.s
        level = ti.select(s.cut[w] > 0.0, 0, 1)
        for j in range(first, first + TILE):
            if s.own_interval[w, j] > s.intervals[w] or s.own_elapsed[w, j] > 0.0:
                level = 0
        return level

    @ti.func
    def tile(self, w, first):
        """Take the particles from ``first`` on through intervals as long as all take each in one step, and
        return the number of these intervals."""
        s = self.s
        place = [ti.Vector([0.0] * TILE, s.real) for _ in ti.static(range(3))]
        drift = [ti.Vector([0.0] * TILE, s.real) for _ in ti.static(range(3))]
        force = [ti.Vector([0.0] * TILE, s.real) for _ in ti.static(range(3))]
        words = [ti.Vector([0] * TILE, ti.u32) for _ in ti.static(range(4))]
        noise = [ti.Vector([0.0] * TILE, s.real) for _ in ti.static(range(3))]
        intervals, finished, halted = ti.cast(s.launch_intervals[w], ti.i32), 0, 0
        while finished < intervals and halted == 0:
            begin = beginning(s, self.control, w, s.intervals[w] + finished)
            dt = beginning(s, self.control, w, s.intervals[w] + finished + 1) - begin
            number, step = self.number(s.intervals[w] + finished), ti.cast(dt, s.real)
            if not (dt > 0.0):
                halted = 1
            # Separate loops: with one long chain of operations per particle the processor's queues would
            # fill, and the next particles could not begin.
            for lane in range(TILE):
                drawn = self.lane_fluid.words(w, first + lane, number)
                for k in ti.static(range(4)):
                    words[k][lane] = drawn[k]
            for lane in range(TILE):
                g = self.lane_fluid.normals_of(ti.Vector([words[k][lane] for k in ti.static(range(4))]))
                for k in ti.static(range(3)):
                    noise[k][lane] = g[k]
            for lane in range(TILE):
                i = first + lane
                f = 0.0 * s.force[w, i]
                ti.static(self.lane.assign(f))
                if ti.static(self.forced):
                    self.lane_force_sum.single_particle(w, i, begin)
                mobility = self.lane_fluid.mobility(w, i)
                push_velocity = self.lane_fluid.push_velocity(w, i, mobility)
                g = ti.Vector([noise[k][lane] for k in ti.static(range(3))])
                v, r = euler_step(
                    self.lane_state, self.lane_fluid, w, i, mobility, push_velocity, begin, step, g
                )
                for k in ti.static(range(3)):
                    place[k][lane], drift[k][lane], force[k][lane] = r[k], v[k], f[k]
                fine = self.able(w, i) > 0 and self.control.easy(s, w, i, push_velocity)
                fine = fine and finite(r.norm_sqr()) and not self.domain.lost(w, r)
                halted += ti.select(fine, 0, 1)
            if halted == 0:
                for lane in range(TILE):
                    i = first + lane
                    r = ti.Vector([place[0][lane], place[1][lane], place[2][lane]])
                    s.position[w, i] = self.domain.wrap(w, r, begin + dt)
                    s.velocity[w, i] = ti.Vector([drift[0][lane], drift[1][lane], drift[2][lane]])
                    s.force[w, i] = ti.Vector([force[0][lane], force[1][lane], force[2][lane]])
                finished += 1
        ti.atomic_add(s.particle_steps[w], finished * TILE)
        return finished
