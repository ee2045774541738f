"""Time of a step of grains of two sizes, by the ratio of their radii, including rebuilds of neighbour lists.

    python tests/benchmarks/size_ratio.py [--number 40000] [--ratios 1 5 10 20] [--threads 1] [--steps 200]

Small and large grains, each with half of the volume, are placed at random in a periodic box at a volume
fraction of 0.3, and move under Hertz and Mindlin. Printed are the time per particle and step, its ratio to
the time of equal grains, and the number of listed pairs per grain. Ratios take turns; values are medians,
with the smallest and the largest.
"""

from __future__ import annotations

import argparse
import platform
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim.backend import runtime
from tisim.effects import Granular, MindlinForce, RestitutionDamping
from tisim.packing import RandomInDomain
from tisim.steppers import FixedStep, Verlet

FRACTION, SPEED, STEP, DENSITY = 0.3, 10.0, 1e-4, 2.0
"""Volume fraction; speed of small grains, m/s; s; kg/m3."""


def scene(number: int, ratio: float) -> tisim.Scene:
    """``number`` small grains of radius 0.5 m, and large ones of ``ratio`` times that radius with the same
    total volume."""
    large = round(number / ratio**3) if ratio > 1 else 0
    radius = np.repeat([0.5, 0.5 * ratio], [number, large])
    side = (4 / 3 * np.pi * (radius**3).sum() / FRACTION) ** (1 / 3)
    box = tisim.Box(low=(0, 0, 0), high=(side,) * 3)
    draw = np.random.Generator(np.random.Philox(7))
    # All grains have the same mean energy.
    velocity = SPEED * draw.normal(size=(len(radius), 3)) * (0.5 / radius[:, None]) ** 1.5
    return tisim.Scene(
        particles=tisim.Particles(
            position=RandomInDomain().centres(radius, box, 7), velocity=velocity, radius=radius,
            density=DENSITY,
        ),
        materials={"grain": tisim.Material(young=1e7, poisson=0.3, restitution=0.9, friction=0.3)},
        effects=(Granular(damping=RestitutionDamping(), tangential=MindlinForce()),),
        domain=box,
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=1e3,
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--number", type=int, default=40_000)
    parser.add_argument("--ratios", type=float, nargs="+", default=[1, 5, 10, 20])
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--steps", type=int, default=200)
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    tisim.init(threads=options.threads)
    print(f"{runtime.backend()}, {options.threads} threads, {platform.processor() or platform.machine()}")
    simulations, times = [], []
    for ratio in options.ratios:
        made = scene(options.number, ratio)
        simulation = tisim.Simulation(made)
        simulation.load(made)
        # Lists reach their final size before the time is taken.
        simulation.run(steps=options.steps)
        simulations.append(simulation)
        times.append([])
    for _ in range(options.repeats):
        for simulation, seconds in zip(simulations, times, strict=True):
            began = time.perf_counter()
            simulation.run(steps=options.steps)
            particles = len(simulation.starts[0]["mass"])
            seconds.append((time.perf_counter() - began) / options.steps / particles)
    for ratio, simulation, seconds in zip(options.ratios, simulations, times, strict=True):
        particles = len(simulation.starts[0]["mass"])
        pairs = simulation.assembly.pairs.end.to_numpy()[0].max() / particles
        relative = np.array(seconds) / np.array(times[0])
        print(
            f"1 : {ratio:g}, {particles} grains, {pairs:.2f} pairs of a grain listed: "
            f"{1e9 * np.median(seconds):.0f} ns a particle and step; {np.median(relative):.2f} "
            f"({relative.min():.2f} .. {relative.max():.2f}) of the first"
        )


if __name__ == "__main__":
    main()
