"""A step of Langevin dynamics in NumPy, and scenes of particles in a viscous fluid."""

import numpy as np
import scipy.constants

from tests.scenes import simulate
from tests.steppers.brownian.colloids import Shear
from tests.throwaway import Trap
from tisim import Particles, Scene
from tisim.effects import Gravity
from tisim.sources import UniformFlow
from tisim.steppers import FixedStep, Langevin

RADIUS, DENSITY, VISCOSITY, TEMPERATURE = 1e-7, 1000.0, 1e-3, 300.0
MASS = 4 / 3 * np.pi * RADIUS**3 * DENSITY
"""Mass, kg."""
HEAT = scipy.constants.k * TEMPERATURE
"""Thermal energy kT, J."""
FRICTION = 6 * np.pi * VISCOSITY * RADIUS
"""Friction gamma, kg/s."""
TIME = MASS / FRICTION
"""Time m/gamma in which friction stops a particle: 2.2 ns."""
SPEED = np.sqrt(HEAT / MASS)
"""Thermal speed along an axis, m/s."""


def particles(
    a, steps, number=1, position=0.0, velocity=0.0, trap=0.0, shear=0.0, fall=0.0, wind=0.0, **more
):
    """Spheres of 100 nm in water, in steps of a m/gamma.

    trap : omega m/gamma of a spring to the origin. shear : rate (gamma/m) of a flow along x that grows along
    y. fall : gravity along -y, in thermal speeds per m/gamma. wind : a uniform flow along z, in thermal
    speeds. These effects are in every scene, so that all share one structure.
    """
    effects = (
        Trap(stiffness=MASS * (trap / TIME) ** 2),
        Shear(rate=shear / TIME),
        UniformFlow(velocity=(0.0, 0.0, wind * SPEED)),
        Gravity(acceleration=(0.0, -fall * SPEED / TIME, 0.0)),
        *more.pop("extra", ()),
    )
    control = FixedStep(dt=a * TIME)
    stepper = Langevin(temperature=more.pop("temperature", TEMPERATURE), viscosity=VISCOSITY, control=control)
    shape = np.zeros((number, 3))
    return Scene(
        particles=Particles(
            position=shape + position, velocity=shape + velocity, radius=RADIUS, density=DENSITY
        ),
        effects=effects,
        stepper=more.pop("stepper", stepper),
        duration=steps * a * TIME,
        **more,
    )


def run(scenes):
    """Results of scenes of one structure, from a simulation that tests share."""
    results = simulate(scenes, worlds=6, capacity=20_000)
    for result in results:
        assert result.status.ok, result.status.reason
    return results


def step(r, v, g, a, force, flow=lambda r: 0.0 * r, heat=1.0):
    """The place and the velocity after a step, with m = 1, m/gamma = 1/a and a step of 1.

    g : normal numbers. force, flow : functions of the place.
    """
    b = np.sqrt(np.tanh(a / 2) / (a / 2))
    v = v + b / 2 * force(r)
    r = r + flow(r) / 2 + b / 2 * (v - flow(r))
    u = flow(r)
    v = u + np.exp(-a) * (v - u) + np.sqrt(-np.expm1(-2 * a) * heat) * g
    r = r + u / 2 + b / 2 * (v - u)
    return r, v + b / 2 * force(r)


def maps(a, stiffness):
    """The matrices M and N of a step in a trap, (r, v)' = M (r, v) + N g."""
    columns = [step(r, v, g, a, lambda r: -stiffness * r) for r, v, g in np.eye(3)]
    return np.array(columns).T[:, :2], np.array(columns).T[:, 2:]
