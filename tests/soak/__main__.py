"""The kill matrix: many mishaps of every kind and the damage they cause; exit code 1 if there is any."""

from __future__ import annotations

import argparse
import importlib
import sys
import tempfile
import time
from pathlib import Path

from tests.soak.counts import Counts

MISHAPS = ("searches", "runs", "damage", "scenes")
"""Modules of this package; each has ``soak(seed, share, folder)``, which yields Counts, one for each kind.

seed : of the random choices. share : fraction of the full number of trials, 0..1. folder : an empty folder.
"""


def line(cells: list[str]) -> str:
    """A row of the table, the name first."""
    return f"{cells[0]:<44}" + "".join(f"{cell:>12}" for cell in cells[1:])


def main() -> int:
    parser = argparse.ArgumentParser(prog="tests/soak.sh", description=__doc__)
    parser.add_argument("mishaps", nargs="*", help=f"of {', '.join(MISHAPS)}; all unless given")
    parser.add_argument("--share", type=float, default=1.0, help="part of the trials to make, 0..1")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of what is random")
    options = parser.parse_args()
    print(f"seed {options.seed}")
    print(line(Counts.headings()))
    clean = True
    for name in options.mishaps or MISHAPS:
        module = importlib.import_module(f"tests.soak.{name}")
        with tempfile.TemporaryDirectory() as folder:
            for counts in module.soak(options.seed, options.share, Path(folder)):
                print(line(counts.cells()), flush=True)
                clean &= counts.clean
    return 0 if clean else 1


if __name__ == "__main__":
    sys.exit(main())
