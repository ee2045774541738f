"""Scenes of Brownian particles, and parts of them that only tests need."""

import numpy as np

from tests.scenes import simulate
from tests.throwaway import SoftShellOfAll, Trap
from tisim import Particles, Scene
from tisim.backend.taichi import ti
from tisim.components.component import parameter
from tisim.effects import Gravity
from tisim.operators import Operator
from tisim.sources import Source
from tisim.state.fields import Field, WorldField
from tisim.steppers import Brownian, DriftLimit

RADIUS, TEMPERATURE, VISCOSITY = 1e-7, 298.0, 1e-3
HEAT = 1.380649e-23 * TEMPERATURE
"""Thermal energy kT, J."""
MOBILITY = 1 / (6 * np.pi * VISCOSITY * RADIUS)
"""Mobility, s/kg."""
DIFFUSIVITY = HEAT * MOBILITY
"""Diffusivity, m^2/s."""
FREELY = 1e6
"""A drift limit (in radii) that never limits a step."""
SIGMAS = 5.0
"""Confidence of every statistical bound: one in two million fails by chance, and seeds are fixed."""


class Shear(Source):
    """u = (rate y, 0, 0)."""

    quantity = "flow_velocity"
    rate: float = parameter("1/s", "rate")

    @ti.func
    def value(self, w, r, t):
        return ti.Vector([self.rate(w) * r[1], 0.0 * r[1], 0.0 * r[1]])


class Stop(Operator):
    """Fixes particles that have passed a place along x, and records the time."""

    fields = (Field("fixed", "", 1, "keep", integer=True), Field("stopped_at", "s", 1, "keep"))
    world_fields = (WorldField("stops", "counter"),)
    place: float = parameter("m", "place")

    @ti.func
    def particle(self, s, w, i, t, dt):
        if s.position[w, i][0] > self.place(w) and s.fixed[w, i] == 0:
            s.fixed[w, i] = 1
            s.stopped_at[w, i] = ti.cast(t, s.real)
            s.velocity[w, i] = 0.0 * s.velocity[w, i]
            ti.atomic_add(s.stops[w], 1)


def colloids(position, together=False, trap=0.0, shear=0.0, fall=0.0, extra=(), dt=1e-4, steps=1, **more):
    """Spheres in water at room temperature, for a number of longest steps.

    together : whether there is a weak pair repulsion, for which all particles take common steps. trap :
    relaxation rate (1/s) of a sphere of RADIUS in a spring to the origin; shear : shear rate of the flow,
    1/s;
    fall : acceleration along -y, m/s^2. These effects are in every scene, so most scenes share one structure.
    """
    springs = (Trap(stiffness=trap / MOBILITY), Shear(rate=shear), Gravity(acceleration=(0.0, -fall, 0.0)))
    shell = (SoftShellOfAll(stiffness=more.pop("stiffness", 1e-6), width=1e-12),) if together else ()
    control = DriftLimit(
        longest=dt, drift=more.pop("drift", FREELY), shortest=more.pop("shortest", 1e-6 * dt)
    )
    options = {name: more.pop(name) for name in ("hydrodynamics", "noise") if name in more}
    temperature = more.pop("temperature", TEMPERATURE)
    position = np.asarray(position, float)
    return Scene(
        particles=Particles(
            position=position,
            velocity=np.zeros_like(position),
            radius=more.pop("radius", RADIUS),
            density=1000.0,
            quantities=more.pop("quantities", {}),
        ),
        effects=(*shell, *springs, *extra),
        stepper=Brownian(temperature=temperature, viscosity=VISCOSITY, control=control, **options),
        duration=dt * steps,
        **more,
    )


def run(scenes):
    """Results of scenes of one structure, from a simulation that tests share."""
    together = isinstance(scenes[0].effects[0], SoftShellOfAll)
    return simulate(scenes, worlds=5, capacity=600 if together else 10_000)
