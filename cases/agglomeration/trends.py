"""Trends of agglomeration with four parameters, beside the four statements of Z04 section 5.1 (remark 5.1).

    python -m tisim.cases.agglomeration.trends [--grains 250] [--starts 48] [--surface-energy 1000]
        [--out agglomeration_trends.png]

Z04 concludes from the largest size that sticks in a head-on impact at the adhesion speed, b_0 = 4 gamma/(H
a_f beta) (5.5), that four changes lead to larger particles. Here whole flows are run: the best design of Z04
with a surface energy at which grains also break, and one parameter changed at a time, all from the same
starts.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import NullFormatter

from tisim import Result, run
from tisim.analysis import Mean
from tisim.cases.agglomeration.scene import BEST, scene
from tisim.cases.common.runs import sound
from tisim.numerics.statistics import CONFIDENCE
from tisim.plotting.style import AXIS_COLOURS, empty, letters, plain

SURFACE_ENERGY = 1e3
"""Surface energy of the flows (J/m^2): about half as many breakages as mergers."""


@dataclass(frozen=True)
class Trend:
    """A statement of Z04 remark 5.1 on the mean size of grains.

    statement : as published. symbol, unit : of the parameter. key : of the setting of a scene. values : that
    are run, in SI. exponent : of the parameter in (5.5), +1 or -1; the sign is the statement.
    """

    statement: str
    symbol: str
    unit: str
    key: str
    values: tuple[float, ...]
    exponent: int


AROUND_ONE = (0.25, 0.5, 1.0, 2.0, 4.0)
TRENDS = (
    Trend(
        "(i) larger surface energy", r"\gamma", "J/m²", "effects.fragmentation.surface_energy",
        (3e1, 1e2, 3e2, 1e3, 3e3, 1e4, 3e4, 1e5), 1,
    ),
    Trend(
        "(ii) smaller hardness", "H", "Pa", "effects.impact.hardness", (1e5, 1.8e5, 3.2e5, 5.6e5, 1e6), -1
    ),
    Trend(
        "(iii) smaller compression length", r"\beta", "", "effects.impact.deformation_length", AROUND_ONE, -1
    ),
    Trend("(iv) smaller contact area", "a_f", "", "effects.impact.final_area", AROUND_ONE, -1),
)  # fmt: skip
"""The statements of Z04 remark 5.1; hardness over its search range, the other two about 1, their value in
Z04."""


def growth(result: Result) -> float:
    """Return the final over the initial mean radius."""
    return float(result.state["radius"].mean() / result.start["radius"].mean())


@dataclass(frozen=True)
class FoundTrend:
    """Runs of one trend.

    sizes : final over initial mean radius, shape (values, starts). broken : breakages over mergers, (values,
    starts); 0 without mergers.
    """

    trend: Trend
    sizes: np.ndarray
    broken: np.ndarray

    @property
    def means(self) -> list[Mean]:
        """Return the mean size at each value."""
        return [Mean.of(one) for one in self.sizes]

    @property
    def exponent(self) -> Mean:
        """Return the exponent k of a power law, size ~ parameter^k: least squares over all values in each
        start, and the mean over starts."""
        x = np.log(self.trend.values)
        x = x - x.mean()
        return Mean.of(x @ np.log(self.sizes) / (x @ x))

    @property
    def seen(self) -> bool:
        """Return whether the confidence interval of the exponent has the sign of the statement."""
        one = self.exponent
        return one.value * self.trend.exponent - one.half > 0


def study(
    grains: int,
    seeds: Sequence[int],
    surface_energy: float = SURFACE_ENERGY,
    trends: Sequence[Trend] = TRENDS,
    design: Mapping[str, float] = BEST,
) -> list[FoundTrend]:
    """Run the flow of a design with each value of each parameter, from the same starts."""
    base = scene({**design, "surface_energy": surface_energy}, 0, grains)
    found = []
    for trend in trends:
        flows = [base.replace({trend.key: value}) for value in trend.values]
        results = sound(run([flow.model_copy(update={"seed": seed}) for flow in flows for seed in seeds]))
        shape = (len(flows), len(seeds))
        sizes = np.reshape([growth(one) for one in results], shape)
        broken = np.reshape([one.work["fractures"] / max(one.work["merges"], 1) for one in results], shape)
        found.append(FoundTrend(trend, sizes, broken))
    return found


def table(found: Sequence[FoundTrend]) -> str:
    """Return the table of docs/agglomeration.md."""
    lines = [
        f"| larger grains by | b_f/b_0 from | to | exponent, {CONFIDENCE:.0%} | in (5.5) | seen |",
        "|---|---|---|---|---|---|",
    ]
    for one in found:
        first, *_, last = one.means
        if one.trend.exponent < 0:
            first, last = last, first
        seen = "yes" if one.seen else "no"
        lines.append(
            f"| {one.trend.statement} | {first} | {last} | {one.exponent} "
            f"| {one.trend.exponent:+d} | {seen} |"
        )
    return "\n".join(lines)


def trends_figure(found: Sequence[FoundTrend]) -> Figure:
    """Draw the mean size, and breakages per merger, against each parameter with 95 % intervals."""
    figure = empty(11.6, 5.6)
    axes = figure.subplots(2, len(found), sharey="row", sharex="col", squeeze=False)
    for (top, below), one in zip(axes.T, found, strict=True):
        symbol, unit = one.trend.symbol, one.trend.unit
        points(top, one.trend.values, one.means, AXIS_COLOURS[0])
        top.axhline(1.0, color="0.6", lw=0.8)
        points(below, one.trend.values, [Mean.of(ones) for ones in one.broken], AXIS_COLOURS[1])
        verdict = "seen" if one.seen else "not seen"
        top.set_title(f"{one.trend.statement}: {verdict}")
        top.text(
            0.5, 0.97, rf"$b_f \propto ({symbol})^k$, k = {one.exponent}".replace("-", "\N{MINUS SIGN}"),
            transform=top.transAxes, ha="center", va="top", fontsize=8,
        )  # fmt: skip
        below.set(xscale="log", xlabel=f"${symbol}$ ({unit})" if unit else f"${symbol}$")
        if not unit:
            below.set_xticks(one.trend.values, [f"{value:g}" for value in one.trend.values])
            below.xaxis.set_minor_formatter(NullFormatter())
        plain(top)
        plain(below)
    axes[0, 0].set(ylabel=r"final mean radius, $b_f/b_0$", ylim=(0.9, None))
    axes[1, 0].set_ylabel("breakages per merger")
    letters(axes[0], 9)
    return figure


def points(axis: Axes, values: Sequence[float], means: Sequence[Mean], colour: str) -> None:
    """Draw means with their intervals over a logarithmic axis."""
    axis.errorbar(
        values, [one.value for one in means], yerr=[one.half for one in means], fmt="o-", ms=4, capsize=3,
        color=colour,
    )  # fmt: skip
    axis.set(ylim=(0, None))


def main() -> None:
    """Run the flows, print the table and draw the figure."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--grains", type=int, default=250)
    parser.add_argument("--starts", type=int, default=48)
    parser.add_argument("--surface-energy", type=float, default=SURFACE_ENERGY, help="J/m^2")
    parser.add_argument("--out", type=Path, help="file of the figure")
    options = parser.parse_args()
    if options.starts < 2:
        parser.error(f"--starts must be at least 2 for an interval; received {options.starts}")
    found = study(options.grains, range(options.starts), options.surface_energy)
    print(table(found))
    if options.out is not None:
        trends_figure(found).savefig(options.out, dpi=150)


if __name__ == "__main__":
    main()
