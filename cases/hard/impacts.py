"""Impacts of any speed.

Speeds from far below to far above every speed of the scene.
"""

import numpy as np
from scipy.integrate import quad

from tisim import Scene, run
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.reacting_flow import STONE
from tisim.cases.hard.runs import ends, given, kinetic, momentum, verlet
from tisim.effects import Agglomeration, Contact, ContactDissipation, Friction, Impact


def touching(gap, approach, hardness=1e9, radius=1e-3, mass=None):
    """Return two hard spheres with centres at a distance (m) along a slanted line; the first approaches the
    second along it (m/s). One very short step, in which only the impact happens."""
    n = np.array([2.0, -3.0, 6.0]) / 7
    mass = STONE * 4 / 3 * np.pi * np.asarray(radius) ** 3 if mass is None else mass
    return Scene(
        particles=given([0 * n, gap * n], [approach * n, 0 * n], radius, mass),
        effects=(Impact(hardness=hardness), Friction(coefficient=0.2), Agglomeration()),
        stepper=verlet(1e-30),
        duration=1e-30,
    )


@hard_case(
    "Hard spheres collide at 1e-12 m/s to 1e7 m/s, a thousand times the speed of sound in steel.",
    Criterion("kinetic energy gained at any speed, relative", 1e-14),
    Criterion("least kinetic energy left, over its start", least=1e-12),
    Criterion("momentum, relative change", 1e-13),
    Criterion("pairs that did not collide", 0, 0),
)
def impacts_of_any_speed():
    scenes = [touching(2e-3 * (1 - 1e-12), v, 1e6) for v in 10.0 ** np.arange(-12, 7.5, 1.0)]
    # In batches of few worlds, for which other impacts of this law are compiled too.
    results = [one for k in range(0, len(scenes), 5) for one in sound(run(scenes[k : k + 5]))]
    left = [kinetic(result.state) / kinetic(result.start) for result in results]
    moved = max(np.abs(momentum(result.state) / momentum(result.start) - 1).max() for result in results)
    return max(left) - 1, min(left), moved, sum(result.work["impacts"] != 1 for result in results)


@hard_case(
    "Elastic spheres meet head-on at 1000 times the speed of waves in their material and fly through each "
    "other.",
    Criterion("kinetic energy, change over the energy of a full overlap", 0.02),
    Criterion("with dissipation: energy lost over its integral, relative error", 0.02),
)
def beyond_the_speed_of_waves():
    stiffness, damping = 1e6, 1e3
    v = 1e3 * np.sqrt(stiffness)
    scenes = [
        Scene(
            particles=given([[-1.5, 0, 0], [1.5, 0, 0]], [[v, 0, 0], [-v, 0, 0]], 1.0, 1.0),
            effects=(Contact(stiffness=stiffness), ContactDissipation(damping=c)),
            stepper=verlet(1 / v / 500),
            duration=3 / v,
        )
        for c in (0.0, damping)
    ]
    free, damped = ends(scenes)

    def area(d):
        return np.pi * (1 - d**2 / 4)

    stored = quad(lambda d: stiffness * (1 - d / 2) ** 2 * area(d), 0, 2)[0]
    through = free["velocity"][0, 0] > 0 and free["position"][0, 0] > 1.4
    loss = damping * 2 * quad(area, 0, 2)[0] * 2 * v
    gained = abs(kinetic(free) - v**2) / stored if through else np.inf
    return gained, abs((v**2 - kinetic(damped)) / loss - 1)
