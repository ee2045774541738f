"""The angle of repose of the design whose slope a calibration of avalanche is to reproduce, or of another
design.

    python tests/benchmarks/known_slope.py [--starts 16] [--design 0.6 0.4 10]

Prints the mean, the half width of its 95 % interval and the standard deviation over held-out random starts
(seeds), with the misfit of the mean. A design is friction, rolling friction and cohesion in J/m^3.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim.analysis import Mean
from tisim.cases.avalanche.measures import repose
from tisim.cases.avalanche.problem import EXAMPLE, KNOWN, other_runs


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--starts", type=int, default=16)
    parser.add_argument("--design", type=float, nargs=3, default=list(KNOWN.values()))
    options = parser.parse_args()
    tisim.init()
    design = dict(zip(KNOWN, options.design, strict=True))
    results = tisim.run(other_runs(design, "default", options.starts))
    angles = np.array([repose(result.state) for result in results])
    mean = Mean.of(angles)
    print("of", ", ".join(f"{name} {value:g}" for name, value in design.items()))
    print(f"angle of repose {mean.value:.1f} ± {mean.half:.1f} degrees, deviation {angles.std(ddof=1):.1f}")
    print(f"misfit of the mean {EXAMPLE.misfit(mean.value):.2f}")


if __name__ == "__main__":
    main()
