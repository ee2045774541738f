"""Error against time of the case ``vibration`` beside scipy's steppers, all in one run.

    python tests/benchmarks/vibration_precision.py [--repeats 5] [--threads 2] [--out out/vibration_precision]

343 particles, the published parameters, 0.005 s, Omega = 0.8 w (Z13 section 4; beyond some 0.01 s single
trajectories are chaotic). Peers: DOP853 and RK45 of scipy.integrate.solve_ivp, with a right-hand side in
vectorised NumPy, and with ones compiled by numba with all freedom to vectorise, on one thread and on all.
Error: root mean square distance of particles from the reference, over the root mean square displacement. The
reference is DOP853 at rtol 1e-13; the run of tisim at 1e-12 indicates its accuracy. Time: the median of runs
that alternate, without compilation. Prints a table, and for every decade of error the fastest method of each
kind; writes work_precision.png and work_precision.csv.
"""

import argparse
import csv
import os
import sys
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from pathlib import Path

# Small parallel loops get slow if tbb is installed and numba prefers it.
os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp workqueue tbb")
os.environ.setdefault("OMP_WAIT_POLICY", "passive")
sys.path.insert(0, str(Path(__file__).parents[2]))

import numba
import numpy as np
from scipy.integrate import solve_ivp

from tisim import Simulation
from tisim.backend import runtime
from tisim.cases.vibration import scene as vibration
from tisim.plotting.style import empty, letters, plain
from tisim.steppers import Collocation, ErrorControl, StageControl, Stepper, Trapezoid

RATIO, DURATION = 0.8, 0.005
OMEGA = RATIO * vibration.CYCLOTRON
COLOURS = ("#bbbbbb", "#ee8866", "#cc6677", "#777777", "#ddaa33", "#aa4499", "#88ccee", "#4477aa", "#117733",
           "#332288", "#000000")  # fmt: skip
SLOW = 0.4
"""Settings that take longer than this (wall seconds) are run once."""
DECADES = range(3, 9)
"""Errors of 1e-3 to 1e-8."""


def by_numpy(x: np.ndarray) -> np.ndarray:
    """Sum of the near field over all pairs; x is (3, n), m; N."""
    d = x[:, :, None] - x[:, None, :]
    square = (d * d).sum(axis=0)
    np.fill_diagonal(square, 1.0)
    push = (vibration.REPULSION / np.sqrt(square) - vibration.ATTRACTION) / square
    return (push * d).sum(axis=2)


def in_numba(x):
    """The same, in loops that a compiler can vectorise."""
    n = x.shape[1]
    out = np.empty_like(x)
    attraction, repulsion = vibration.ATTRACTION, vibration.REPULSION
    for i in numba.prange(n):
        fx, fy, fz = 0.0, 0.0, 0.0
        xi, yi, zi = x[0, i], x[1, i], x[2, i]
        for j in range(n):
            dx, dy, dz = xi - x[0, j], yi - x[1, j], zi - x[2, j]
            square = dx * dx + dy * dy + dz * dz
            square += 1.0 if square == 0.0 else 0.0  # of the particle with itself
            push = (repulsion / np.sqrt(square) - attraction) / square
            fx, fy, fz = fx + push * dx, fy + push * dy, fz + push * dz
        out[0, i], out[1, i], out[2, i] = fx, fy, fz
    return out


FREELY = {"fastmath": True, "error_model": "numpy"}
by_numba = numba.njit(**FREELY)(in_numba)
by_numba_parallel = numba.njit(parallel=True, **FREELY)(in_numba)
SIDES = {"NumPy": by_numpy, "numba": by_numba, "numba, parallel": by_numba_parallel}


