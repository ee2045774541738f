"""Whether the steps of agglomeration in fields are short enough, and their cost.

    python tests/benchmarks/field_steps.py [--designs 64] [--starts 16] [--phases 0.2 0.1 0.05] [--grains 60]
        [--strongest]

Designs are drawn from the ranges of the search; every other one is soft and fast. With --strongest all are
soft, and have the largest charges and magnetic field. The phase is the longest step times the angular
frequency of the fastest oscillation that the fields can cause. For each phase, a line shows the number of
stopped runs, the mean of Pi, its difference from the mean at the last phase with a 95 % interval over the
designs, and the steps of a run.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim.analysis import Mean
from tisim.cases.agglomeration import fields
from tisim.cases.agglomeration.problem import cost, problem
from tisim.cases.agglomeration.scene import scene

STRONGEST = {"surface_charge": 4e-3, "magnetic_field": 1.0, "hardness": 1e5, "friction": 0.01}


def drawn(number: int, strongest: bool) -> list[dict[str, float]]:
    """Return random designs. strongest : all of them soft, with the largest charges and field."""
    genome = problem("small", "fields").genome
    rng = np.random.default_rng(1)
    designs = [dict(genome.decode(u)) for u in rng.random((number, len(genome)))]
    for design in designs[::2]:
        design |= {"hardness": 1e5, "relative_velocity": 180.0}
    return [{**design, **STRONGEST} for design in designs] if strongest else designs


def measured(designs: list[dict[str, float]], starts: int, grains: int) -> tuple[int, np.ndarray, float]:
    """Return the number of stopped runs, Pi for each design and start (NaN if the run was stopped), and the
    steps of a run."""
    results = tisim.run([scene(one, seed, grains) for one in designs for seed in range(starts)])
    pi = np.array([cost(one) if one.status.ok else np.nan for one in results])
    steps = np.mean([one.work["steps"] for one in results])
    return int(np.isnan(pi).sum()), pi.reshape(len(designs), starts), float(steps)


if __name__ == "__main__":
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--designs", type=int, default=64)
    parser.add_argument("--starts", type=int, default=16)
    parser.add_argument("--grains", type=int, default=60)
    parser.add_argument("--phases", type=float, nargs="+", default=[0.2, 0.1, 0.05])
    parser.add_argument("--strongest", action="store_true")
    options = parser.parse_args()
    designs, found = drawn(options.designs, options.strongest), {}
    for phase in options.phases:
        fields.PHASE = phase
        found[phase] = measured(designs, options.starts, options.grains)
    exact = np.nanmean(found[options.phases[-1]][1], axis=1)
    columns = "".join(f" {f'Pi {name}':>9} {'off by':>16}" for name in ("soft", "others"))
    print(f"{'phase':>6} {'stopped':>8}{columns} {'steps':>8}")
    for phase, (stopped, pi, steps) in found.items():
        means = np.nanmean(pi, axis=1)
        parts = (f"{means[k::2].mean():9.4f} {Mean.of((means - exact)[k::2])!s:>16}" for k in (0, 1))
        print(f"{phase:6g} {stopped:8d} {' '.join(parts)} {steps:8.0f}")
