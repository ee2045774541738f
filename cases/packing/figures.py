"""Figures of the case packing: a packing coloured by contacts, and densities, contacts and order by shape and
container."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib import colormaps
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.analysis.packings.gaps import near_gaps, relative_gaps
from tisim.analysis.packings.orientational_order import random_nematic_order
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.cases.packing.studies import PackedRow, means, packed, plans, table
from tisim.engine.batches import Progress, progress_of_part
from tisim.io.reader import Frames
from tisim.plotting.bodies import draw_bodies
from tisim.plotting.style import empty, letters, plain

LARGEST_COUNT = 12
"""Number of contacts from which colours do not change."""
TOUCHING_GAP = 1e-3
"""Gap (D) up to which bodies count as touching in a picture, more than the tolerance of a packing."""
FIGURE_STARTS = {"small": 2, "default": 3, "paper": 5}
"""Random starts of each packing, by size."""
MEASURED = (
    ("fraction", "packing fraction"),
    ("contacts", "mean contact number"),
    ("nematic", "nematic order S"),
)
COLOURS = ("#4477aa", "#cc6677", "#228833", "#ccbb44", "#aa3377")
TICKS = (1, 1.5, 2, 3, 5, 10)
"""Marked aspect ratios."""
SPHERES = 0.64
"""Packing fraction of random close packing of spheres."""


def pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """packing.png: the bodies at the end, coloured by their contacts, and the packing fraction over the
    attempts."""
    every = list(trajectory)
    last = PackedBodies.from_state(every[-1].arrays, trajectory.scene)
    figure = empty(10.4, 5.0)
    left, right = figure.subplots(1, 2, width_ratios=(1.3, 1))
    draw_by_contacts(left, last)
    fractions = [packing_fraction(PackedBodies.from_state(one.arrays, trajectory.scene)) for one in every]
    right.plot(trajectory.times, fractions, color=COLOURS[0])
    right.set(xlabel="attempts", ylabel="packing fraction", ylim=(0, None))
    plain(right)
    letters((left, right))
    return {"packing.png": figure}


def draw_by_contacts(axis: Axes, packing: PackedBodies) -> None:
    """Draw a packing, each body coloured by its number of contacts."""
    gaps = near_gaps(packing, float(TOUCHING_GAP * packing.diameters().max()))
    pairs = gaps.pairs[relative_gaps(packing, gaps) <= TOUCHING_GAP]
    count = np.bincount(pairs.ravel(), minlength=len(packing))
    colours = colormaps["viridis"](np.clip(count / LARGEST_COUNT, 0, 1))[:, :3]
    draw_bodies(axis, packing, colours)
    axis.set_title(f"coloured by contacts: {count.min()} dark to {count.max()} light", fontsize=9)


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """rods.png, superballs.png, cylinder.png, inertia.png, and packings.csv with all packings of a size."""
    made: dict[str, Figure | str] = {}
    drawn = {
        "aspect ratio": ("rods.png", of_rods),
        "superballs": ("superballs.png", of_superballs),
        "cylinder": ("cylinder.png", of_cylinders),
        "moment of inertia": ("inertia.png", of_inertia),
    }
    rows: list[PackedRow] = []
    for k, (study, (name, draw)) in enumerate(drawn.items()):
        part = progress_of_part(progress, k, len(drawn))
        found = packed(plans(study), size, FIGURE_STARTS[size], part)  # type: ignore[arg-type]
        made[name] = draw(found)
        rows += found
    return {**made, "packings.csv": table(rows)}


def curves(axis: Axes, rows: Sequence[PackedRow], x: str, name: str, by: str, label: str = "{}") -> None:
    """Draw means of a measure with their 95 % intervals over a column, one curve for each value of
    another."""
    for colour, value in zip(COLOURS, dict.fromkeys(getattr(one, by) for one in rows), strict=False):
        some = means([one for one in rows if getattr(one, by) == value], (x,), name)
        at = np.array([key[0] for key in some])
        mean, half = np.array([[one.value, one.half] for one in some.values()]).T
        half = np.where(np.isfinite(half), half, 0.0)
        axis.errorbar(
            at, mean, half, fmt="o-", ms=3, lw=1, color=colour, capsize=2, label=label.format(value)
        )
    plain(axis)


def panels(rows: Sequence[PackedRow], x: str, xlabel: str, by: str, label: str) -> Figure:
    """Draw packing fraction, contact number and order over a column."""
    figure = empty(12.6, 3.9)
    axes = figure.subplots(1, len(MEASURED))
    for axis, (name, title) in zip(axes, MEASURED, strict=True):
        curves(axis, rows, x, name, by, label)
        axis.set(xlabel=xlabel, ylabel=title, ylim=(0, None))
    axes[0].legend(frameon=False, fontsize=8)
    letters(axes)
    return figure


def of_rods(rows: Sequence[PackedRow]) -> Figure:
    """Draw rods in a periodic box by aspect ratio (B16 Figs 2.8 and 3.3), with lines at the density of random
    close packing, and at the order of as many random directions."""
    figure = panels(rows, "shape", r"aspect ratio $\Lambda = L/D + 1$", "method", "{}")
    figure.axes[0].axhline(SPHERES, color="0.6", lw=0.8)
    figure.axes[2].axhline(random_nematic_order(rows[0].number), color="0.6", lw=0.8)
    for axis in figure.axes:
        axis.set_xscale("log")
        axis.set_xticks(TICKS, [f"{tick:g}" for tick in TICKS])
        axis.set_xticks([], minor=True)
    return figure


def of_superballs(rows: Sequence[PackedRow]) -> Figure:
    """Draw superballs by exponent (B16 Fig. 4.5)."""
    figure = panels(rows, "shape", r"exponent $\gamma$", "method", "{}")
    figure.axes[0].axhline(SPHERES, color="0.6", lw=0.8)
    return figure


def of_cylinders(rows: Sequence[PackedRow]) -> Figure:
    """Draw rods in cylinders by diameter (B16 Fig. 2.10)."""
    return panels(rows, "width", r"$D_{cyl}/D$", "shape", r"$\Lambda$ = {:g}")


def of_inertia(rows: Sequence[PackedRow]) -> Figure:
    """Draw rods by xi over the moment of inertia (B16 Fig. 2.7)."""
    figure = panels(rows, "inertia", r"$\xi/I_x$", "shape", r"$\Lambda$ = {:g}")
    for axis in figure.axes:
        axis.set_xscale("log")
    return figure
