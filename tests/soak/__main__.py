"""The kill matrix: every kind of mishap many times over, and what each has cost. Exit code 1 unless nothing."""

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

seed : of what is random. share : part of the full number of trials to make, 0..1. folder : an empty one.
"""


def main() -> int:
    parser = argparse.ArgumentParser(prog="tests/soak.sh", description=__doc__)
    parser.add_argument("mishaps", nargs="*", help=f"of {', '.join(MISHAPS)}; all unless given")
    parser.add_argument("--share", type=float, default=1.0, help="part of the trials to make, 0..1")
    parser.add_argument("--seed", type=int, default=int(time.time()), help="of what is random")
    asked = parser.parse_args()
    print(f"seed {asked.seed}")
    print("".join(f"{heading:>12}" if k else f"{heading:<44}" for k, heading in enumerate(Counts.headings())))
    clean = True
    for name in asked.mishaps or MISHAPS:
        module = importlib.import_module(f"tests.soak.{name}")
        with tempfile.TemporaryDirectory() as folder:
            for counts in module.soak(asked.seed, asked.share, Path(folder)):
                cells = counts.cells()
                print("".join(f"{cell:>12}" if k else f"{cell:<44}" for k, cell in enumerate(cells)), flush=True)
                clean &= counts.clean
    return 0 if clean else 1


if __name__ == "__main__":
    sys.exit(main())
