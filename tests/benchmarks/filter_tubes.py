"""Capture and pressure drop of a packed filter in round tubes, beside a periodic matrix.

    python tests/benchmarks/filter_tubes.py

Diameters are in lengths of a rod with its caps. Each line has means over packings with 95 % intervals: of the
fraction that passes the matrix, and of the captured fraction and the pressure drop of 10 mm, as if layers
captured independently of each other, each class of colloids by size with a probability of its own.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim.analysis import Mean
from tisim.cases.packed_filter.checks import SLOW, runs, stream
from tisim.cases.packed_filter.lone_fibre import COMPARED_RESOLUTION
from tisim.cases.packed_filter.measures import missing, penetration, penetration_of_layers, pressure_drop
from tisim.cases.packed_filter.problem import DEPTH


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--tubes", type=float, nargs="+", default=[4.0, 2.0, 1.5])
    parser.add_argument("--packings", type=int, default=6)
    options = parser.parse_args()
    print(f"{'tube':>8} {'fibres':>6}  {'passed':18} {'captured in 10 mm':18} Pa in 10 mm")
    for tube in (None, *options.tubes):
        filter = stream(SLOW, tube=tube, resolution=COMPARED_RESOLUTION)
        results = runs(filter, options.packings)
        assert missing(results) == 0
        passed = Mean.of([penetration(one) for one in results])
        layers = DEPTH / filter.matrix.depth
        pressure = Mean.of([pressure_drop(one) * layers for one in results])
        captured = Mean.of([1 - penetration_of_layers(one, layers) for one in results])
        numbers = f"{passed!s:18} {captured!s:18} {pressure}"
        print(f"{tube or 'none':>8} {filter.matrix.number:>6}  {numbers}", flush=True)


if __name__ == "__main__":
    main()
