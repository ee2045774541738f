"""The frequency sweep of the vibration case as one batch, and one frequency after the other.

    python tests/benchmarks/vibration_sweep.py [--near-field printed] [--sites 7] [--duration 2e-4]

All of Z13 Fig. 3. Both ways compile once, before the clock starts; runs alternate, and the ratio is the
median over pairs of runs. TISIM_BACKEND=quadrants chooses the other kernel compiler.
"""

import argparse
import platform
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from cases.vibration import RATIOS, scene
from tisim import Result, Scene, Simulation, runtime


def timed(simulation: Simulation, scenes: list[Scene]) -> tuple[float, list[Result]]:
    """Wall seconds, loading included, and results."""
    began = time.perf_counter()
    simulation.load(scenes)
    simulation.run()
    return time.perf_counter() - began, simulation.results()


def spread(values: list[float]) -> str:
    """Median, and least and greatest."""
    return f"{np.median(values):.3g} ({min(values):.3g} .. {max(values):.3g})"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--near-field", choices=("none", "printed", "equilibrium"), default="printed")
    parser.add_argument("--sites", type=int, default=7)
    parser.add_argument("--duration", type=float, default=2e-4)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    runtime.start(threads=args.threads)
    scenes = [scene(ratio, args.near_field, args.duration, args.sites) for ratio in RATIOS]
    batch, single = Simulation(scenes[0], len(scenes)), Simulation(scenes[0], 1)
    together, apart = [], []
    for _ in range(args.repeats):
        seconds, results = timed(batch, scenes)
        together.append(seconds)
        runs = [timed(single, [one]) for one in scenes]
        apart.append(sum(seconds for seconds, _ in runs))
    same = all(
        np.array_equal(a.state["position"], b.state["position"])
        for a, (_, (b,)) in zip(results, runs, strict=True)
    )
    steps = sum(result.work["particle_steps"] for result in results)
    print(
        f"{len(scenes)} frequencies, {args.sites**3} particles, {args.duration} s, near field "
        f"{args.near_field}, {steps} particle-steps; {args.repeats} pairs of runs: median (range)"
    )
    print(f"  one batch, schedule '{batch.schedule}'             {spread(together)} s")
    print(f"  one after the other, schedule '{single.schedule}'   {spread(apart)} s")
    print(f"  one after the other / batch   {spread([b / a for a, b in zip(together, apart, strict=True)])}")
    print(f"  the same bits: {same}; all reached the end: {all(r.status.ok for r in results)}")
    print(f"{platform.machine()}, {args.threads} threads ({runtime.cores()} cores); {runtime.backend()}")


if __name__ == "__main__":
    main()