def rates(near: Callable[[np.ndarray], np.ndarray], start: np.ndarray) -> Callable:
    """Right-hand side for scipy: near field, tether, and Lorentz force (Z13 1, 12, 23)."""
    n = start.size

    def evaluate(t: float, y: np.ndarray) -> np.ndarray:
        x, v = y[:n].reshape(3, -1), y[n:].reshape(3, -1)
        force = near(x) - vibration.STIFFNESS * (x - start)
        force[0] += vibration.CHARGE * (vibration.FIELD * np.sin(OMEGA * t) + vibration.FLUX * v[1])
        force[1] -= vibration.CHARGE * vibration.FLUX * v[0]
        return np.concatenate([y[n:], force.ravel() / vibration.MASS])

    return evaluate


@dataclass
class Point:
    """One setting of one method, and its result."""

    method: str
    setting: str
    run: Callable[[], tuple[np.ndarray, int, float]]
    seconds: list[float] = field(default_factory=list)
    error: float = np.nan
    work: int = 0

    def measure(self, truth: np.ndarray, start: np.ndarray) -> None:
        """Run once more."""
        positions, self.work, seconds = self.run()
        self.seconds.append(seconds)
        self.error = distance(positions, truth) / distance(truth, start)

    def median(self) -> float:
        """Median of the wall seconds."""
        return float(np.median(self.seconds))


def distance(a: np.ndarray, b: np.ndarray) -> float:
    """Root of the mean square distance of particles, m."""
    return float(np.sqrt(((a - b) ** 2).sum(axis=0).mean()))


def scipy_point(method: str, near: Callable, name: str, start: np.ndarray, rtol: float) -> Point:
    """A run of solve_ivp; atol is rtol times a micrometre-sized displacement."""
    y, evaluate = np.concatenate([start.ravel(), np.zeros(start.size)]), rates(near, start)

    def run() -> tuple[np.ndarray, int, float]:
        began = time.perf_counter()
        solution = solve_ivp(
            evaluate, (0.0, DURATION), y, method, t_eval=[DURATION], rtol=rtol, atol=rtol * 1e-2
        )
        seconds = time.perf_counter() - began
        return solution.y[: start.size, -1].reshape(3, -1), int(solution.nfev), seconds

    return Point(f"{method}, {name}", f"rtol={rtol:.0e}", run)


_compiled: dict[object, Simulation] = {}


def tisim_point(name: str, stepper: Stepper, setting: str) -> Point:
    """A run of the case; simulations are compiled once for each structure."""
    scene = vibration.scene(RATIO, duration=DURATION).model_copy(update={"stepper": stepper})
    if scene.structure() not in _compiled:
        _compiled[scene.structure()] = Simulation(scene)
    simulation = _compiled[scene.structure()]

    def run() -> tuple[np.ndarray, int, float]:
        simulation.load([scene])
        began = time.perf_counter()
        simulation.run()
        seconds = time.perf_counter() - began
        (result,) = simulation.results()
        assert result.status.ok, result.status.reason
        places = result.state["position"][np.argsort(result.state["id"])].T
        return places, result.work["force_evaluations"], seconds

    return Point(name, setting, run)


def points(start: np.ndarray) -> list[Point]:
    """Every method over its settings."""
    results = []
    for exponent in np.arange(2.0, 11.0):
        for method in ("DOP853", "RK45"):
            for name, near in SIDES.items():
                results.append(scipy_point(method, near, name, start, 10.0**-exponent))
    for stages in (3, 4, 5, 6):
        for error in (10.0 ** -np.arange(1.0, 10.0, 0.5)).tolist():
            stepper = Collocation(stages=stages, control=StageControl(error=error))
            results.append(tisim_point(f"Collocation, {stages} stages", stepper, f"error={error:.1e}"))
    for error in (10.0 ** -np.arange(1.0, 6.0, 0.5)).tolist():
        control = ErrorControl(error=error, tolerance=error / 10, first=1e-6, longest=1e-3)
        results.append(tisim_point("Trapezoid", Trapezoid(control=control), f"error={error:.1e}"))
    return results


