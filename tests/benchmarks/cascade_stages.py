"""The time to capture 90 % of the particles of 25 nm in cascades of fibres across the field, by the time of a
stage.

    python tests/benchmarks/cascade_stages.py [--repeats 24]
"""

from __future__ import annotations

import argparse

from tisim.analysis import Mean
from tisim.cases.cascade.problem import GIVEN_UP, NANOMETRES
from tisim.cases.cascade.scene import PlannedCascade
from tisim.cases.cascade.statistics import CAPTURED_SHARE, OFF, captured_at, time_to

TIMES = (10.0, 20.0, 40.0, 70.0, 100.0)
"""Times of a stage, s; B16 has 10 s."""


def main() -> None:
    options = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    options.add_argument("--repeats", type=int, default=24)
    repeats = options.parse_args().repeats
    cascades = [PlannedCascade(NANOMETRES, gap=OFF, stages=(time,)) for time in TIMES]
    captured = captured_at(cascades, repeats, seed=99, longest=GIVEN_UP)
    for time, times in zip(TIMES, captured, strict=True):
        print(f"stages of {time:g} s: {Mean.of(time_to(CAPTURED_SHARE, times))} s")


if __name__ == "__main__":
    main()
