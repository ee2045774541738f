"""All figures of the case granular_bench; the figure and the table of its shear cell."""

from collections.abc import Mapping, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.cm import ScalarMappable
from matplotlib.figure import Figure

from tisim.cases.case import size_named
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.granular_bench.beds import bed_figure, beds, table
from tisim.cases.granular_bench.contact_figure import contact_figure
from tisim.cases.granular_bench.scene import BED, DIAMETER, SIZES
from tisim.cases.granular_bench.shear_cell import CELL_SIDES, ShearedBed, expected_ratio, sheared_beds
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.plotting.cloud import panel
from tisim.plotting.scenery import box_scenery, window
from tisim.plotting.style import TIME, empty, letters, plain

FRACTIONS = (0.45, 0.49, 0.52, 0.54, 0.56, 0.57, 0.58)
"""Solid fractions between the walls of the drawn cells."""


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """contact_tests.png: the tests of single contacts; beds.png, beds.csv: heaps and silos; shear_cell.png,
    shear_cell.csv: mu(I)."""
    must(size != BED, "size", "one of a draw-down test", size)
    found = beds(progress, dict(size_named(size, SIZES).scene))
    sheared = sheared_beds(FRACTIONS)
    return {
        "contact_tests.png": contact_figure(),
        "beds.png": bed_figure(found),
        "beds.csv": table(found),
        "shear_cell.png": shear_figure(sheared),
        "shear_cell.csv": shear_table(sheared),
    }


def shear_figure(beds: Sequence[ShearedBed]) -> Figure:
    """Draw the results of sheared beds.

    The panels are the grains of the middle bed, velocity by height, mu by the inertial number with the
    published law, and the solid fraction, which decreases with the inertial number (da Cruz and others,
    2005).
    """
    figure = empty(9.6, 8.0)
    (grains, profile), (ratio, fraction) = figure.subplots(2, 2)
    sheared_grains(grains, beds[len(beds) // 2])
    inertial = np.array([bed.inertial_number for bed in beds])
    colours = TIME(np.linspace(0.0, 1.0, len(beds)))
    for bed, number, colour in zip(beds, inertial, colours, strict=True):
        inside = bed.filled
        profile.plot(
            bed.velocity[inside] / bed.wall_speed, bed.height[inside] / bed.gap, "o-", ms=4, lw=1.0,
            color=colour, label=f"I = {number:.2g}",
        )  # fmt: skip
    profile.plot([0.0, 1.0], [0.0, 1.0], color="0.6", lw=0.9, ls="--", label="no slip")
    profile.set(xlabel="velocity over wall velocity", ylabel="height over the gap", title="velocity")
    line = np.geomspace(inertial.min() / 2, inertial.max() * 1.5, 200)
    ratio.plot(line, expected_ratio(line), color="0.2", lw=1.0, label="Jop, Forterre, Pouliquen (2006)")
    ratio.scatter(inertial, [bed.ratio for bed in beds], c=colours, s=36, zorder=3, label="as run")
    ratio.set(xscale="log", xlabel="inertial number I", ylabel="stress ratio μ", title="μ(I)")
    filled = np.array([bed.fraction for bed in beds])
    slope, densest = np.polyfit(inertial, filled, 1)
    label = f"{densest:.3f} \N{MINUS SIGN} {-slope:.2f} I"
    fraction.plot(inertial, densest + slope * inertial, color="0.2", lw=1.0, label=label)
    fraction.scatter(inertial, filled, c=colours, s=36, zorder=3)
    fraction.set(xlabel="inertial number I", ylabel="solid fraction", title="solid fraction")
    for axis in (profile, ratio, fraction):
        axis.legend(frameon=False, fontsize=8)
    for axis in (profile, ratio, fraction):
        plain(axis)
    letters((grains, profile, ratio, fraction))
    return figure


def sheared_grains(axis: Axes, bed: ShearedBed) -> None:
    """Draw the grains of a cell and of its walls, coloured by their velocity along the walls."""
    part = bed.state["velocity"][:, 0] / bed.wall_speed
    box = box_scenery(np.array([0.0, 0.0, -DIAMETER]), np.array([*CELL_SIDES, bed.gap + DIAMETER]))
    panel(axis, bed.state, window([bed.state], [box]), box, TIME(part)[:, :3])
    axis.set_title(f"grains between rough walls, I = {bed.inertial_number:.2g}")
    bar = axis.figure.colorbar(ScalarMappable(cmap=TIME), ax=axis, shrink=0.72, pad=0.01)
    bar.set_label("velocity over wall velocity")
    bar.outline.set_visible(False)


def shear_table(beds: Sequence[ShearedBed]) -> str:
    """Return the results of all beds as CSV.

    Columns are the inertial number, the stress ratio as run and as published, the solid fraction, the
    pressure and the shear rate.
    """
    rows: list[list[object]] = [
        ["inertial_number", "stress_ratio", "published", "solid_fraction", "pressure_Pa", "shear_rate_per_s"]
    ]
    for bed in beds:
        number = bed.inertial_number
        expected = float(expected_ratio(number))
        rows.append([number, bed.ratio, expected, bed.fraction, bed.pressure, bed.shear_rate])
    return csv_text(rows)
