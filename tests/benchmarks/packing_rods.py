"""Print packing fraction and contact number of rods by aspect ratio, the table in docs/packings.md, and draw
its figure. About seven minutes on one core of an AMD EPYC (Zen 4).

    python -m tests.benchmarks.packing_rods [packings_rods.png]
"""

import sys

from tisim.cases.packing.figures import of_rods
from tisim.cases.packing.studies import means, packed, plans

LONGEST, STARTS, ATTEMPTS = 5.0, 3, 2000


def main(*files: str) -> None:
    """Pack 200 rods or more of each aspect ratio from three starts, and print means with their intervals."""
    chosen = [one for one in plans("aspect ratio") if one.method == "original" and one.shape <= LONGEST]
    rows = packed(chosen, "default", STARTS, attempts=ATTEMPTS)
    fraction, contacts = (means(rows, ("shape",), name) for name in ("fraction", "contacts"))
    print("| Lambda = L/D + 1 | packing fraction | contact number |\n|---|---|---|")
    for key, value in fraction.items():
        print(f"| {key[0]:.1f} | {value} | {contacts[key]} |")
    for file in files:
        of_rods(rows).savefig(file, dpi=80)


if __name__ == "__main__":
    main(*sys.argv[1:])
