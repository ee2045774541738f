"""Pictures of packings, their bodies coloured by contacts, and the directions of rods in wedges."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from tisim.analysis.packings.gaps import near_gaps, relative_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.wall_alignment import direction_histogram
from tisim.cases.packing.measures import MeasuredPacking
from tisim.cases.packing.studies import PackedPlan, PackedRow, measured_packings, shortest
from tisim.engine.batches import Progress
from tisim.plotting.bodies import draw_bodies
from tisim.plotting.packings import directions
from tisim.plotting.style import empty

MOST_CONTACTS = 12
"""Number of contacts from which colours do not change."""
TOUCHING_GAP = 1e-3
"""Gap (D) up to which bodies count as touching in a picture, more than the tolerance of a packing."""
SEGMENT = 8.0
"""Length (D) of the drawn part of a cylinder."""
DIRECTION_BINS = (8, 20)
"""Bins of the cosine of the polar angle and of the azimuth, of 4.5 degrees each."""
ACUTE = 9.0
"""Angle of the wedge of B16 Fig. 2.15, degrees."""
CYLINDERS = [
    PackedPlan("cylinder", aspect, width=width, number=60)
    for aspect in (1.0, 2.5)
    for width in (1.1, 1.7, 2.3, 3.1, 4.5)
]
"""Packings of B16 Fig. 2.11."""
WEDGES = [
    PackedPlan("wedge", aspect, width=factor * shortest(aspect, angle), angle=angle)
    for angle in (9.0, 45.0)
    for aspect, factor in ((1.25, 2.0), (3.0, 2.0))
]
"""Packings of B16 Fig. 2.16."""
SUPERBALLS = [PackedPlan("superballs", exponent, "revised") for exponent in (2.0, 2.5, 3.0, 4.0, 5.0)]
"""Packings of B16 Fig. 4.6."""
DIRECTIONS = [
    PackedPlan("wedge", 3.0, width=factor * shortest(3.0, ACUTE), angle=ACUTE, number=400)
    for factor in (1.2, 2.0, 3.0)
]
"""Packings of B16 Fig. 2.15."""


def contact_counts(packing: PackedBodies) -> np.ndarray:
    """Return the number of bodies that each body touches, shape (n,)."""
    gaps = near_gaps(packing, float(TOUCHING_GAP * packing.diameters().max()))
    pairs = gaps.pairs[relative_gaps(packing, gaps) <= TOUCHING_GAP]
    return np.bincount(pairs.ravel(), minlength=len(packing))


def draw_by_contacts(axis: Axes, packing: PackedBodies, kept: np.ndarray | None = None) -> None:
    """Draw a packing, or some of its bodies, each coloured by its number of contacts."""
    colours = colormaps["viridis"](np.clip(contact_counts(packing) / MOST_CONTACTS, 0, 1))[:, :3]
    some = np.ones(len(packing), bool) if kept is None else kept
    draw_bodies(axis, packing.where(some), colours[some])


def contact_scale(figure: Figure, axes: Sequence[Axes]) -> None:
    """Add the scale of colours by contacts."""
    mappable = ScalarMappable(Normalize(0, MOST_CONTACTS), colormaps["viridis"])
    figure.colorbar(mappable, ax=list(axes), shrink=0.6, label="contacts")


def snapshots(
    plans: Sequence[PackedPlan], size: str, columns: int, height: float, progress: Progress | None = None
) -> Figure:
    """Draw a packing of each plan, with its packing fraction and contact number."""
    made = {one.key(): (one, packing) for one, packing in measured_packings(plans, size, 1, progress)}
    rows = -(-len(plans) // columns)
    figure = empty(2.5 * columns + 0.8, height * rows)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    order = sorted(made.values(), key=lambda one: [_place(plans, one[0])])
    for axis, (row, packing) in zip(axes, order, strict=True):
        bodies = packing.bodies
        unit = float(bodies.diameters()[0])
        kept = bodies.position[:, 2] - bodies.low[2] < SEGMENT * unit if row.study == "cylinder" else None
        draw_by_contacts(axis, bodies, kept)
        axis.set_title(f"{named(row)}\n$\\phi$ = {row.fraction:.3f}, $C$ = {row.contacts:.2f}", fontsize=9)
    contact_scale(figure, list(axes))
    return figure


def _place(plans: Sequence[PackedPlan], row: PackedRow) -> int:
    same = [(one.shape, one.width, one.angle) for one in plans]
    found = (row.shape, row.width, row.angle)
    return next(k for k, one in enumerate(same) if np.array_equal(one, found, equal_nan=True))


def named(row: PackedRow) -> str:
    """Return the title of a packing."""
    if row.study == "cylinder":
        return rf"$\Lambda$ = {row.shape:g}, $D_{{cyl}}$ = {row.width:g} D"
    if row.study == "wedge":
        return rf"$\Lambda$ = {row.shape:g}, {row.angle:g}°"
    return rf"$\gamma$ = {row.shape:g}" if row.study == "superballs" else rf"$\Lambda$ = {row.shape:g}"


def wedge_directions(size: str, starts: int, progress: Progress | None = None) -> Figure:
    """Draw the directions of rods of Lambda = 3 in an acute wedge of three lengths (B16 Fig. 2.15)."""
    axes: dict[float, list[np.ndarray]] = {}
    for row, one in measured_packings(DIRECTIONS, size, starts, progress):
        axes.setdefault(row.width, []).append(long_axes(one))
    return directions(
        {
            f"{width / shortest(3.0, ACUTE):.2g} times the shortest": direction_histogram(
                np.concatenate(axes[width]), DIRECTION_BINS
            )
            for width in sorted(axes)
        }
    )


def long_axes(one: MeasuredPacking) -> np.ndarray:
    """Return the axes of rods, shape (n, 3)."""
    return one.bodies.axes()[:, 2]


SNAPSHOTS: Mapping[str, tuple[Sequence[PackedPlan], int, float]] = {
    "cylinders.png": (CYLINDERS, 5, 3.4),
    "wedges.png": (WEDGES, 2, 2.8),
    "superball_packings.png": (SUPERBALLS, 5, 2.9),
}
"""Plans, columns and height of a row (inches) of the pictures of packings."""
