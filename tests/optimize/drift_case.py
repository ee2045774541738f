"""A case that compiles quickly: the drift distance of free grains."""

import numpy as np

from tisim import Box, Cloud, Scene
from tisim.cases.case import Case, Size
from tisim.optimize.problem.genome import Gene, Genome
from tisim.optimize.problem.problem import Problem
from tisim.steppers import FixedStep, Verlet


def scene(design, seed):
    speed = design["speed"]
    return Scene(
        particles=Cloud(number=5, radius=1e-4, density=1.0, deviation=(speed, speed, design["rise"])),
        domain=Box(low=(-0.1,) * 3, high=(0.1,) * 3, images=False),
        stepper=Verlet(control=FixedStep(dt=1e-3)),
        duration=2e-3,
        seed=seed,
    )


def distance(result):
    """Mean distance from the centre, m."""
    return float(np.linalg.norm(result.state["position"], axis=1).mean())


def problem(size, variant):
    genome = Genome((Gene("speed", "m/s", 1.0, 20.0), Gene("rise", "m/s", 1.0, 20.0)))
    return Problem("drift", genome, scene, distance, symbol="R")


SEARCH = {
    "method": "zohdi",
    "options": {"population": 8, "parents": 2},
    "ensemble": {"max_starts": 6, "confirm": 8},
}
CASE = Case(
    "drift", "Free grains", "none", {"default": Size("5 grains", {}, SEARCH)},
    scene=lambda size, seed: None, check=lambda: iter(()), problem=problem, variants=("only",),
)  # fmt: skip
