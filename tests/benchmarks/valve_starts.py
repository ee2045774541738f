"""What a field leaves of the flow of the narrow valve, from other random starts than those of its check.

    python tests/benchmarks/valve_starts.py [--first 100] [--starts 12]

Printed are what is left of the flow before the field, with it and without it, and what flows in it over what
flows without it from the same start, as late: means with half of their 95 % intervals, and in how many starts
that is less than a twentieth. Some minutes.
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
