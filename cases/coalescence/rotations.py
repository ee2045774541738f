"""Shapes of asteroids by rotation and magnetisation, beside L21's (Figs 4.3 and 4.4, table 4.2).

    python -m tisim.cases.coalescence.rotations [--starts 4] [--out coalescence_rotations.png]

L21 runs clouds of 50 cm with three rotations. As printed, they fly apart (``regime.py``); read as
microdegrees per second, they end at 0.22, 0.43 and 0.86 of the critical spin of their asteroids. The clouds
here, of grains of 100 cm on the same lattice, rotate such that they end at the same fractions.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.analysis import Mean
from tisim.cases.coalescence import published
from tisim.cases.coalescence.figures import close_up, moved
from tisim.cases.coalescence.regime import spin_when_packed
from tisim.cases.coalescence.runs import CloudRun, clouds, of_magnetisation
from tisim.cases.coalescence.scene import DEFAULT
from tisim.cases.common.rubble_pile import critical_spin
from tisim.engine.batches import Progress, progress_of_part
from tisim.errors import must
from tisim.plotting.scenery import window
from tisim.plotting.style import AXIS_COLOURS, empty, legend_above, letters, plain

ROTATED_STARTS = 4
"""Number of random starts of each rotation and magnetisation."""
ROTATED_DIAMETER, CLOUD_DIAMETER = published.DIAMETERS
"""Diameter of L21's grains in clouds of three rotations, m, and of the grains here."""


@dataclass(frozen=True)
class Rotated:
    """The clouds of a rotation. printed : as L21 prints it, rad/s. runs : of each magnetisation."""

    printed: float
    runs: Sequence[CloudRun]

    def elongations(self, magnetisation: float) -> np.ndarray:
        """Return the longest over the shortest axis of the asteroid of each start; shape (starts,)."""
        return np.array([one.asteroid.elongation for one in of_magnetisation(self.runs, magnetisation)])

    def final_spin(self, magnetisation: float) -> np.ndarray:
        """Return the spin of the asteroid of each start over the critical spin of its density; shape
        (starts,)."""
        asteroids = [one.asteroid for one in of_magnetisation(self.runs, magnetisation)]
        return np.array([float(np.linalg.norm(one.spin)) / critical_spin(one.density) for one in asteroids])

    def coalesced(self, magnetisation: float) -> np.ndarray:
        """Return the fraction of all grains in the asteroid of each start; shape (starts,)."""
        group = of_magnetisation(self.runs, magnetisation)
        return np.array([one.agglomerations[-1].coalesced for one in group])


def published_ratio(printed: float, magnetisation: float, diameter: float = ROTATED_DIAMETER) -> float:
    """Return L21's longest over shortest axis (table 4.2); NaN if it has none.

    printed : rotation, rad/s. magnetisation : A/m. diameter : of the grains, m.
    """
    axes = published.AXES.get((diameter, printed, magnetisation))
    return axes[0] / axes[2] if axes else float("nan")


def rotation_here(printed: float) -> float:
    """Return the rotation (rad/s) of a cloud of 100 cm that ends at the same fraction of the critical spin as
    L21's cloud of 50 cm.

    printed : the rotation of the latter, rad/s; its number is read as microdegrees per second.
    """
    fine, coarse = (spin_when_packed(1.0, d, published.SPACING) for d in (ROTATED_DIAMETER, CLOUD_DIAMETER))
    return float(np.radians(printed) * fine / coarse)


def by_rotation(
    starts: int = ROTATED_STARTS,
    progress: Progress = lambda part: None,
    rotations: Sequence[float] = published.ROTATIONS,
) -> list[Rotated]:
    """Run clouds of each of L21's rotations (as printed, rad/s) and magnetisations, from the same starts."""
    return [
        Rotated(one, clouds(starts, progress_of_part(progress, k, len(rotations)), samples=1,
                            rotation=rotation_here(one), **DEFAULT))
        for k, one in enumerate(rotations)
    ]  # fmt: skip


