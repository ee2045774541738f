"""A sweep over the settings of a case as one batch, and one run after the other.

    python tests/benchmarks/sweep.py vibration    # the eight frequencies of Z13 Fig. 3, 343 particles
    python tests/benchmarks/sweep.py capture      # 13 angles of a cylinder, 30 starts each (B16 section 6.3)

Both ways compile once, before the clock starts; they alternate, and the ratio is the median over pairs.
TISIM_BACKEND=quadrants chooses the other kernel compiler.
"""

import argparse
import platform
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from cases.capture import scene as capture
from cases.vibration import scene as vibration
from tisim import Result, Scene, Simulation
from tisim.backend import runtime

SWEEPS = {
    "vibration": lambda: [vibration.scene(ratio, "printed", 2e-4) for ratio in vibration.RATIOS],
    "capture": lambda: [
        capture.scene(75, angle, 20.0, duration=5.0, seed=seed)
        for angle in np.linspace(0.0, 90.0, 13)
        for seed in range(30)
    ],
}


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
    parser.add_argument("case", choices=tuple(SWEEPS))
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    runtime.init(threads=args.threads)
    scenes = SWEEPS[args.case]()
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
        f"{args.case}, {len(scenes)} runs of {len(results[0].state['mass'])} particles, "
        f"{steps} particle-steps; {args.repeats} pairs: median (range)"
    )
    print(f"  one batch, schedule '{batch.schedule}'             {spread(together)} s")
    print(f"  one after the other, schedule '{single.schedule}'   {spread(apart)} s")
    print(f"  one after the other / batch   {spread([b / a for a, b in zip(together, apart, strict=True)])}")
    print(f"  the same bits: {same}; all reached the end: {all(r.status.ok for r in results)}")
    print(f"{platform.machine()}, {args.threads} threads ({runtime.cores()} cores); {runtime.backend()}")


if __name__ == "__main__":
    main()
