"""The fluid around particles that it heats: the response of each to forces, flow and heat by itself."""

import scipy.constants

from tisim.backend.taichi import ti
from tisim.numerics import philox
from tisim.numerics.random_streams import BROWNIAN_MOTION
from tisim.sources.base import sources
from tisim.steppers.context import StepContext

PER_KELVIN = scipy.constants.k
"""Boltzmann's constant, J/K."""


@ti.data_oriented
class Fluid:
    """The fluid is infinite, and at rest except for the flow.

    Particles whose field ``fixed`` is not 0 stay in place, if the scene has this field.
    """

    def __init__(self, context: StepContext) -> None:
        self.s, stepper = context.s, context.stepper
        self.temperature, self.viscosity = stepper.temperature, stepper.viscosity
        self.streams = sources(context.effects, "flow_velocity")
        self.forced = context.forced
        self.holds = any(field.name == "fixed" for field in context.s.fields)

    @ti.func
    def mobile(self, w, i):
        """Return 1 for a particle that can move, else 0."""
        mobile = 1
        if ti.static(self.holds):
            mobile = ti.select(self.s.fixed[w, i] == 0, 1, 0)
        return mobile

    @ti.func
    def softness(self, w):
        """Return 1/(6 pi eta) (m^2/(N s)): the mobility of a sphere times its radius."""
        return 1.0 / (6.0 * ti.math.pi * self.viscosity(w))

    @ti.func
    def heat(self, w):
        """Return the thermal energy kT (J)."""
        return PER_KELVIN * self.temperature(w)

    @ti.func
    def mobility(self, w, i):
        """Return the mobility 1/(6 pi eta R) (s/kg) of particle i (B16 Eq. 6.1)."""
        return self.softness(w) / self.s.radius[w, i]

    @ti.func
    def push_velocity(self, w, i, mobility):
        """Return the velocity (m/s) of particle i due to the force on it."""
        velocity = 0.0 * self.s.velocity[w, i]
        if ti.static(self.forced):
            velocity = mobility * self.s.force[w, i]
        return velocity

    @ti.func
    def flow(self, w, r, t):
        """Return the velocity (m/s) of the flow at the place r (m)."""
        velocity = 0.0 * r
        for source in ti.static(self.streams):
            velocity += source.value(w, r, t)
        return velocity

    @ti.func
    def diffusivity(self, w, i):
        """Return the diffusivity D_ii = kT/(6 pi eta R) (m^2/s) of particle i (B16 Eq. 6.8)."""
        return self.heat(w) * self.mobility(w, i)

    @ti.func
    def normals(self, w, i, step):
        """Return three independent standard normal numbers for a particle in a step."""
        return self.normals_of(self.words(w, i, step))

    @ti.func
    def words(self, w, i, step):
        """Return the four random words of a particle in a step."""
        return philox.bits(self.s.seed[w], BROWNIAN_MOTION, self.s.id[w, i], step)

    @ti.func
    def normals_of(self, words):
        """Return three normal numbers made from four words."""
        g = philox.normals(words)
        return ti.cast(ti.Vector([g[0], g[1], g[2]]), self.s.real)
