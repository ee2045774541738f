"""The filters found by searches for capture, and the effect of changing one thing in them, start by start.

    python tests/benchmarks/filters.py [--starts 60]

The designs come from docs/capture.md. The random starts (seeds) are held out: no search has used them.
"""

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim import run
from tisim.analysis import Mean
from tisim.cases.capture.problem import captured, problem
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.report.comparison import FRESH

SOFT = {"flux": 0.48, "field_angle": 75.0, "aspect": 2.45, "number": 8.0, "spacing": 3.6}
HARD = {**SOFT, "flux": 0.07, "field_angle": 24.0, "magnetisation_angle": 63.0}
FAST = {**SOFT, "flux": 0.8, "field_angle": 90.0, "aspect": 2.5, "speed": 1e-2, "radius": 208.0}
CHANGES = {
    "fraction": (SOFT, {
        "field at 90 degrees": {"field_angle": 90.0},
        "field at 45 degrees": {"field_angle": 45.0},
        "field along the fibres": {"field_angle": 0.0},
        "one fibre, L/D 20": {"aspect": 20.0, "number": 1.0},
        "three fibres, L/D 20/3": {"aspect": 20 / 3, "number": 3.0},
    }),
    "hard": (HARD, {
        "magnetised at 90 degrees": {"magnetisation_angle": 90.0},
        "magnetised along the fibres": {"magnetisation_angle": 0.0},
        "field at 90 degrees": {"field_angle": 90.0},
        "0.8 T along the magnetisation": {"flux": 0.8, "field_angle": 63.0},
    }),
    "throughput": (FAST, {"half the fibres": {"number": 4.0}}),
}  # fmt: skip
"""For each variant, the design that was found and changes to it. For throughput, the design has all of the
wire, in a flow of 10 mm/s."""


def main(starts):
    seeds = [start_seed(FRESH, k) for k in range(starts)]
    for variant, (best, changes) in CHANGES.items():
        filters = problem(variant=variant)
        designs = [best, *({**best, **change} for change in changes.values())]
        results = run([filters.scene(design, seed) for design in designs for seed in seeds])
        part = np.reshape([captured(result) for result in results], (len(designs), starts))
        print(f"{variant}: {Mean.of(part[0])} captured, {starts} starts, 95 % confidence")
        for name, other in zip(changes, part[1:], strict=True):
            print(f"  {name:30s} {Mean.of(other)}, by {Mean.of(other - part[0])} more")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--starts", type=int, default=60)
    main(parser.parse_args().starts)
