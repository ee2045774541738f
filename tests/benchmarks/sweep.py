"""A sweep as one batch; one run after another; and half of it in each of two processes side by side.

    python tests/benchmarks/sweep.py vibration       # the eight frequencies of Z13 Fig. 3, 343 particles
    python tests/benchmarks/sweep.py capture         # 13 angles of a cylinder, 30 starts each (B16 6.3)
    python tests/benchmarks/sweep.py agglomeration   # Z04's six designs, 8 starts of 100 grains each

Each of the three compiles once, before the clock starts; they alternate, and ratios are medians over turns.
Each of the two processes has one thread. TISIM_BACKEND names the kernel compiler.
"""

import argparse
import multiprocessing
import platform
import sys
import time
from multiprocessing.connection import Connection
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from tests.benchmarks.turns import spread
from tisim import Result, Scene, Simulation
from tisim.backend import runtime
from tisim.cases.agglomeration import scene as agglomeration
from tisim.cases.agglomeration.scene import designs
from tisim.cases.capture import scene as capture
from tisim.cases.vibration import scene as vibration

SWEEPS = {
    "vibration": lambda: [vibration.scene(ratio, "printed", 2e-4) for ratio in vibration.RATIOS],
    "capture": lambda: [
        capture.scene(75, angle, 20.0, duration=5.0, seed=seed)
        for angle in np.linspace(0.0, 90.0, 13)
        for seed in range(30)
    ],
    "agglomeration": lambda: [
        agglomeration.scene(design, seed, 100) for seed in range(8) for design in designs()
    ],
}
PROCESSES = 2


def timed(simulation: Simulation, scenes: list[Scene]) -> tuple[np.ndarray, list[Result]]:
    """Wall seconds for loading, steps and results, and the results."""
    times = [time.perf_counter()]
    simulation.load(scenes)
    times.append(time.perf_counter())
    simulation.run()
    times.append(time.perf_counter())
    results = simulation.results()
    return np.diff([*times, time.perf_counter()]), results


def worker(case: str, first: int, pipe: Connection) -> None:
    """Run every second scene of a sweep, one after another, each time it is asked to."""
    runtime.init(threads=1)
    scenes = SWEEPS[case]()[first::PROCESSES]
    single = Simulation(scenes[0], 1)
    single.load(scenes[:1])
    single.run()
    pipe.send(None)
    while pipe.recv():
        for one in scenes:
            timed(single, [one])
        pipe.send(None)


def through(pipes: list[Connection]) -> float:
    """Wall seconds in which all processes finish their runs once, side by side."""
    began = time.perf_counter()
    for pipe in pipes:
        pipe.send(True)
    for pipe in pipes:
        pipe.recv()
    return time.perf_counter() - began


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("case", choices=tuple(SWEEPS))
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=2)
    args = parser.parse_args()
    # The fork comes before Taichi has threads, which a copy of this process would lack.
    start = multiprocessing.get_context("spawn")
    pipes, processes = [], []
    for k in range(PROCESSES):
        pipe, end = start.Pipe()
        processes.append(start.Process(target=worker, args=(args.case, k, end), daemon=True))
        processes[k].start()
        pipe.recv()
        pipes.append(pipe)
    runtime.init(threads=args.threads)
    scenes = SWEEPS[args.case]()
    batch, single = Simulation(scenes[0], len(scenes)), Simulation(scenes[0], 1)
    for simulation, some in ((batch, scenes), (single, scenes[:1])):
        simulation.load(some)
        simulation.run(steps=1)
    together, apart, side_by_side = [], [], []
    for _ in range(args.repeats):
        side_by_side.append(through(pipes))
        parts, results = timed(batch, scenes)
        together.append(parts)
        runs = [timed(single, [one]) for one in scenes]
        apart.append(np.sum([parts for parts, _ in runs], axis=0))
    for pipe, process in zip(pipes, processes, strict=True):
        pipe.send(False)
        process.join()
    same = all(
        np.array_equal(a.state["position"], b.state["position"])
        for a, (_, (b,)) in zip(results, runs, strict=True)
    )
    steps = sum(result.work["particle_steps"] for result in results)
    print(
        f"{args.case}, {len(scenes)} runs of {scenes[0].capacity()} particles, "
        f"{steps} particle-steps; {args.repeats} pairs: median (range)"
    )
    for name, ways in (("one batch", together), ("one after the other", apart)):
        parts = 1e3 * np.median(ways, axis=0) / len(scenes)
        print(f"  {name}, ms a run: loading {parts[0]:.2f}, steps {parts[1]:.2f}, result {parts[2]:.2f}")
    batched, alone = np.sum(together, axis=1), np.sum(apart, axis=1)
    print(f"  one batch, schedule '{batch.schedule}'             {spread(batched)} s")
    print(f"  one after the other, schedule '{single.schedule}'   {spread(alone)} s")
    print(f"  one after the other in {PROCESSES} processes         {spread(side_by_side)} s")
    print(f"  one after the other / batch   {spread(alone / batched)}")
    reference = np.array(side_by_side) / batched
    print(f"  {PROCESSES} processes / batch           {spread(reference)}")
    print(f"  the same bits: {same}; all reached the end: {all(r.status.ok for r in results)}")
    print(f"{platform.machine()}, {args.threads} threads ({runtime.cores()} cores); {runtime.backend()}")


if __name__ == "__main__":
    main()
