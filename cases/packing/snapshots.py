"""Pictures of packings, their bodies coloured by contacts, and the directions of rods in wedges."""

from collections.abc import Callable, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.colors import Normalize
from matplotlib.figure import Figure

from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.wall_alignment import DirectionHistogram, direction_histogram
from tisim.cases.packing.measures import contact_counts
from tisim.cases.packing.studies import container_of, shortest
from tisim.cases.packing.study_table import PackedRow
from tisim.geometry.container import Container
from tisim.geometry.tessellation import sharp_edges
from tisim.plotting.bodies import draw_bodies
from tisim.plotting.packings import directions
from tisim.plotting.scenery import NO_SCENERY, wall_scenery
from tisim.plotting.style import empty

MOST_CONTACTS = 12
"""Number of contacts from which colours do not change."""
SEGMENT = 8.0
"""Length (D) of the drawn part of a cylinder, and the shortest one of a wedge."""
DIRECTION_BINS = (8, 20)
"""Bins of the cosine of the polar angle, and of the azimuth, of 4.5 degrees each."""
ACUTE, LONG = 9.0, 3.0
"""Angle of the wedge (degrees) and aspect ratio of B16 Fig. 2.15."""
Packing = tuple[PackedRow, PackedBodies]
"""A line of a study, and its bodies."""


def contact_colours(contacts: np.ndarray) -> np.ndarray:
    """Return the colours (red, green, blue) of numbers of contacts, shape (n, 3)."""
    return np.asarray(colormaps["viridis"](np.clip(contacts / MOST_CONTACTS, 0, 1))[:, :3])


def draw_by_contacts(
    axis: Axes,
    packing: PackedBodies,
    kept: np.ndarray | None = None,
    container: Container | None = None,
    length: float = np.inf,
) -> None:
    """Draw a packing, or some of its bodies, each coloured by its number of contacts, in its container.

    length : of the drawn part of the container along z, m.
    """
    colours = contact_colours(contact_counts(packing))
    some, around = np.ones(len(packing), bool) if kept is None else kept, NO_SCENERY
    if container is not None:
        side = np.minimum(packing.high - packing.low, [np.inf, np.inf, length])
        triangles = packing.low + container.triangles(side, float(packing.diameters()[0]))
        around = wall_scenery(triangles, sharp_edges(triangles))
    draw_bodies(axis, packing.where(some), colours[some], around=around)


def contact_scale(figure: Figure, axes: Sequence[Axes]) -> None:
    """Add the scale of colours by contacts."""
    mappable = ScalarMappable(Normalize(0, MOST_CONTACTS), colormaps["viridis"])
    figure.colorbar(mappable, ax=list(axes), shrink=0.6, label="contacts")


def snapshots(
    packings: Sequence[Packing], title: Callable[[PackedRow], str], columns: int, width: float, height: float
) -> Figure:
    """Draw packings, with packing fraction and contact number. width, height : of a picture, inches."""
    rows = -(-len(packings) // columns)
    figure = empty(width * columns + 0.8, height * rows)
    axes = figure.subplots(rows, columns, squeeze=False).ravel()
    for axis in axes[len(packings) :]:
        axis.set_axis_off()
    for axis, (row, bodies) in zip(axes, packings, strict=False):
        unit = float(bodies.diameters()[0])
        length = unit * {"cylinder": SEGMENT, "wedge": max(SEGMENT, row.width)}.get(row.study, np.inf)
        kept = bodies.position[:, 2] - bodies.low[2] < length
        draw_by_contacts(axis, bodies, kept, container_of(row), length)
        axis.set_title(f"{title(row)}\n$\\phi$ = {row.fraction:.3f}, $C$ = {row.touching:.2f}", fontsize=9)
    contact_scale(figure, list(axes))
    return figure


def firsts(packings: Sequence[Packing]) -> list[Packing]:
    """Return the packings of the first seed."""
    return [(row, bodies) for row, bodies in packings if row.seed == 0]


def in_cylinders(packings: Sequence[Packing]) -> Figure:
    """Draw spheres and rods in cylinders (B16 Fig. 2.11)."""
    some = [(row, bodies) for row, bodies in firsts(packings) if row.shape <= LONG]
    columns = len({row.width for row, _ in some})
    return snapshots(some, lambda row: rf"$D_{{cyl}}$ = {row.width:g} D", columns, 1.6, 3.4)


def in_wedges(packings: Sequence[Packing]) -> Figure:
    """Draw rods in wedges (B16 Fig. 2.16)."""
    some = [(row, bodies) for row, bodies in firsts(packings) if row.shape <= LONG]
    columns = len({(row.angle, round(row.width / shortest(row.shape, row.angle), 6)) for row, _ in some})

    def title(row: PackedRow) -> str:
        length = row.width / shortest(row.shape, row.angle)
        return rf"$\Lambda$ = {row.shape:g}, {row.angle:g}°, {length:.2g} $l_{{w,min}}$"

    return snapshots(some, title, columns, 2.4, 2.8)


def of_superballs(packings: Sequence[Packing]) -> Figure:
    """Draw superballs (B16 Fig. 4.6)."""
    some = firsts(packings)
    return snapshots(some, lambda row: rf"$\gamma$ = {row.shape:g}", len(some), 2.4, 3.2)


def in_acute_wedges(packings: Sequence[Packing]) -> dict[str, DirectionHistogram]:
    """Return the distribution of the directions of rods in acute wedges of each length, of all seeds
    together."""
    axes: dict[float, list[np.ndarray]] = {}
    for row, bodies in packings:
        if row.shape == LONG and row.angle == ACUTE:
            axes.setdefault(row.width, []).append(bodies.axes()[:, 2])
    return {
        f"{width / shortest(LONG, ACUTE):.2g} $l_{{w,min}}$": direction_histogram(
            np.concatenate(axes[width]), DIRECTION_BINS
        )
        for width in sorted(axes)
    }


def wedge_directions(packings: Sequence[Packing]) -> Figure:
    """Draw the directions of rods in acute wedges (B16 Fig. 2.15)."""
    return directions(in_acute_wedges(packings))


def direction_shares(packings: Sequence[Packing]) -> list[str]:
    """Return a line for acute wedges of each length: the shares of the rods along the bottom or the slope, at
    azimuths up to 13.5 degrees, along the back, from 76.5 degrees on, and along the edge, at cosines above
    7/8; and these shares of random directions."""
    lines = []
    for name, found in in_acute_wedges(packings).items():
        share = found.density / found.density.size
        shares = {"bottom or slope": share[:, :3], "back": share[:, -3:], "edge": share[-1:, :]}
        each = [f"{where} {part.sum():.3f} ({part.size / share.size:.3f})" for where, part in shares.items()]
        lines.append(f"directions, {name}: {', '.join(each)}")
    return lines
