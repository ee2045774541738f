"""Packing fraction, steps and CPU time of the packing steppers, for docs/packings.md.

python -m tests.benchmarks.packing_protocols [number of bodies] [number of starts]
"""

import resource
import sys

import numpy as np

from tests.steppers.packing.test_energy_minimisation import scene
from tests.steppers.packing.test_mechanical_contraction import fraction
from tisim import run
from tisim.shapes import SpherocylinderShape
from tisim.steppers import EnergyMinimisation, MechanicalContraction, MonteCarloGrowth

PROTOCOLS = {
    "mechanical contraction": (
        MechanicalContraction,
        {"method": "original", "volume_step": 1.0, "attempts": 2000, "halvings": 8},
    ),
    "energy minimisation": (EnergyMinimisation, {}),
    "Monte Carlo growth": (MonteCarloGrowth, {}),
    "Monte Carlo growth, rate 1e-5": (MonteCarloGrowth, {"rate": 1e-5, "precision": 1e-3}),
}
LENGTHS = {"spheres": 0.0, "rods": 0.5}


def used():
    """The CPU time (s) of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


def measure(number, starts):
    """Print a line for each protocol and shape; the first run, which compiles, is not measured."""
    for name, (kind, settings) in PROTOCOLS.items():
        for bodies, length in LENGTHS.items():
            shape = SpherocylinderShape(length=length, diameter=1.0)
            made = [scene(shape, number, seed=k, stepper=kind, **settings) for k in range(starts)]
            run([one.model_copy(update={"duration": 2.0}) for one in made])
            begun = used()
            results = run(made)
            elapsed = used() - begun
            packed = np.array([fraction(result, shape) for result in results])
            steps = [result.work["steps"] for result in results]
            deviation = packed.std(ddof=1) if starts > 1 else np.nan
            print(
                f"{name:30} {bodies:8} {packed.mean():.4f} +- {deviation:.4f} "
                f"{np.mean(steps):9.0f} steps {elapsed / starts:7.1f} s",
                flush=True,
            )


if __name__ == "__main__":
    numbers = [int(text) for text in sys.argv[1:]]
    measure(*(numbers + [100, 3][len(numbers) :]))
