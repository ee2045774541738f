"""The ratio of the yield stresses of grains of two sizes and of equal grains, by Bingham's law.

    python tests/benchmarks/mrf_mixture.py [--starts 3] [--rates 2000 5000 10000]

The cell of a search of mrf_shear, with equal grains and with a third of the volume in grains half the size,
at each shear rate (1/s). Printed are the stresses, the yield stress and the plastic viscosity of Bingham's
law, and the ratio of the two yield stresses; means over starts with the half widths of their 95 % intervals.
Mixtures have three times the number of grains, and steps half as long: this takes a quarter of an hour.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim.analysis import Mean
from tisim.cases.common.magnetorheological_fluid import SWEPT
from tisim.cases.common.runs import grouped
from tisim.cases.mrf_shear.flow_curve import AS_PUBLISHED, MIXED, VARIATIONS, Curve
from tisim.cases.mrf_shear.scene import RATES, SEARCHED, scene


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--starts", type=int, default=3)
    parser.add_argument("--rates", type=float, nargs="+", default=list(RATES))
    options = parser.parse_args()
    tisim.init()
    curves = {}
    for part in (AS_PUBLISHED, MIXED):
        made = [
            scene(**{**SEARCHED, **VARIATIONS[part], "rate": rate}, seed=seed).replace(SWEPT)
            for rate in options.rates
            for seed in range(options.starts)
        ]
        curve = curves[part] = Curve(np.array(options.rates), grouped(made, options.starts))
        print(f"{part}:")
        for rate, stress in zip(curve.x, curve.of_starts, strict=True):
            each = ", ".join(f"{1e-3 * one:.4g}" for one in stress)
            print(f"  {rate:g} 1/s: {Mean.of(1e-3 * stress)} kPa ({each})")
        fit = curve.bingham()
        viscosity = Mean(*fit.plastic_viscosity)
        print(
            f"  yield stress {Mean.of(1e-3 * curve.yield_stresses())} kPa, viscosity {viscosity} Pa s",
            flush=True,
        )
    rise = curves[MIXED].yield_stresses() / curves[AS_PUBLISHED].yield_stresses()
    print(f"yield stress of the mixture over that of equal grains: {Mean.of(rise)}")


if __name__ == "__main__":
    main()
