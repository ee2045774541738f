"""The effect of grain stiffness on the stress in a sheared magnetorheological fluid.

    python tests/benchmarks/mrf_stiffness.py [--starts 8] [--young 0.5e9 1e9 2e9 4e9]

The cell of a search of mrf_shear at 10 000 1/s, in steps that suit the stiffest grains. Printed are the
stress, its ratio to the stress with L21's 1 GPa from the same starts, and the largest overlap over a radius;
means with the half widths of their 95 % intervals. Takes some minutes.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim.analysis import Mean
from tisim.cases.common.runs import overlap, sound
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.measures import shear_stress
from tisim.cases.mrf_shear.scene import LARGE_RADIUS, SEARCHED, impact_step, scene


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--starts", type=int, default=8)
    parser.add_argument("--young", type=float, nargs="+", default=[0.5e9, 1e9, 2e9, 4e9])
    options = parser.parse_args()
    tisim.init()
    moduli = [published.YOUNG, *(one for one in options.young if one != published.YOUNG)]
    dt = impact_step(LARGE_RADIUS, max(moduli))
    runs = [
        scene(**SEARCHED, young=young, dt=dt, seed=seed) for young in moduli for seed in range(options.starts)
    ]
    results = sound(tisim.run(runs))
    stress, deep = (
        np.reshape([measure(one) for one in results], (len(moduli), -1))
        for measure in (shear_stress, overlap)
    )
    print("| Young's modulus, GPa | stress, kPa | over that at L21's 1 GPa | overlap over a radius |")
    print("|---|---|---|---|")
    for young, own, depth in zip(moduli, stress, deep, strict=True):
        cells = (f"{1e-9 * young:g}", Mean.of(1e-3 * own), Mean.of(own / stress[0]), Mean.of(depth))
        print(f"| {' | '.join(map(str, cells))} |")


if __name__ == "__main__":
    main()
