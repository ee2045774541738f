"""The measured quantities of a known design, and how well they distinguish it from others.

    python tests/benchmarks/draw_down.py [--size small] [--starts 8] [--design 0.4 0.27 0.6]
    python tests/benchmarks/draw_down.py --valley [--size small] [--starts 2]

The first form prints each quantity of cases/granular_bench/problem.py: its mean with the half width of the
95 % interval, its standard deviation over held-out random starts (seeds), and its uncertainty in a
calibration; and the misfit of the means, with its 95 % interval. A design is friction, rolling friction and
restitution. With --valley, for each friction it prints the rolling friction whose angle of repose and
discharge rate, means over the starts, are nearest to the known design at the same restitution, with these
values and their misfit.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim.analysis import Mean
from tisim.cases.granular_bench.problem import (
    EXAMPLES,
    KNOWN,
    SIMULATED,
    UNCERTAINTIES,
    calibration_to,
    other_runs,
)
from tisim.optimize.evaluation.estimate import FitnessEstimate

FRICTIONS = (0.2, 0.3, 0.4, 0.6, 0.8, 1.0)
ROLLING_FRICTIONS = (0.19, 0.23, 0.27, 0.31, 0.35)
BULK = ("angle_of_repose", "discharge_rate")


def measured(design: dict[str, float], size: str, starts: int) -> None:
    """Print the quantities of a design."""
    results = tisim.run(other_runs(design, size, starts))
    print("of", ", ".join(f"{name} {value:g}" for name, value in design.items()))
    print(f"{'quantity':16} {'mean':>16} {'deviation':>9} {'uncertainty':>11}")
    for name, measure in SIMULATED.items():
        values = np.array([measure(result) for result in results])
        print(f"{name:16} {Mean.of(values)!s:>16} {values.std(ddof=1):9.2g} {UNCERTAINTIES[name]:11g}")
    (objective,) = calibration_to(EXAMPLES[size], size).objectives
    values = np.array([list(objective.of(result).values()) for result in results])
    found = FitnessEstimate.of(objective, values, converged=True)
    print(f"misfit {found.mean:.2g}, 95 % interval {found.low:.2g} to {found.high:.2g}")


def valley(size: str, starts: int) -> None:
    """For each friction, print the design nearest to KNOWN in angle of repose and discharge rate."""
    designs = [
        {**KNOWN, "friction": mu, "rolling_friction": rolling}
        for mu in FRICTIONS for rolling in ROLLING_FRICTIONS
    ]  # fmt: skip
    results = tisim.run([scene for design in designs for scene in other_runs(design, size, starts)])
    shape = (len(FRICTIONS), len(ROLLING_FRICTIONS), starts)
    means = {
        name: np.reshape([SIMULATED[name](result) for result in results], shape).mean(axis=2) for name in BULK
    }
    wanted = EXAMPLES[size]
    misfits = sum(wanted[name].misfit(means[name]) for name in BULK) / len(BULK)
    print("friction  rolling friction  angle of repose  discharge rate  misfit")
    for k, mu in enumerate(FRICTIONS):
        best = int(np.argmin(np.nan_to_num(misfits[k], nan=np.inf)))
        angle, rate = (means[name][k, best] for name in BULK)
        print(f"{mu:8g}  {ROLLING_FRICTIONS[best]:16g}  {angle:15.1f}  {rate:14.3f}  {misfits[k, best]:6.2f}")


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--size", default="small")
    parser.add_argument("--starts", type=int)
    parser.add_argument("--valley", action="store_true")
    parser.add_argument("--design", type=float, nargs=3, default=list(KNOWN.values()))
    options = parser.parse_args()
    tisim.init()
    if options.valley:
        valley(options.size, options.starts or 2)
    else:
        design = dict(zip(KNOWN, options.design, strict=True))
        measured(design, options.size, options.starts or 8)


if __name__ == "__main__":
    main()
