"""Particle-steps per second of tisim beside the numba program of the same model, and the difference of their
results.

    python tests/benchmarks/agglomeration.py [--worlds 240] [--grains 1000] [--repeats 3] [--threads 2]

Z04's six best designs (tables 1 and 2), each from worlds / 6 random starts (seeds), the same for both
programs. Runs alternate after both programs have compiled, so that other load on the machine affects both;
the ratio is the median over pairs of runs. TISIM_BACKEND names the kernel compiler.
"""

import argparse
import os
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

# Small parallel loops get slow if tbb is installed and numba prefers it.
os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp workqueue tbb")
# Threads that wait must not count as work.
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
sys.path.insert(0, str(Path(__file__).parents[2]))

import agglomeration_numba as peer
import numba
import numpy as np

from tests.benchmarks.turns import spread
from tisim import Result, Scene, Simulation
from tisim.backend import runtime
from tisim.cases.agglomeration.problem import cost
from tisim.cases.agglomeration.scene import DURATION, designs, scene
from tisim.scene.initial_state import Arrays

DESIGNS = designs()
"""Z04 tables 1 and 2."""


def parameters(design: dict[str, float], start: Arrays) -> dict[str, float]:
    """The parameters of the numba program for a design."""
    return {**design, "grain_mass": float(start["mass"][0])}


def pi(start: Arrays, final: Arrays) -> float:
    """Pi of a run of the numba program (Z04 7.1)."""
    return float(1.0 - final["radius"].mean() / np.cbrt((start["radius"] ** 3).sum()))


def tisim_run(simulation: Simulation, scenes: list[Scene]) -> tuple[np.ndarray, list[Result]]:
    """Wall and CPU seconds of the run alone, without loading, and the results."""
    simulation.load(scenes)
    seconds, _ = timed(simulation.run)
    return seconds, simulation.results()


def timed(call: Callable, *arguments: object) -> tuple[np.ndarray, Any]:
    """Wall seconds and CPU seconds of all threads, and the result of the call."""
    began = np.array([time.perf_counter(), time.process_time()])
    value = call(*arguments)
    return np.array([time.perf_counter(), time.process_time()]) - began, value


def summary(values: list[float]) -> str:
    """Mean and its standard error."""
    error = np.std(values, ddof=1) / np.sqrt(len(values)) if len(values) > 1 else np.nan
    return f"{np.mean(values):.5f} +- {error:.5f}"


def apart(result: Result, final: Arrays) -> float:
    """Largest difference of any quantity, relative to its largest value; inf if the numbers of grains differ.

    Grains are sorted by x, because rounding decides which of two merging grains of equal size keeps its
    place.
    """
    if len(final["mass"]) != len(result.state["mass"]):
        return np.inf
    a, b = np.argsort(final["position"][:, 0]), np.argsort(result.state["position"][:, 0])
    return max(float(np.abs(x[a] - result.state[k][b]).max() / np.abs(x).max()) for k, x in final.items())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    for name, value in (("worlds", 240), ("grains", 1000), ("repeats", 3), ("threads", 2)):
        parser.add_argument(f"--{name}", type=int, default=value)
    args = parser.parse_args()
    runtime.init(threads=args.threads)
    numba.set_num_threads(args.threads)

    designs = [DESIGNS[k % len(DESIGNS)] for k in range(args.worlds)]
    scenes = [scene(d, k // len(DESIGNS), args.grains) for k, d in enumerate(designs)]
    starts = [s.particles.arrays(s.domain, s.seed) for s in scenes]
    laws = [parameters(*pair) for pair in zip(designs, starts, strict=True)]
    batch, single = Simulation(scenes[0], args.worlds), Simulation(scenes[0], 1)
    for simulation, some in ((batch, scenes), (single, scenes[:1])):
        simulation.load(some)
        simulation.run(steps=1)
    peer.simulate(starts[:1], laws[:1], 1e-6)

    ours, theirs, one_by_one = [], [], []
    for _ in range(args.repeats):
        seconds, results = tisim_run(batch, scenes)
        ours.append(seconds)
        seconds, (finals, counts) = timed(peer.simulate, starts, laws, DURATION)
        theirs.append(seconds)
        one_by_one.append(np.sum([tisim_run(single, [s])[0] for s in scenes], axis=0))

    our_steps = sum(result.work["particle_steps"] for result in results)
    their_steps = int(counts[:, 1].sum())
    print(f"{platform.machine()}, {args.threads} threads ({runtime.cores()} cores); {runtime.backend()},"
          f" numba {numba.__version__} ({numba.threading_layer()})")  # fmt: skip
    print(f"{args.worlds} worlds x {args.grains} grains, {args.repeats} pairs of runs: median (range)")
    print(f"  tisim, one batch       {spread([our_steps / t[0] / 1e6 for t in ours])} M particle-steps/s")
    print(f"  tisim, one after other {spread([our_steps / t[0] / 1e6 for t in one_by_one])}")
    print(f"  numba                  {spread([their_steps / t[0] / 1e6 for t in theirs])}")
    for label, clock in (("wall", 0), ("CPU", 1)):
        rates = [our_steps * b[clock] / (a[clock] * their_steps) for a, b in zip(ours, theirs, strict=True)]
        batched = [b[clock] / a[clock] for a, b in zip(ours, one_by_one, strict=True)]
        print(f"  by {label} time: tisim / numba {spread(rates)}; batch / one by one {spread(batched)}")

    print("design  Pi, tisim            Pi, numba            steps: tisim, numba")
    for k in range(min(len(DESIGNS), args.worlds)):
        mine = range(k, args.worlds, len(DESIGNS))
        print(f"{k + 1:6}  {summary([cost(results[w]) for w in mine]):19}"
              f"  {summary([pi(starts[w], finals[w]) for w in mine]):19}"
              f"  {sum(results[w].work['steps'] for w in mine)}, {counts[mine, 0].sum()}")  # fmt: skip
    same = [all(r.work[n] == c for n, c in zip(peer.COUNTS, row, strict=True))
            for r, row in zip(results, counts, strict=True)]  # fmt: skip
    gaps = [apart(r, f) for r, f, s in zip(results, finals, same, strict=True) if s]
    print(f"worlds of equal counts to the end: {sum(same)} of {args.worlds}; particle by particle"
          f" they differ by {np.median(gaps) if gaps else np.nan:.1e} (median), relative")  # fmt: skip
    short, _ = peer.simulate(starts[:1], laws[:1], DURATION, steps=20)
    single.load(scenes[:1])
    single.run(steps=20)
    print(f"one world, 20 steps: {apart(single.results()[0], short[0]):.1e}")
    failed = [r.status.reason for r in results if not r.status.ok]
    if failed:
        print(f"{len(failed)} worlds of tisim failed: {failed[0]}")


if __name__ == "__main__":
    main()
