"""The remaining flow of the narrow valve in a field, from other random starts (seeds) than its check uses.

    python tests/benchmarks/valve_starts.py [--first 100] [--starts 12]

Printed are the flow over the flow before the field, with the field and without it; and the flow in the field
over the flow without it, from the same start and at the same time: means with the half widths of their 95 %
intervals. The number of starts in which the last ratio is below a twentieth is also printed. Takes some
minutes.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import tisim
from tisim.cases.valve.runs import ARRESTED, flows, left, left_of
from tisim.cases.valve.scene import FIELD, scene


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--first", type=int, default=100)
    parser.add_argument("--starts", type=int, default=12)
    options = parser.parse_args()
    tisim.init()
    seeds = range(options.first, options.first + options.starts)
    found = flows([scene(flux=flux, seed=seed) for flux in (FIELD, 0.0) for seed in seeds])
    within, without = found[: options.starts], found[options.starts :]
    fewer = sum(
        one.closed_rate < ARRESTED * other.closed_rate for one, other in zip(within, without, strict=True)
    )
    print("left of the flow before:", left(within), "in the field,", left(without), "without one")
    print("in the field over without:", left_of(within, without), f"less than {ARRESTED:g} in {fewer} starts")


if __name__ == "__main__":
    main()
