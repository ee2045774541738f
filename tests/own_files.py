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

from tisim.optimize import Gene, Genome, Problem
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

METHOD = '''
"""Steps from the best design so far."""
import numpy as np
from tisim.optimize.methods.base import SearchMethod
from tisim.optimize.methods.individual import Individual
from tisim.components.component import Checked


class Options(Checked):
    population: int = 4
    width: float = 0.1


class Steps(SearchMethod):
    name = "steps"
    Options = Options

    def __init__(self, genome, objectives, options, seed):
        self.options, self.rng = options, np.random.default_rng(seed)
        self.middle = np.full(len(genome), 0.5)

    def ask(self):
        size = (self.options.population, len(self.middle))
        steps = self.options.width * self.rng.standard_normal(size)
        return [Individual(point) for point in np.clip(self.middle + steps, 0.0, 1.0)]

    def tell(self, population, hall):
        if hall:
            self.middle = np.array(hall[0])
'''
