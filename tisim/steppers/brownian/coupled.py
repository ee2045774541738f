"""Interacting Brownian particles: all take the same step, the longest that every particle allows."""

from tisim.backend.taichi import ti
from tisim.program.phases import PerParticle, Phase
from tisim.steppers.brownian.drift_limit import fault
from tisim.steppers.common import advance_clock, apply_displacement
from tisim.steppers.context import StepContext


@ti.data_oriented
class Separate:
    """No hydrodynamic interaction: D_ij = 0 for i != j."""

    def __init__(self, fluid) -> None:
        self.s, self.fluid = fluid.s, fluid

    def phases(self):
        """Return the phases that prepare a step: none."""
        return ()

    @ti.func
    def push_velocity(self, w, i):
        """Return the velocity (m/s) of particle i due to forces, sum_j D_ij F_j / kT."""
        return self.fluid.push_velocity(w, i, self.fluid.mobility(w, i))

    @ti.func
    def scattered(self, w, i):
        """Return a random vector z_i (m/s^0.5) with <z_i z_j> = D_ij."""
        return ti.sqrt(self.fluid.diffusivity(w, i)) * self.fluid.normals(w, i, self.s.steps[w])


class BrownianDrift(PerParticle):
    """This phase sets the drift velocity at the start of a step, and records the step length that it
    allows."""

    def __init__(self, context: StepContext, fluid, interaction) -> None:
        super().__init__(context.s)
        self.fluid, self.interaction, self.control = fluid, interaction, context.control

    @ti.func
    def run(self, w, i):
        s = self.s
        velocity = 0.0 * s.velocity[w, i]
        if self.fluid.mobile(w, i) > 0:
            push_velocity = self.interaction.push_velocity(w, i)
            rate = self.control.rate(s, w, i, push_velocity)
            if self.control.hopeless(w, rate):
                s.fail_by_force(w, fault(rate), i)
            elif rate > s.steepest[w]:
                ti.atomic_max(s.steepest[w], rate)
            velocity = self.fluid.flow(w, s.position[w, i], s.time[w]) + push_velocity
        s.velocity[w, i] = velocity


class Scatter(PerParticle):
    """This phase moves particles, r += dt v + sqrt(2 dt) z (B16 Eqs 6.11, 6.15), and lets operators change
    single particles."""

    def __init__(self, context: StepContext, fluid, interaction) -> None:
        super().__init__(context.s)
        self.fluid, self.interaction = fluid, interaction
        self.domain, self.operators = context.domain, context.operators

    @ti.func
    def run(self, w, i):
        s = self.s
        dt = ti.cast(s.dt[w], s.real)
        before, size = s.position[w, i], s.radius[w, i]
        if self.fluid.mobile(w, i) > 0:
            z = self.interaction.scattered(w, i)
            s.position[w, i] = before + dt * s.velocity[w, i] + ti.sqrt(2.0 * dt) * z
        for operator in ti.static(self.operators):
            operator.particle(s, w, i, s.time[w] + s.dt[w], dt)
        after = s.position[w, i]
        moved, grown = ti.cast(after - before, ti.f64), ti.cast(s.radius[w, i] - size, ti.f64)
        apply_displacement(s, self.domain, w, i, after, moved, grown, s.time[w] + s.dt[w])


class Proceed(Phase):
    """This phase advances time, reports displacements to the pair lists, and resets the limits on the next
    step."""

    def __init__(self, context: StepContext) -> None:
        self.s, self.lists = context.s, context.neighbour_lists
        self.listed = context.neighbour_lists is not None

    @ti.func
    def run(self, w, _k):
        advance_clock(self.s, w)
        self.s.steepest[w] = 0.0
        if ti.static(self.listed):
            self.lists.moved(w)