def report(found: Sequence[Rotated]) -> str:
    """Return the numbers as text; differences are between the last and the first rotation, and between
    magnetisations, start by start."""
    lines = ["longest over shortest axis of the bounding ellipsoid, mean over starts (L21, 50 cm):"]
    for one in found:
        turns = f"{1e6 * rotation_here(one.printed):.3g} µrad/s (L21: {1e6 * one.printed:g})"
        for m in published.MAGNETISATIONS:
            theirs = published_ratio(one.printed, m)
            lines.append(
                f"  {turns}, {m:g} A/m: {Mean.of(one.elongations(m))}"
                f" ({f'{theirs:.2f}' if np.isfinite(theirs) else 'not run'});"
                f" spin {Mean.of(one.final_spin(m))} of the critical,"
                f" {Mean.of(one.coalesced(m))} of the grains in the asteroid"
            )
    lines.append("differences of this ratio:")
    first, last = found[0], found[-1]
    for m in published.MAGNETISATIONS:
        change = Mean.of(last.elongations(m) - first.elongations(m))
        theirs = published_ratio(last.printed, m) - published_ratio(first.printed, m)
        beside = f" (L21: {theirs:.2f})" if np.isfinite(theirs) else ""
        lines.append(f"  {m:g} A/m, last minus first rotation: {change}{beside}")
    plain_clouds = published.MAGNETISATIONS[0]
    for one in found:
        for m in published.MAGNETISATIONS[1:]:
            change = Mean.of(one.elongations(m) - one.elongations(plain_clouds))
            theirs = published_ratio(one.printed, m) - published_ratio(one.printed, plain_clouds)
            beside = f" (L21: {theirs:.2f})" if np.isfinite(theirs) else ""
            lines.append(f"  L21's {1e6 * one.printed:g} µrad/s, {m:g} minus 0 A/m: {change}{beside}")
    return "\n".join(lines)


def picture(found: Sequence[Rotated]) -> Figure:
    """Draw the asteroids of the first start by rotation and magnetisation, and their axis ratios."""
    figure = empty(12.0, 7.4)
    ((drawn, beside),) = figure.subfigures(1, 2, squeeze=False, width_ratios=(1.5, 1))
    axes = drawn.subplots(len(published.MAGNETISATIONS), len(found), squeeze=False)
    shown = [[of_magnetisation(one.runs, m)[0] for one in found] for m in published.MAGNETISATIONS]
    piles = [[run.asteroid.grains for run in row] for row in shown]
    part = window([moved(pile, pile) for row in piles for pile in row])
    for row, runs, grains, m in zip(axes, shown, piles, published.MAGNETISATIONS, strict=True):
        for axis, run, pile, one in zip(row, runs, grains, found, strict=True):
            close_up(axis, run.end, pile, part)
            axis.set_title(f"{m:g} A/m, {1e6 * rotation_here(one.printed):.0f} µrad/s", fontsize=9)
    ratios = beside.subplots()
    _ratios(ratios, found)
    letters((*axes.flat, ratios))
    return figure


def _ratios(axis: Axes, found: Sequence[Rotated]) -> None:
    at = 1e6 * np.array([rotation_here(one.printed) for one in found])
    for k, (m, colour) in enumerate(zip(published.MAGNETISATIONS, AXIS_COLOURS, strict=True)):
        means = [Mean.of(one.elongations(m)) for one in found]
        place = at * 1.03 ** (k - 1)
        axis.errorbar(place, [one.value for one in means], [one.half for one in means],
                      fmt="o-", ms=4, capsize=3, color=colour, label=f"{m:g} A/m")  # fmt: skip
        for x, one in zip(place, found, strict=True):
            each = one.elongations(m)
            # Beside the interval, which would hide them.
            axis.plot(np.full(len(each), 1.012 * x), each, "_", ms=6, mew=1.2, color=colour)
        theirs = [published_ratio(one.printed, m) for one in found]
        axis.plot(place, theirs, "D", ms=6, mfc="none", color=colour, label=f"L21, {m:g} A/m, 50 cm")
    axis.set(xlabel="rotation of the cloud (µrad/s)", ylabel="longest axis over shortest", xscale="log")
    axis.set_xticks(at, [f"{one:.0f}" for one in at])
    axis.minorticks_off()
    legend_above(axis, columns=2)
    plain(axis)


def main() -> None:
    """Run the clouds, print the numbers and draw the picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--starts", type=int, default=ROTATED_STARTS, help="number of starts of each setting")
    parser.add_argument("--out", type=Path, help="file of the picture")
    options = parser.parse_args()
    must(options.starts >= 2, "starts", "at least 2, for an interval", options.starts)
    found = by_rotation(options.starts)
    print(report(found))
    if options.out is not None:
        picture(found).savefig(options.out, dpi=150)


if __name__ == "__main__":
    main()
