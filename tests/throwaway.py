"""Effects that the core does not know, and scenes of them."""

import numpy as np

from tests.scenes import scene, simulate
from tisim.backend.taichi import ti
from tisim.effects import Force, PairForce, parameter
from tisim.numerics import elementary, philox
from tisim.operators import Operator
from tisim.state.fields import Field, WorldField

K_E = 8.9875517873681764e9
"""Coulomb's constant, N m^2/C^2."""


class Coulomb(PairForce):
    """F_i = -k q_i q_j / d^2 n_ij, between all pairs; only this effect needs the charge."""

    fields = ("charge",)
    constant: float = parameter("N m^2/C^2", "constant", K_E, gt=0)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        return -self.constant(w) * s.charge[w, i] * s.charge[w, j] / distance**3 * separation


class Trap(Force):
    """F = -k (r - c) + m g cos(omega t): a spring to a fixed point, and a time-dependent force."""

    stiffness: float = parameter("N/m", "stiffness", ge=0)
    centre: tuple[float, float, float] = parameter("m", "centre", (0.0, 0.0, 0.0))
    shake: tuple[float, float, float] = parameter("m/s^2", "shake", (0.0, 0.0, 0.0))
    omega: float = parameter("1/s", "omega", 0.0, ge=0)

    @ti.func
    def force(self, s, w, i, t):
        spring = -self.stiffness(w) * (s.position[w, i] - self.centre(w))
        return spring + s.mass[w, i] * self.shake(w) * ti.cast(elementary.cos(self.omega(w) * t), s.real)


class RandomKicks(Operator):
    """v += sigma sqrt(dt) normal, three draws for each particle and step; sums the kicks of each particle."""

    fields = (Field("kicked", "m/s", 3), "velocity")
    world_fields = (WorldField("kicks", "counter"),)
    sigma: float = parameter("m/s^1.5", "sigma", ge=0)

    @ti.func
    def particle(self, s, w, i, t, dt):
        a = philox.normal(philox.bits(s.seed[w], 77, s.id[w, i], s.steps[w], 0))
        b = philox.normal(philox.bits(s.seed[w], 77, s.id[w, i], s.steps[w], 1))
        kick = self.sigma(w) * ti.sqrt(dt) * ti.cast(ti.Vector([a[0], a[1], b[0]]), s.real)
        s.velocity[w, i] += kick
        s.kicked[w, i] += kick
        ti.atomic_add(s.kicks[w], 1)


class SoftShell(PairForce):
    """Linear repulsion within a gap, with the features of the core that a contact law needs. Listed pairs
    only."""

    short_ranged = True
    stiffness: float = parameter("N/m", "stiffness", gt=0)
    width: float = parameter("m", "width", gt=0)

    @ti.func
    def reach(self, s, w, i):
        return self.width(w)

    @ti.func
    def pair_force(self, s, w, i, j, separation, distance, t):
        depth = self.width(w) - (distance - s.radius[w, i] - s.radius[w, j])
        return -self.stiffness(w) * ti.max(depth, 0.0) / distance * separation


class SoftShellOfAll(SoftShell):
    """The same, summed over all pairs."""

    short_ranged = False


class Bridge(PairForce):
    """Grains that have touched attract each other with a constant force, until they are too far apart."""

    fields = ("radius",)
    short_ranged = True
    memory = 1
    pull: float = parameter("N", "pull", gt=0)
    rupture: float = parameter("m", "gap at which it breaks", gt=0)

    @ti.func
    def reach(self, s, w, i):
        return self.rupture(w)

    @ti.func
    def interaction(self, s, w, i, j, separation, distance, past, dt, t):
        gap = distance - s.radius[w, i] - s.radius[w, j]
        wet = (gap <= 0.0) | ((past[0] > 0.0) & (gap <= self.rupture(w)))
        force = ti.select(wet, self.pull(w) / distance, 0.0) * separation
        return force, 0.0 * force, 0.0 * force, ti.Vector([ti.select(wet, 1.0, 0.0)])


WORLDS, CAPACITY = 40, 32


def run(scenes):
    return simulate(scenes, worlds=WORLDS, capacity=CAPACITY)


def charges(position, velocity, charge, trap, mass=1.0, **more):
    effects = (Coulomb(), Trap(**trap))
    return scene(
        position, velocity, effects, mass=mass, quantities={"charge": np.asarray(charge, float)}, **more
    )
