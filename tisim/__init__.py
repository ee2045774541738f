"""tisim: clouds of interacting particles, simulated in batches of worlds."""

from tisim.engine.result import Result
from tisim.engine.run import run
from tisim.engine.simulation import Simulation
from tisim.io.trajectory import Recording
from tisim.packing.around_cylinder import RandomAroundCylinder
from tisim.packing.placement import Lattice, RandomInBall, RandomInBox, RandomInDomain
from tisim.scene.initial_state import Cloud, Particles
from tisim.scene.initial_velocity import Blast
from tisim.scene.scene import Box, Open, Scene

__version__ = "0.1.0"
__all__ = [
    "Blast",
    "Box",
    "Cloud",
    "Lattice",
    "Open",
    "Particles",
    "RandomAroundCylinder",
    "RandomInBall",
    "RandomInBox",
    "RandomInDomain",
    "Recording",
    "Result",
    "Scene",
    "Simulation",
    "__version__",
    "run",
]
