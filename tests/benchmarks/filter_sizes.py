"""Capture and pressure drop of packed filters of different extent: in round tubes, in a cube twice as wide,
and with the field of more periodic images of the fibres.

    python tests/benchmarks/filter_sizes.py [tubes] [wide] [images]

The slow flow of dynamic separation, with five cells over D. Diameters of tubes are in lengths of a rod with
its caps. Each line has means over packings with 95 % intervals: of the fraction that passes the matrix, and
of the captured fraction and the pressure drop of 10 mm, as if layers captured independently of each other,
each class of colloids by size with a probability of its own. The wide cube is packed as a whole, and is
beside two layers of the usual one, which are as deep. The lines of images have the same packings and
colloids.
"""

from __future__ import annotations

import argparse
import sys
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim.analysis import Mean
from tisim.cases.packed_filter import matrix
from tisim.cases.packed_filter.checks import SLOW, runs, stream
from tisim.cases.packed_filter.lone_fibre import COMPARED_RESOLUTION
from tisim.cases.packed_filter.matrix import IMAGE_REACH, Matrix
from tisim.cases.packed_filter.measures import missing, penetration, penetration_of_layers, pressure_drop
from tisim.cases.packed_filter.problem import DEPTH

PARTS: dict[str, dict[str, dict[str, Any]]] = {
    "tubes": {
        "periodic, no wall": {},
        **{f"tube of {diameter:g} lengths": {"tube": diameter} for diameter in (4.0, 2.0, 1.5)},
    },
    "wide": {"two layers": {"layers": 2}, "a cube twice as wide": {"width": 2 * Matrix.width}},
    "images": {f"images up to {reach:g} lengths away": {"reach": reach} for reach in (0.5, 1.0, 2.0)},
}
"""Settings of each line, by part."""


def line(packings: int, reach: float = IMAGE_REACH, **settings: Any) -> str:
    """The numbers of a line. reach : of the images of fibres, in their lengths."""
    matrix.IMAGE_REACH = reach
    matrix.magnets_of.cache_clear()
    filter = stream(SLOW, resolution=COMPARED_RESOLUTION, **settings)
    results = runs(filter, packings)
    assert missing(results) == 0
    passed = Mean.of([penetration(one) for one in results])
    layers = DEPTH / filter.matrix.depth
    pressure = Mean.of([pressure_drop(one) * layers for one in results])
    captured = Mean.of([1 - penetration_of_layers(one, layers) for one in results])
    return f"{len(filter.matrix.fibres()):>6}  {passed!s:18} {captured!s:18} {pressure}"


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("parts", nargs="*", metavar="PART", choices=[*PARTS, []], default=[])
    parser.add_argument("--packings", type=int, default=6)
    options = parser.parse_args()
    print(f"{'':34} {'fibres':>6}  {'passed':18} {'captured in 10 mm':18} Pa in 10 mm")
    for part in options.parts or PARTS:
        for name, settings in PARTS[part].items():
            print(f"{name:34} {line(options.packings, **settings)}", flush=True)


if __name__ == "__main__":
    main()
