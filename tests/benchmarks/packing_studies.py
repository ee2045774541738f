"""Make the packings of B16 chapters 2 to 4, print their numbers beside the published ones, and draw their
figures: the tables and figures of docs/packing_study.md.

    python -m tests.benchmarks.packing_studies FOLDER [STUDY ...] [--device cpu] [--threads 1]

Without a STUDY, all are made but the longest rods, which are for a graphics card. Each packing is added to
FOLDER/STUDY.csv as it ends, and is not made again, so a command that was stopped goes on where it was.
"""

import argparse
from hashlib import sha256
from pathlib import Path

import numpy as np

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.backend import runtime
from tisim.cases.packing.comparisons import compared, confined
from tisim.cases.packing.figures import drawn, starts_of
from tisim.cases.packing.snapshots import direction_shares
from tisim.cases.packing.studies import measured_packings, plan_of, plans
from tisim.cases.packing.study_table import STUDIES, PackedRow, read, summary, table

SIZE = "default"


def bodies_file(folder, row):
    """The file with the bodies of a packing."""
    return folder / f"{sha256(repr(row.key()).encode()).hexdigest()[:16]}.npz"


def pack(study, folder):
    """Make the packings that the table does not have, and add each to it."""
    file = folder / f"{study}.csv"
    rows = read(file.read_text()) if file.exists() else []
    with file.open("a") as lines:
        if not rows:
            lines.write(table([]))
        made = {one.key() for one in rows}
        for row, one in measured_packings(plans(study), SIZE, starts_of(study, SIZE), made=made):
            names = ("position", "orientation", "scale", "low", "high", "periodic")
            np.savez(bodies_file(folder, row), **{name: getattr(one.bodies, name) for name in names})
            lines.write(table([row]).split("\n", 1)[1])
            lines.flush()


def packings(study, folder):
    """The lines of a study, and their bodies."""
    made = []
    for row in read((folder / f"{study}.csv").read_text()):
        with np.load(bodies_file(folder, row)) as kept:
            given = {name: kept[name] for name in kept.files}
        periodic = tuple(map(bool, given.pop("periodic")))
        made.append((row, PackedBodies.of(plan_of(row).body(), **given, periodic=periodic)))
    return made


def study_of(name):
    """The study of this name, on the command line."""
    if name not in STUDIES:
        raise argparse.ArgumentTypeError(f"STUDY must be one of {', '.join(STUDIES)}; received {name!r}")
    return name


def main():
    """Make some studies, or all, and print and draw all that are there."""
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("folder", type=Path)
    options.add_argument("studies", nargs="*", metavar="STUDY", type=study_of)
    options.add_argument("--device", default="cpu", choices=runtime.DEVICES)
    options.add_argument("--threads", type=int, default=1)
    given = options.parse_args()
    runtime.init(given.device, threads=given.threads)
    place = given.folder
    place.mkdir(exist_ok=True)
    for study in given.studies or [one for one in STUDIES if one != "longest rods"]:
        pack(study, place)
    made = {study: packings(study, place) for study in STUDIES if (place / f"{study}.csv").exists()}
    free = [row for row, _ in made.get("aspect ratio", [])]
    for study, some in made.items():
        print(f"\n{study}: {len(some)} packings")
        rows = sorted((row for row, _ in some), key=PackedRow.place)
        for cells in summary(rows):
            print("|", " | ".join(cells), "|")
        for cells in confined(rows, free) if free and study in ("cylinder", "wedge") else ():
            print("|", " | ".join(cells), "|")
        print()
        for line in compared(study, rows, free):
            print(line)
        for line in direction_shares(some) if study == "wedge" else ():
            print(line)
    for name, figure in drawn(made).items():
        figure.savefig(place / name, dpi=80)


if __name__ == "__main__":
    main()
