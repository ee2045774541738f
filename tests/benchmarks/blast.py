"""Particle-steps per second of the blast without interaction, beside a numba program of the same scheme.

    python tests/benchmarks/blast.py [--numbers 2000 100000] [--duration 0.2] [--repeats 7] [--threads 2]
        [--arithmetic strict]

Runs of the two alternate, after both have compiled; the ratio is the median over pairs of runs.
TISIM_BACKEND names the kernel compiler.
"""

import argparse
import platform
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import blast_numba as peer
import numba
import numpy as np

from tests.benchmarks.turns import rest, spread
from tisim import Scene, Simulation
from tisim.backend import runtime
from tisim.cases.blast.scene import AIR, FLUX, VISCOSITY, scene

WINDOW = 64
"""Steps of the numba program between two barriers; at most the number that tisim takes."""


def peer_control(setup: Scene) -> tuple[tuple[float, ...], int, int]:
    """The stepper settings of a scene, as arguments of the numba program."""
    stepper, control = setup.stepper, setup.stepper.control
    names = ("tolerance", "order", "first", "longest", "shortest", "most", "least")
    return (
        (stepper.phi, *(getattr(control, name) for name in names)),
        control.iterations,
        WINDOW,
    )


def compare(number: int, duration: float, repeats: int) -> None:
    """Compare both programs for one number of particles."""
    setup = scene(number=number, duration=duration)
    start = setup.particles.arrays(setup.domain, setup.seed)
    control, limit, steps = peer_control(setup)
    fixed = ((FLUX, 0.0, 0.0), (AIR, VISCOSITY), control, limit, steps)
    simulation = Simulation(setup)
    simulation.load([setup])
    simulation.run(steps=1)
    peer.simulate(start, *fixed, 1e-3)
    ours, theirs = [], []
    for _ in range(repeats):
        simulation.load([setup])
        rest()
        began = time.perf_counter()
        simulation.run()
        ours.append(time.perf_counter() - began)
        rest()
        began = time.perf_counter()
        position, _, counts = peer.simulate(start, *fixed, duration)
        theirs.append(time.perf_counter() - began)
    (result,) = simulation.results()
    work, peer_work = result.work, counts.sum(axis=0)
    title = f"{number} particles, {duration:g} s, schedule '{simulation.schedule}'"
    print(f"{title}, {repeats} pairs of runs: median (range)")
    print(f"  tisim  {spread([work['particle_steps'] / t / 1e6 for t in ours])} M particle-steps/s")
    print(f"  numba  {spread([peer_work[0] / t / 1e6 for t in theirs])}")
    rates = [work["particle_steps"] / a / (peer_work[0] / b) for a, b in zip(ours, theirs, strict=True)]
    print(f"  tisim / numba {spread(rates)}")
    moved = np.abs(result.state["position"] - start["position"]).max()
    gap = np.abs(result.state["position"] - position).max() / moved
    print(
        f"  steps {work['particle_steps']}, {peer_work[0]};"
        f" iterations {work['solver_iterations']}, {peer_work[1]};"
        f" positions differ by {gap:.1e} of the distance moved"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--numbers", type=int, nargs="+", default=[2000, 100_000])
    parser.add_argument("--duration", type=float, default=0.2)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--arithmetic", choices=runtime.ARITHMETICS, default="strict")
    args = parser.parse_args()
    runtime.init(threads=args.threads, arithmetic=args.arithmetic)
    numba.set_num_threads(args.threads)
    for number in args.numbers:
        compare(number, args.duration * min(1.0, 5000 / number), args.repeats)
    print(f"{platform.machine()}, {args.threads} threads ({runtime.cores()} cores); {runtime.backend()},"
          f" numba {numba.__version__} ({numba.threading_layer()})")  # fmt: skip


if __name__ == "__main__":
    main()
