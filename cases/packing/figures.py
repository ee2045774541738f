"""Figures of the case packing: a packing coloured by contacts, and all figures of B16 chapters 2 to 4."""

from collections.abc import Callable, Mapping
from dataclasses import replace

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import FractionProfile, fraction_profile, packing_fraction
from tisim.cases.packing import curves, snapshots
from tisim.cases.packing.measures import contact_counts
from tisim.cases.packing.overlap_removal import removal_figure, removal_table, removals
from tisim.cases.packing.snapshots import Packing
from tisim.cases.packing.studies import container_of, measured_packings, plans
from tisim.cases.packing.study_table import PackedRow, Study, table
from tisim.engine.batches import Progress, progress_of_part
from tisim.io.reader import Frames
from tisim.plotting.packings import order, structure
from tisim.plotting.style import empty, letters, plain

STARTS = {"small": 2, "default": 3, "paper": 3}
"""Random starts of each packing, by size."""
CYLINDER_STARTS = {"small": 2, "default": 3, "paper": 5}
"""Random starts of each packing in a cylinder."""
PROFILE_DEPTH, PROFILE_BINS = 4.0, 40
"""Distance (D) from a wall up to which the packing fraction is drawn, and number of layers."""
DRAWN: tuple[Study, ...] = ("aspect ratio", "moment of inertia", "cylinder", "wedge", "superballs")


def pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """packing.png: the bodies at the end, coloured by their contacts, and the number of bodies by contacts,
    with the packing fraction."""
    last = PackedBodies.from_state(trajectory[-1].arrays, trajectory.scene)
    figure = empty(10.4, 5.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    snapshots.draw_by_contacts(left, last)
    numbers = np.bincount(contact_counts(last))
    contacts = np.arange(len(numbers))
    right.bar(contacts, numbers, color=snapshots.contact_colours(contacts))
    right.set(xlabel="contacts of a body, and colour", ylabel="bodies")
    right.set_title(f"packing fraction {packing_fraction(last):.3f}")
    right.yaxis.set_major_locator(MaxNLocator(integer=True))
    plain(right)
    letters((left, right))
    return {"packing.png": figure}


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """rods.png, inertia.png, cylinder.png, wedge.png, superballs.png: densities, contacts and order; pictures
    of packings in cylinders.png, wedges.png and superball_packings.png; wedge_directions.png; structure.png
    with neighbours and pores; order.png with rattlers, bond order and layers at walls; overlaps.png and
    overlaps.csv, the overlaps of triples by attempt; and packings.csv with all packings of a size."""
    made: dict[Study, list[Packing]] = {}
    for k, study in enumerate(DRAWN):
        part = progress_of_part(progress, k, len(DRAWN))
        found = measured_packings(plans(study), size, starts_of(study, size), part)
        made[study] = [(row, one.bodies) for row, one in found]
    rows = [row for some in made.values() for row, _ in some]
    removed = removals(size)
    overlaps: dict[str, Figure | str] = {
        "overlaps.png": removal_figure(removed),
        "overlaps.csv": removal_table(removed),
    }
    return {**drawn(made), **overlaps, "packings.csv": table(rows)}


def starts_of(study: Study, size: str) -> int:
    """Return the number of random starts of each packing of a study."""
    return (CYLINDER_STARTS if study == "cylinder" else STARTS)[size]


def drawn(made: Mapping[Study, list[Packing]]) -> dict[str, Figure]:
    """Return the figures of studies. Those of cylinders and wedges need rods in a periodic box as well."""
    # Packings end in any order.
    made = {study: sorted(some, key=lambda one: one[0].place()) for study, some in made.items()}
    rows = {study: [row for row, _ in some] for study, some in made.items()}
    free = rows.get("aspect ratio", [])
    long = [*rows.get("long rods", []), *rows.get("longest rods", [])]
    curves_of: dict[str, tuple[Study, Callable[[list[PackedRow]], Figure]]] = {
        "rods.png": ("aspect ratio", lambda some: curves.of_rods([*some, *long])),
        "inertia.png": ("moment of inertia", curves.of_inertia),
        "superballs.png": ("superballs", curves.of_superballs),
    }
    if free:
        curves_of |= {
            "cylinder.png": ("cylinder", lambda some: curves.of_cylinders(some, free)),
            "wedge.png": ("wedge", lambda some: curves.of_wedges(some, free)),
        }
    bodies_of: Mapping[str, tuple[Study, Callable[[list[Packing]], Figure]]] = {
        "cylinders.png": ("cylinder", snapshots.in_cylinders),
        "wedges.png": ("wedge", snapshots.in_wedges),
        "wedge_directions.png": ("wedge", snapshots.wedge_directions),
        "superball_packings.png": ("superballs", snapshots.of_superballs),
    }
    shown = compared_bodies(made)
    return {
        **({"structure.png": structure(shown)} if shown else {}),
        **({"order.png": order(shown, wall_profiles(made.get("cylinder", [])))} if shown else {}),
        **{name: draw(rows[study]) for name, (study, draw) in curves_of.items() if study in rows},
        **{name: draw(made[study]) for name, (study, draw) in bodies_of.items() if study in made},
    }


def compared_bodies(made: Mapping[Study, list[Packing]]) -> dict[str, PackedBodies]:
    """Return spheres, rods and superballs whose neighbours and pores are compared, by title; none unless
    there are all."""
    wanted: tuple[tuple[Study, float, str], ...] = (
        ("aspect ratio", 1.0, "spheres"),
        ("aspect ratio", 3.0, "rods, L/D = 2"),
        ("superballs", 4.0, "superballs, exponent 4"),
    )
    found = {
        title: next((bodies for row, bodies in made.get(study, []) if row.shape == shape), None)
        for study, shape, title in wanted
    }
    some = {title: bodies for title, bodies in found.items() if bodies is not None}
    return some if len(some) == len(wanted) else {}


def wall_profiles(made: list[Packing]) -> dict[str, FractionProfile]:
    """Return the packing fraction by distance (D) from the wall of the widest cylinder of each aspect ratio,
    by title, as the mean of its starts."""
    found: dict[str, FractionProfile] = {}
    for shape in sorted({row.shape for row, _ in made}):
        widest = max(row.width for row, _ in made if row.shape == shape)
        each = [profile(row, one) for row, one in made if row.shape == shape and row.width == widest]
        title = "spheres" if shape == 1 else f"rods, L/D = {shape - 1:g}"
        mean = np.mean([one.fraction for one in each], axis=0)
        found[f"{title} in a cylinder of {widest:g} D"] = each[0]._replace(fraction=mean)
    return found


def profile(row: PackedRow, bodies: PackedBodies) -> FractionProfile:
    """Return the packing fraction of a packing in a cylinder by distance (D) from the wall."""
    container, unit = container_of(row), float(bodies.diameters()[0])
    assert container is not None
    assert row.study == "cylinder"
    side, low = bodies.high - bodies.low, bodies.low
    # The box of the start does not grow with the container.
    size = container.box_of(container.volume_in(side, unit), unit)
    around = replace(bodies, low=low + (side - size) / 2, high=low + (side + size) / 2)

    def distance(places: np.ndarray) -> np.ndarray:
        return container.distances(places - low, side, unit)[0].min(axis=1)

    layers = fraction_profile(around, distance, np.linspace(0, PROFILE_DEPTH * unit, PROFILE_BINS + 1))
    return layers._replace(edges=layers.edges / unit)
