"""Capture in a packed filter by the aspect ratio of its fibres, and by their angle to the field.

    python tests/benchmarks/filter_aspects.py [--aspects 2 5 10] [--parallel x y z] [--packings 6] [--flow]

All matrices have fibres of the same diameter and the same solid fraction. The first table has static
separation: the captured fraction after each waiting time, and the captures of a fibre over their mean for all
fibres of its packing, for fibres across the field and along it. With --flow there is a second table, of
dynamic separation: captured fraction and pressure drop of 10 mm. With --parallel all fibres lie along one of
these axes in place of random directions; the field is along x and the flow along z. Means over packings with
95 % intervals.
"""

from __future__ import annotations

import argparse
import sys
from itertools import pairwise, product
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim.analysis import Mean
from tisim.backend.processor import processor
from tisim.cases.packed_filter.checks import COLLOIDS, SLOW, WAITS, runs, stream
from tisim.cases.packed_filter.lone_fibre import COMPARED_RESOLUTION
from tisim.cases.packed_filter.measures import (
    ANGLE_CLASSES,
    captured_fraction,
    captures_by_angle,
    missing,
    penetration_of_layers,
    pressure_drop,
)
from tisim.cases.packed_filter.problem import DEPTH
from tisim.cases.packed_filter.scene import filter_of
from tisim.sources.pore_flow.pore_flow import AXIS_NAMES


def name(aspect: float, parallel: str | None) -> str:
    """The name of a line."""
    return f"{aspect:g}" + (f", along {parallel}" if parallel else "")


def static_line(aspect: float, parallel: str | None, packings: int) -> str:
    """The line of static separation."""
    settings = {"aspect": aspect, "parallel": parallel, "duration": WAITS[-1], "number": COLLOIDS}
    filter = filter_of("small", "static", **settings)
    results = runs(filter, packings)
    captured = [Mean.of([captured_fraction(one, wait) for one in results]) for wait in WAITS]
    by_angle = np.array([captures_by_angle(one) for one in results])
    of_angle = [Mean.of(column[np.isfinite(column)]) if parallel is None else "" for column in by_angle.T]
    return " | ".join(
        f"{one}" for one in (name(aspect, parallel), filter.matrix.number, *captured, *of_angle)
    )


def dynamic_line(aspect: float, parallel: str | None, packings: int) -> str:
    """The line of dynamic separation."""
    filter = stream(SLOW, aspect=aspect, parallel=parallel, resolution=COMPARED_RESOLUTION)
    results = runs(filter, packings)
    assert missing(results) == 0
    layers = DEPTH / filter.matrix.depth
    captured = Mean.of([1 - penetration_of_layers(one, layers) for one in results])
    pressure = Mean.of([pressure_drop(one) * layers for one in results])
    return " | ".join(
        (name(aspect, parallel), f"{1e3 * filter.matrix.depth:.3g} mm", str(captured), str(pressure))
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--aspects", type=float, nargs="+", default=[2.0, 5.0, 10.0])
    parser.add_argument("--parallel", choices=AXIS_NAMES, nargs="+")
    parser.add_argument("--packings", type=int, default=6)
    parser.add_argument("--flow", action="store_true")
    options = parser.parse_args()
    print(processor()["model name"])
    edges = np.degrees(np.arccos(np.arange(ANGLE_CLASSES + 1) / ANGLE_CLASSES))
    angles = [f"{flat:.0f} to {steep:.0f} degrees" for steep, flat in pairwise(edges)]
    print(" | ".join(["| L/D", "fibres", *(f"{wait:g} s" for wait in WAITS), *angles]) + " |")
    lines = list(product(options.aspects, options.parallel or [None]))
    for aspect, parallel in lines:
        print(f"| {static_line(aspect, parallel, options.packings)} |", flush=True)
    for aspect, parallel in lines if options.flow else ():
        print(f"| {dynamic_line(aspect, parallel, options.packings)} |", flush=True)


if __name__ == "__main__":
    main()
