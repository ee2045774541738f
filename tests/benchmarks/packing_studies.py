"""Make the packings of B16 chapters 2 to 4, print their numbers beside the published ones, and draw their
curves: the tables and figures of docs/packing_study.md.

    python -m tests.benchmarks.packing_studies FOLDER [STUDY ...]

Each packing is added to FOLDER/STUDY.csv as it ends, and is not made again, so a command that was stopped
goes on where it was.
"""

import sys
from pathlib import Path

import tisim
from tisim.cases.packing.comparisons import compared
from tisim.cases.packing.figures import drawn, starts_of
from tisim.cases.packing.studies import STUDIES, measured_packings, plans, read, table


def pack(study, file, size="default"):
    """Make the packings that the file does not have, and add each to it."""
    rows = read(file.read_text()) if file.exists() else []
    with file.open("a") as lines:
        if not rows:
            lines.write(table([]))
        made = {one.key() for one in rows}
        for row, _ in measured_packings(plans(study), size, starts_of(study, size), made=made):
            lines.write(table([row]).split("\n", 1)[1])
            lines.flush()
    return read(file.read_text())


def main(folder, *studies):
    """Make, print and draw some studies, or all."""
    tisim.init(threads=1)
    place = Path(folder)
    place.mkdir(exist_ok=True)
    for study in studies or STUDIES:
        pack(study, place / f"{study}.csv")
    rows = {
        study: read((place / f"{study}.csv").read_text())
        for study in STUDIES
        if (place / f"{study}.csv").exists()
    }
    for study, some in rows.items():
        print(f"\n{study}: {len(some)} packings")
        for line in compared(study, some, rows["aspect ratio"]):
            print(line)
    for name, figure in drawn(rows).items():
        figure.savefig(place / name, dpi=80)


if __name__ == "__main__":
    main(*sys.argv[1:])