def fastest(results: list[Point], ours: bool, error: float) -> Point | None:
    """The fastest with at most this error, in tisim or in the others."""
    good = [p for p in results if (", n" in p.method.lower()) != ours and p.error <= error]
    return min(good, key=Point.median, default=None)


def draw(results: list[Point], path: Path) -> None:
    """Error against time and against work, a line for each method."""
    figure = empty(11.0, 5.4)
    axes = figure.subplots(1, 2, sharey=True)
    for k, method in enumerate(dict.fromkeys(p.method for p in results)):
        line = [p for p in results if p.method == method and p.error < 0.3]
        style = {"ls": "--", "marker": "s"} if ", n" in method.lower() else {"ls": "-", "marker": "o"}
        for axis, size in zip(axes, (Point.median, lambda p: p.work), strict=True):
            axis.loglog([size(p) for p in line], [p.error for p in line], ms=3, color=COLOURS[k], **style)
        axes[0].lines[-1].set_label(method)
    axes[0].set(xlabel="wall time (s)", ylabel="error of positions", title="343 particles, 0.005 s")
    axes[1].set(xlabel="force evaluations", title="the same against work")
    figure.legend(loc="outside lower center", fontsize=8, ncols=4, frameon=False)
    for axis in axes:
        plain(axis)
    letters(axes)
    figure.savefig(path, dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--threads", type=int, default=os.cpu_count())
    parser.add_argument("--out", type=Path, default=Path("out/vibration_precision"))
    options = parser.parse_args()
    runtime.init(threads=options.threads)
    numba.set_num_threads(options.threads)
    arrays = vibration.scene(RATIO).particles.arrays(vibration.scene(RATIO).domain, 0)
    start = np.ascontiguousarray(arrays["position"].T)
    truth, _, _ = scipy_point("DOP853", by_numba, "reference", start, 1e-13).run()
    finest = Collocation(stages=6, control=StageControl(error=1e-12, sweeps=20))
    second, _, _ = tisim_point("reference", finest, "").run()
    print(f"references apart: {distance(truth, second) / distance(truth, start):.1e}")
    for name, near in SIDES.items():
        near(start)
        began = time.perf_counter()
        for _ in range(20):
            near(start)
        print(f"one force evaluation by {name}: {(time.perf_counter() - began) / 20 * 1e6:.0f} us")
    results = points(start)
    for _ in range(options.repeats + 1):
        for point in results:
            # A much slower setting need not be timed to the last digit.
            if not point.seconds or min(point.seconds) < SLOW:
                point.measure(truth, start)
    for point in results:
        # The first run of a numba function compiles it.
        point.seconds = point.seconds[1:] or point.seconds
        spread = max(point.seconds) - min(point.seconds)
        print(
            f"{point.method:24s} {point.setting:14s} error {point.error:.1e}  {point.median() * 1e3:8.2f} ms "
            f"(spread {spread * 1e3:.2f})  {point.work:6d} force evaluations"
        )
    for decade in DECADES:
        ours, theirs = fastest(results, True, 10.0**-decade), fastest(results, False, 10.0**-decade)
        if ours and theirs:
            print(
                f"1e-{decade}: {ours.method} ({ours.setting}) {ours.median() * 1e3:.2f} ms; {theirs.method} "
                f"({theirs.setting}) {theirs.median() * 1e3:.2f} ms, {theirs.median() / ours.median():.2f} "
                f"times the time, {theirs.work / ours.work:.2f} times the sums"
            )
    options.out.mkdir(parents=True, exist_ok=True)
    draw(results, options.out / "work_precision.png")
    with (options.out / "work_precision.csv").open("w", newline="") as file:
        table = csv.writer(file)
        table.writerow(("method", "setting", "error", "seconds", "sums_of_forces"))
        table.writerows((p.method, p.setting, p.error, p.median(), p.work) for p in results)


if __name__ == "__main__":
    main()
