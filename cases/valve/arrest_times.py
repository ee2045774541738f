"""How long does it take to arrest the flow, by pressure and by constriction?

    python -m tisim.cases.valve.arrest_times [--starts 12] [--out valve_arrest.png]

L21 measured the time from the beginning of the field until the flow ceased: it rises with the pressure and
with the width of the constriction, and finally the valve fails to jam (figure 3.8). Valves that are still
flowing at the end of the field are censored: their time to arrest is longer than the field lasts.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from scipy.stats import page_trend_test, quantile_test

from tisim.analysis import Mean
from tisim.cases.valve.opens import MICRO, NOMINAL, OPENED_STARTS, SHUT, Count, Opening, arrests
from tisim.cases.valve.scene import D
from tisim.engine.batches import Progress
from tisim.errors import must
from tisim.plotting.style import AXIS_COLOURS, empty, legend_above, letters, plain

PRESSURES = tuple(factor * NOMINAL for factor in (0.25, 0.5, 1.0, 2.0, 4.0))
"""Drag on grains at rest over the cross-section, Pa."""
WIDTHS = (4.0, 5.0)
"""Diameters of the compared constrictions, in grains."""
KILO = 1e3
"""A kilopascal, Pa."""


@dataclass(frozen=True)
class Pressed:
    """The starts of a valve at a pressure.

    width : of the constriction, in grains. pressure : drag on grains at rest over the cross-section, Pa.
    """

    width: float
    pressure: float
    starts: Sequence[Opening]

    @property
    def times(self) -> np.ndarray:
        """Return the time to arrest of each start, s; infinite if it is not arrested. Shape (starts,)."""
        return np.array([one.arrest_time if one.arrested else np.inf for one in self.starts])

    @property
    def arrested(self) -> Count:
        """Return the number of arrested starts."""
        return Count.of([one.arrested for one in self.starts])

    @property
    def left(self) -> Mean:
        """Return the flow that is left at the end of the field over the flow before it."""
        return Mean.of([one.during / one.before for one in self.starts])

    @property
    def median(self) -> tuple[float, float, float]:
        """Return the median time to arrest and its 95 % interval from order statistics, s.

        A bound that falls on a start that is not arrested is infinite. With less than six starts no interval
        of this confidence exists; its bounds are then NaN.
        """
        times = np.sort(self.times)
        middle = float(np.mean(times[[(len(times) - 1) // 2, len(times) // 2]]))
        # The tested quantile does not affect the interval.
        interval = quantile_test(times, q=0.0).confidence_interval(0.95)
        return middle, float(interval.low), float(interval.high)


def by_pressure(
    starts: int = OPENED_STARTS,
    progress: Progress = lambda part: None,
    widths: Sequence[float] = WIDTHS,
    pressures: Sequence[float] = PRESSURES,
) -> list[Pressed]:
    """Run valves with several constrictions (in grains) at several pressures (Pa), from the same starts."""
    wanted = [(width, pressure) for width in widths for pressure in pressures]
    groups = arrests([{"throat": w * D, "pressure": p} for w, p in wanted], starts, progress)
    return [Pressed(*one, group) for one, group in zip(wanted, groups, strict=True)]


def of_width(found: Sequence[Pressed], width: float) -> list[Pressed]:
    """Return the valves with a constriction (in grains), in the order of their pressures."""
    return sorted((one for one in found if one.width == width), key=lambda one: one.pressure)


def trend(group: Sequence[Pressed]) -> float:
    """Return the probability (p value) of times to arrest in this order of pressures by chance.

    Page's test for ordered alternatives compares the pressures of each start; starts that are not arrested
    have the highest rank. group : valves at three or more pressures, in their order.
    """
    times = np.array([one.times for one in group]).T
    return float(page_trend_test(times, method="asymptotic").pvalue)


def median_text(one: Pressed) -> str:
    """Return the median time to arrest with its interval, in µs; times that are not reached are longer than
    SHUT."""
    middle, low, high = (
        f"{time / MICRO:.0f}" if np.isfinite(time) else f"> {SHUT / MICRO:.0f}" for time in one.median
    )
    return f"{middle} µs" if low == middle == high else f"{middle} µs ({low} to {high})"


def report(found: Sequence[Pressed]) -> str:
    """Return the numbers as text."""
    lines = [
        f"time to arrest, of starts that are arrested {SHUT / MICRO:.0f} µs after the field is switched on:"
    ]
    for width in sorted({one.width for one in found}):
        group = of_width(found, width)
        for one in group:
            lines.append(
                f"  {width:g} grains, {one.pressure / KILO:.3g} kPa: arrested {one.arrested}, "
                f"median {median_text(one)}, {one.left} of the flow left"
            )
        lines.append(f"  {width:g} grains: longer at higher pressure, p = {trend(group):.1g}")
    return "\n".join(lines)


def picture(found: Sequence[Pressed]) -> Figure:
    """Draw the fraction of arrested starts, and the times to arrest, by pressure."""
    figure = empty(12.0, 4.2)
    fractions, times = figure.subplots(1, 2)
    never = 1.15 * SHUT / MICRO
    widths = sorted({one.width for one in found})
    for k, (width, colour) in enumerate(zip(widths, AXIS_COLOURS, strict=False)):
        group = of_width(found, width)
        shift = 1.04 ** (2 * k - len(widths) + 1)
        at = shift * np.array([one.pressure for one in group]) / KILO
        label = f"{width:g} grains across"
        part = np.array([one.arrested.found / one.arrested.starts for one in group])
        ends = np.array([one.arrested.interval for one in group]).T
        fractions.errorbar(
            at, part, np.abs(ends - part), fmt="o-", ms=4, capsize=3, color=colour, label=label
        )
        _times(times, group, at, colour, never)
    times.axhspan(1.05 * SHUT / MICRO, 1.3 * SHUT / MICRO, color="0.93", lw=0)
    times.set(ylabel="time to arrest (µs)", ylim=(0, 1.3 * SHUT / MICRO))
    times.set_yticks([*range(0, 500, 100), never], [*map(str, range(0, 500, 100)), "not\narrested"])
    fractions.set(ylabel="part of the starts that is arrested", ylim=(-0.05, 1.05))
    legend_above(fractions)
    ticks = sorted({round(one.pressure / KILO) for one in found})
    for axis in (fractions, times):
        axis.set(xlabel="pressure (kPa)", xscale="log")
        axis.set_xticks(ticks, [str(one) for one in ticks])
        axis.minorticks_off()
        plain(axis)
    letters((fractions, times))
    return figure


def _times(axis: Axes, group: Sequence[Pressed], at: np.ndarray, colour: str, never: float) -> None:
    """Draw the times of each start as dots, and the median with its interval; ``never`` (µs) is the height of
    starts that are not arrested."""
    for place, one in zip(at, group, strict=True):
        each = one.times / MICRO
        spread = 1.0 + 0.03 * np.linspace(-1, 1, len(each))
        axis.plot(
            place * spread, np.where(np.isfinite(each), each, never), "o", ms=3, alpha=0.5, color=colour
        )
    middle, low, high = np.minimum(np.array([one.median for one in group]).T / MICRO, never)
    axis.errorbar(at, middle, (middle - low, high - middle), fmt="_-", ms=14, capsize=4, color=colour)


def main() -> None:
    """Run the valves, print the numbers and draw the picture."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--starts", type=int, default=OPENED_STARTS, help="number of starts of each setting")
    parser.add_argument("--out", type=Path, help="file of the picture")
    options = parser.parse_args()
    must(options.starts >= 6, "starts", "at least 6, for the interval of a median", options.starts)
    found = by_pressure(options.starts)
    print(report(found))
    if options.out is not None:
        picture(found).savefig(options.out, dpi=150)


if __name__ == "__main__":
    main()
