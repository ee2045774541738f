"""Stored values of fitness functions, and the tool that deliberately renews them.

python tests/regression/fitness_record.py          compare this machine's values with the stored ones python
tests/regression/fitness_record.py --write  store this machine's values (after a change of physics)
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim.backend import runtime
from tisim.cases.agglomeration.problem import cost
from tisim.cases.agglomeration.scene import scene
from tisim.optimize import FitnessRecord, Gene, Genome, Objective, Problem

FILE = Path(__file__).with_name("fitness.json")
STARTS = 64
GRAINS = 80

BASE = {
    "relative_velocity": 184.7, "length_ratio": 0.79, "density": 6652.7, "hardness": 2.655e5,
    "heat_capacity": 1796.0, "friction": 0.013, "temperature": 502.0, "activation_energy": 352.0,
    "reaction": 1.7765e6, "surface_energy": 1e16,
}  # fmt: skip
DESIGNS: dict[str, dict[str, float]] = {
    "published": BASE,
    "soft": {**BASE, "hardness": 1e5},
    "hard and slow": {**BASE, "hardness": 1e6, "relative_velocity": 40.0},
    "dilute": {**BASE, "length_ratio": 0.45},
    "cold and reactive": {**BASE, "temperature": 100.0, "activation_energy": 1e3, "reaction": 1e7},
    "fragile": {**BASE, "surface_energy": 1e3},
}
PROBLEM = Problem(
    name="agglomeration of 80 grains",
    genome=Genome(tuple(Gene(name, "", 0.0, 1e17) for name in BASE)),
    scene=lambda design, seed: scene(design, seed, grains=GRAINS),
    objective=(Objective("Pi", cost),),
)


def measure() -> FitnessRecord:
    """Fitness of every design from every random start (seed), with the settings of the runtime."""
    return FitnessRecord.measure(PROBLEM, DESIGNS, STARTS)


def main() -> int:
    """Compare the values, or store them."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--write", nargs="?", type=Path, const=FILE, help="store this machine's values")
    parser.add_argument("--precision", default="f64")
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--threads", type=int, default=0)
    options = parser.parse_args()
    runtime.init(options.device, options.precision, options.threads)
    now = measure()
    if options.write:
        now.save(options.write)
        print(f"stored {options.write.name}")
        return 0
    recorded = FitnessRecord.load(FILE)
    for name, deviation in recorded.deviations(now).items():
        new, old = now.values[name]["Pi"], recorded.values[name]["Pi"]
        same = "same bits" if new == old else f"{deviation:.2f} standard errors apart"
        print(f"{name:20s} {np.mean(new):.6f} (stored {np.mean(old):.6f}): {same}")
    return 0


if __name__ == "__main__":
    sys.exit(main())
