"""Packing fraction, steps and CPU time of the packing steppers, for docs/packings.md.

    python -m tests.benchmarks.packing_protocols [--number 100] [--starts 3] [--bodies spheres rods]

Superquadrics have steppers of their own, as their narrow phase takes longer: the revised contraction, and an
energy minimisation of fewer evaluations.
"""

import argparse
import resource

import numpy as np

from tests.steppers.packing.test_energy_minimisation import scene
from tisim import run
from tisim.analysis import Mean
from tisim.backend.processor import processor
from tisim.cases.packing.measures import measured
from tisim.cases.packing.scene import rod, superball
from tisim.shapes import SuperquadricShape
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
OF_SUPERQUADRICS = {
    "mechanical contraction, revised": (
        MechanicalContraction,
        {"volume_step": 1.0, "attempts": 500, "halvings": 4, "motion": 0.5},
    ),
    "energy minimisation": (EnergyMinimisation, {"precision": 1e-3, "tolerance": 1e-3}),
}
BODIES = {
    "spheres": rod(1.0),
    "rods": rod(1.5),
    "ellipsoids": SuperquadricShape(semi_axes=(0.5, 0.625, 0.4), exponents=(2.0, 2.0, 2.0)),
    **{f"superballs-{exponent:g}": superball(exponent) for exponent in (2.0, 3.0, 4.0, 5.0)},
}
"""Rods of L/D = 0.5, ellipsoids of axes 1.25 : 1 : 0.8, and superballs by exponent."""


def used():
    """The CPU time (s) of this process."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


def measure(number, starts, bodies):
    """Print a line for each shape and protocol; the first run, which compiles, is not measured."""
    for name in bodies:
        shape = BODIES[name]
        for protocol, (kind, settings) in (PROTOCOLS if shape.rod() else OF_SUPERQUADRICS).items():
            made = [scene(shape, number, seed=k, stepper=kind, **settings) for k in range(starts)]
            short = run([one.model_copy(update={"duration": 2.0}) for one in made])
            assert all(one.status for one in short)
            begun = used()
            results = run(made)
            elapsed = used() - begun
            fractions = [one.measures["packing_fraction"] for one in results]
            packed, deviation = Mean.of(fractions), np.std(fractions, ddof=1) if starts > 1 else np.nan
            touching = Mean.of([measured(one).touching for one in results])
            steps = np.mean([result.work["steps"] for result in results])
            print(
                f"{protocol:32} {name:14} {packed} (deviation {deviation:.4f}), "
                f"contacts up to 1e-4 D {touching}, {steps:9.0f} steps {elapsed / starts:7.1f} s",
                flush=True,
            )


def main():
    """Measure the protocols that are asked for."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--number", type=int, default=100)
    options.add_argument("--starts", type=int, default=3)
    options.add_argument("--bodies", nargs="+", choices=BODIES, default=["spheres", "rods"])
    given = options.parse_args()
    print(processor()["model name"])
    measure(given.number, given.starts, given.bodies)


if __name__ == "__main__":
    main()
