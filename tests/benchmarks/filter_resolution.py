"""Pressure drop over the fibres of a filter by the grid of the flow, relative to the finest grid.

    python tests/benchmarks/filter_resolution.py [--packings 4]

The fibres are those of two designs of the search, short and long ones. Each line has the number of cells over
the diameter of a fibre and the mean difference in pressure over packings with its 95 % interval. A packing is
left out of a grid that is refused because a fibre spans less than two cells.
"""

from __future__ import annotations

import argparse
import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim import InputError
from tisim.analysis import Mean
from tisim.backend.processor import processor
from tisim.cases.packed_filter.problem import designed
from tisim.sources import PoreFlow

CELLS_TRIED = ((24, 24, 48), (36, 36, 72), (48, 48, 96), (60, 60, 120))
FRACTION = 0.13
ASPECTS = (1.7, 5.0)


def pressure(filter, cells):
    """The pressure gradient of a filter on a grid, as a multiple; None if the grid is refused."""
    box = filter.box()
    flow = next(one for one in replace(filter, cells=cells).stream(filter.matrix.fibres(), box)
                if isinstance(one, PoreFlow))  # fmt: skip
    try:
        return 1 / flow.solve().permeability
    except InputError:
        return None


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--packings", type=int, default=4)
    packings = parser.parse_args().packings
    print(
        f"{processor()['model name']}\n| L/D | cells over D | packings | pressure drop |\n|---|---|---|---|"
    )
    for aspect in ASPECTS:
        design = {"diameter": 0.2e-3, "aspect": aspect, "fraction": FRACTION, "flux": 1.0}
        filters = [designed(design, seed, resolution=1.0) for seed in range(packings)]
        finest = [pressure(one, CELLS_TRIED[-1]) for one in filters]
        low, high = filters[0].stretch(filters[0].box())
        for cells in CELLS_TRIED[:-1]:
            pairs = [(pressure(one, cells), last) for one, last in zip(filters, finest, strict=True)]
            off = [100 * (here / last - 1) for here, last in pairs if here and last]
            across = cells[0] * filters[0].matrix.diameter / (high[0] - low[0])
            mean = f"{Mean.of(off)} %" if len(off) > 1 else "-"
            print(f"| {aspect:g} | {across:.2g} | {len(off)} of {packings} | {mean} |", flush=True)


if __name__ == "__main__":
    main()
