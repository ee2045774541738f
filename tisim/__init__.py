"""tisim: clouds of interacting particles, simulated in batches of worlds."""

from tisim.packing.around_cylinder import RandomAroundCylinder
from tisim.packing.placement import Lattice, RandomInBall, RandomInBox, RandomInDomain
from tisim.particles import Cloud, Particles
from tisim.pulses import Blast
from tisim.result import Result
from tisim.run import run
from tisim.scene import Box, Open, Scene
from tisim.simulation import Simulation
from tisim.trajectory import Recording

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
