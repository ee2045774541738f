"""Files as a user writes them."""

LAW = '''
from tisim.backend.taichi import ti
from tisim.effects.base import Force, parameter


class Pull(Force):
    """Towards the origin, F = -k r / |r|."""

    strength: float = parameter("N", "strength")

    @ti.func
    def force(self, s, w, i, t):
        r = s.position[w, i]
        return -self.strength(w) * r / ti.max(r.norm(), 1e-12)
'''

PROBLEM = """
import numpy as np

from optimize import Gene, Genome, Problem
from tisim import Box, Cloud, Scene
from tisim.steppers import FixedStep, Verlet


def scene(design, seed):
    return Scene(
        particles=Cloud(number=5, radius=1e-4, density=1.0, deviation=(design["speed"],) * 3),
        domain=Box(low=(-0.1,) * 3, high=(0.1,) * 3, images=False),
        stepper=Verlet(control=FixedStep(dt=1e-3)),
        duration=2e-3,
        seed=seed,
    )


def distance(result):
    return float(np.linalg.norm(result.state["position"], axis=1).mean())


PROBLEM = Problem("drift", Genome((Gene("speed", "m/s", 1.0, 20.0),)), scene, distance, symbol="R")
SEARCH = {
    "method": "zohdi", "generations": 1, "options": {"population": 6, "parents": 2},
    "ensemble": {"max_starts": 4},
}
"""
