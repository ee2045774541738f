"""Figures of the case packing: a packing coloured by contacts, and all figures of B16 chapters 2 to 4."""

from collections.abc import Callable, Mapping

from matplotlib.figure import Figure

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.cases.packing import curves, snapshots
from tisim.cases.packing.studies import PackedRow, Study, packed, plans, table
from tisim.engine.batches import Progress, progress_of_part
from tisim.io.reader import Frames
from tisim.plotting.style import empty, letters, plain

STARTS = {"small": 2, "default": 3, "paper": 3}
"""Random starts of each packing, by size."""
CYLINDER_STARTS = {"small": 2, "default": 5, "paper": 5}
"""Random starts of each packing in a cylinder."""
DRAWN: tuple[Study, ...] = ("aspect ratio", "moment of inertia", "cylinder", "wedge", "superballs")


def pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """packing.png: the bodies at the end, coloured by their contacts, and the packing fraction over the
    attempts."""
    every = list(trajectory)
    last = PackedBodies.from_state(every[-1].arrays, trajectory.scene)
    figure = empty(10.4, 5.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    snapshots.draw_by_contacts(left, last)
    snapshots.contact_scale(figure, [left])
    fractions = [packing_fraction(PackedBodies.from_state(one.arrays, trajectory.scene)) for one in every]
    right.plot(trajectory.times, fractions, color=curves.COLOURS[0])
    right.set(xlabel="attempts", ylabel="packing fraction", ylim=(0, None))
    plain(right)
    letters((left, right))
    return {"packing.png": figure}


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """rods.png, inertia.png, cylinder.png, wedge.png, superballs.png: densities, contacts and order; pictures
    of packings in cylinders.png, wedges.png and superball_packings.png; wedge_directions.png; and
    packings.csv with all packings of a size."""
    parts = len(DRAWN) + len(snapshots.SNAPSHOTS) + 1
    rows: dict[Study, list[PackedRow]] = {}
    for k, study in enumerate(DRAWN):
        rows[study] = packed(plans(study), size, starts_of(study, size), progress_of_part(progress, k, parts))
    made: dict[str, Figure | str] = {**drawn(rows)}
    for k, (name, (chosen, *layout)) in enumerate(snapshots.SNAPSHOTS.items(), len(DRAWN)):
        columns, height = layout
        made[name] = snapshots.snapshots(chosen, size, columns, height, progress_of_part(progress, k, parts))
    last = progress_of_part(progress, parts - 1, parts)
    made["wedge_directions.png"] = snapshots.wedge_directions(size, STARTS[size], last)
    return {**made, "packings.csv": table(one for some in rows.values() for one in some)}


def starts_of(study: Study, size: str) -> int:
    """Return the number of random starts of each packing of a study."""
    return (CYLINDER_STARTS if study == "cylinder" else STARTS)[size]


def drawn(rows: Mapping[Study, list[PackedRow]]) -> dict[str, Figure]:
    """Return the figures of the curves of studies; rods in a periodic box are always among them."""
    free = rows["aspect ratio"]
    draw: Mapping[Study, tuple[str, Callable[[list[PackedRow]], Figure]]] = {
        "aspect ratio": ("rods.png", lambda some: curves.of_rods([*some, *rows.get("long rods", [])])),
        "moment of inertia": ("inertia.png", curves.of_inertia),
        "cylinder": ("cylinder.png", lambda some: curves.of_cylinders(some, free)),
        "wedge": ("wedge.png", lambda some: curves.of_wedges(some, free)),
        "superballs": ("superballs.png", curves.of_superballs),
    }
    return {name: made(rows[study]) for study, (name, made) in draw.items() if study in rows}
