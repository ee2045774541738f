"""Brownian steps per second beside numba and LAPACK, all in one run.

    python tests/benchmarks/brownian.py [--repeats 5] [--threads 2] [--small] [--arithmetic strict]

Spheres in a trap. Without interaction: 100 in each of 30 worlds, and many in one. With Rotne and Prager's
tensor: 100 in each of 30 worlds, noise exact and fast. Peers: brownian_numba.py. Times are medians of runs
that alternate, without compilation. The variance of positions in each program is printed beside its speed. In
the first two rows it is divided by the variance of Euler's scheme, so it should be 1; in the other rows it
should be equal in both programs.
"""

import argparse
import os
import sys
import time
from collections.abc import Callable
from pathlib import Path

# Small parallel loops get slow if tbb is installed and numba prefers it.
os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp workqueue tbb")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
# The peer has a thread for each world.
os.environ["OPENBLAS_NUM_THREADS"] = "1"
sys.path.insert(0, str(Path(__file__).parents[2]))

import numba
import numpy as np

from tests.benchmarks import brownian_numba as peer
from tests.benchmarks.turns import rest, spread
from tests.steppers.brownian.colloids import DIFFUSIVITY, MOBILITY, RADIUS, colloids
from tisim import Simulation
from tisim.backend import runtime
from tisim.effects import Tether

RATE, DT = 100.0, 1e-4
PULL, WIDTH = RATE * DT, float(np.sqrt(2 * DIFFUSIVITY * DT))
TRAP = Tether(stiffness=(RATE / MOBILITY,) * 3)
WORLDS, NUMBER = 30, 100
SPREAD = float(np.sqrt(DIFFUSIVITY / RATE))


def start(worlds: int, number: int, apart: float) -> np.ndarray:
    """Positions drawn from the trap's own distribution, m; ``apart`` scales them, to keep spheres apart."""
    return apart * SPREAD * np.random.default_rng(1).standard_normal((worlds, number, 3))


def ours(
    places: np.ndarray, steps: int, **options: str
) -> tuple[Callable[[], float], Callable[[], np.ndarray]]:
    """A run that returns its wall seconds, and a function that returns the final positions."""
    scenes = []
    for w, place in enumerate(places):
        setup = colloids(
            place, dt=DT, steps=steps, seed=w, quantities={"anchor": np.zeros_like(place)}, **options
        )
        scenes.append(setup.model_copy(update={"effects": (TRAP,)}))
    simulation = Simulation(scenes[0], worlds=len(scenes))

    def run() -> float:
        simulation.load(scenes)
        simulation.run()
        return simulation.wall_s

    return run, lambda: np.array([result.state["position"] for result in simulation.results()])


def theirs(
    places: np.ndarray, call: Callable[[np.ndarray], None]
) -> tuple[Callable[[], float], Callable[[], np.ndarray]]:
    """The same for a function that changes an array of positions in place."""
    end = [places]

    def run() -> float:
        end[0] = places.copy()
        began = time.perf_counter()
        call(end[0])
        return time.perf_counter() - began

    return run, lambda: end[0]


def compare(title: str, programs: dict, particle_steps: int, repeats: int, variance: float) -> None:
    """Print the time per particle-step of each program, and tisim's rate over its rate."""
    times: dict[str, list[float]] = {name: [] for name in programs}
    for run, _ in programs.values():
        run()
    for _ in range(repeats):
        for name, (run, _) in programs.items():
            rest()
            times[name].append(run())
    print(f"\n{title}")
    ours = np.array(next(iter(times.values())))
    for name, (_, end) in programs.items():
        ratio = float(np.mean(end() ** 2)) / variance
        each = np.array(times[name])
        speed = f"{spread(1e9 * each / particle_steps)} ns a particle and step"
        print(f"  {name:30s} {speed}, tisim's rate over this {spread(each / ours)}, variance {ratio:.3f}")


def main() -> None:
    """Run and print."""
    ask = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    ask.add_argument("--repeats", type=int, default=5)
    ask.add_argument("--threads", type=int, default=runtime.cores())
    ask.add_argument("--small", action="store_true", help="a tenth of the steps")
    ask.add_argument("--arithmetic", choices=runtime.ARITHMETICS, default="strict")
    options = ask.parse_args()
    runtime.init(threads=options.threads, arithmetic=options.arithmetic)
    numba.set_num_threads(options.threads)
    less = 10 if options.small else 1
    print(
        f"{runtime.backend()}, {options.arithmetic}, numba {numba.__version__}, numpy {np.__version__}, "
        f"{options.threads} threads"
    )

    for worlds, number, steps in ((WORLDS, NUMBER, 4000 // less), (1, 100_000, 100 // less)):
        places = start(worlds, number, 1.0)
        flat = places.reshape(-1, 3)
        programs = {
            "tisim": ours(places, steps),
            "numba, vectorised": theirs(
                flat.T.copy(), lambda r, n=steps: peer.by_blocks(r, n, PULL, WIDTH, 7)
            ),
            "numba, its own normal numbers": theirs(
                flat, lambda r, n=steps: peer.by_library(r, n, PULL, WIDTH)
            ),
        }
        variance = DIFFUSIVITY / RATE / (1 - PULL / 2)
        compare(
            f"without interaction, {worlds} x {number}",
            programs,
            flat.shape[0] * steps,
            options.repeats,
            variance,
        )

    apart, steps = 20.0, max(2, 40 // less)
    places = start(WORLDS, NUMBER, apart)
    variance = (apart * SPREAD) ** 2
    programs = {
        "tisim, exact": ours(places, steps, hydrodynamics="rotne-prager"),
        "numba and LAPACK, exact": theirs(places, lambda r: peer.exact(r, steps, RADIUS, PULL, WIDTH)),
    }
    compare(
        f"Rotne-Prager, {WORLDS} x {NUMBER}, exact",
        programs,
        places.size // 3 * steps,
        options.repeats,
        variance,
    )
    programs = {
        "tisim, fast": ours(places, steps, hydrodynamics="rotne-prager", noise="fast"),
        "numba, fast": theirs(
            np.ascontiguousarray(places.transpose(0, 2, 1)),
            lambda r: peer.fast(r, steps, RADIUS, PULL, WIDTH),
        ),
    }
    compare(
        f"Rotne-Prager, {WORLDS} x {NUMBER}, fast",
        programs,
        places.size // 3 * steps,
        options.repeats,
        variance,
    )


if __name__ == "__main__":
    main()
