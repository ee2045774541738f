"""A figure of the front of several objectives, their trade-off.

Of many designs estimated from few starts, the luckiest appear to lie beyond the front, whose designs have
more starts. Designs with fewer starts than the front are therefore drawn differently and labelled. Intervals
are drawn only for held-out starts, because the starts that chose a design bias its values. Designs that
violate a constraint of the result are crosses; members of the front that may violate one are open.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.outcome import Outcome
from tisim.optimize.problem.feasibility import excess, feasible
from tisim.optimize.tables import interval_of_value
from tisim.plotting.style import empty, letters, plain, scale_of, superscripts

_FRONT_COLOUR, _MANY_STARTS_COLOUR, _FEW_STARTS_COLOUR, _CHOSEN_COLOUR = (
    "#0b5394",
    "#8f8f8f",
    "#d3d3d3",
    "#b45f06",
)
Estimates = tuple[FitnessEstimate, ...]


def front_figure(outcome: Outcome) -> Figure:
    """Draw a panel for each pair of objectives.

    It shows the front, with 95 % confidence intervals if it has held-out starts; other designs behind it; and
    the compromise (Outcome.best).
    """
    pairs = list(combinations(range(len(outcome.problem.objectives)), 2))
    figure = empty(5.6 * len(pairs), 5.0)
    axes = figure.subplots(1, len(pairs), squeeze=False)[0]
    for axis, (x, y) in zip(axes, pairs, strict=True):
        _panel(axis, outcome, x, y)
    figure.legend(
        *axes[0].get_legend_handles_labels(), loc="outside lower center", frameon=False, fontsize=8, ncols=1
    )
    if len(pairs) > 1:
        letters(axes)
    return figure


def others(outcome: Outcome) -> tuple[list[Estimates], list[Estimates]]:
    """Return the designs outside the front that satisfy the constraints of the result by their means: those
    with at least the median number of starts of the front, and those with fewer."""
    front = {tuple(individual) for individual in outcome.hall}
    enough = np.median([individual.estimates[0].starts for individual in outcome.hall] or [1])
    excluded = set(map(id, violating(outcome)))
    good = [e for genes, e in outcome.estimates.items() if e[0].ok and genes not in front]
    good = [e for e in good if id(e) not in excluded]
    return [e for e in good if e[0].starts >= enough], [e for e in good if e[0].starts < enough]


def violating(outcome: Outcome) -> list[Estimates]:
    """Return the designs outside the front that violate a constraint of the result by their means."""
    front, constraints = (
        {tuple(individual) for individual in outcome.hall},
        outcome.problem.result_constraints,
    )
    return [
        e for genes, e in outcome.estimates.items()
        if e[0].ok and genes not in front and excess(constraints, outcome.limits.get(genes, ()))
    ]  # fmt: skip


def _panel(axis: Axes, outcome: Outcome, x: int, y: int) -> None:
    objectives, constraints = outcome.problem.objectives, outcome.problem.result_constraints
    plain(axis)
    axis.set_xlabel(_heading(objectives[x].label, objectives[x].maximise))
    axis.set_ylabel(_heading(objectives[y].label, objectives[y].maximise))
    many, few = others(outcome)
    means, _ = _values(outcome, few)
    if few:
        axis.plot(
            means[:, x], means[:, y], "o", mfc="none", color=_FEW_STARTS_COLOUR, ms=2.5, mew=0.6, zorder=1,
            label=f"other designs, only {_starts(few)}: the luckiest appear beyond the front",
        )  # fmt: skip
    if many:
        means, _ = _values(outcome, many)
        axis.plot(
            means[:, x], means[:, y], "o", color=_MANY_STARTS_COLOUR, ms=2.5, zorder=2,
            label=f"other designs, {_starts(many)}",
        )  # fmt: skip
    if excluded := violating(outcome):
        means, _ = _values(outcome, excluded)
        axis.plot(
            means[:, x], means[:, y], "x", color=_MANY_STARTS_COLOUR, ms=3, mew=0.8, zorder=1,
            label=f"designs that violate a constraint, {_starts(excluded)}",
        )  # fmt: skip
    if not outcome.hall:
        return
    front = [individual.confirmed or individual.estimates for individual in outcome.hall]
    fresh = bool(outcome.hall[0].confirmed)
    means, widths = _values(outcome, front)
    again = "run again: " if fresh else ""
    axis.errorbar(
        means[:, x], means[:, y], xerr=widths[:, :, x] if fresh else None,
        yerr=widths[:, :, y] if fresh else None, fmt="o", color=_FRONT_COLOUR, ms=4, lw=0.8, zorder=4,
        label=f"front, {again}{_starts(front)}" + ", 95 % intervals" * bool(fresh and widths.any()),
    )  # fmt: skip
    for answer, mark, words in (
        (None, "o", "may violate a constraint"),
        (False, "X", "violates a constraint; none satisfies all"),
    ):
        rows = [
            k for k, one in enumerate(outcome.hall) if feasible(constraints, one.reported_limits) is answer
        ]
        if rows:
            axis.plot(
                means[rows, x], means[rows, y], mark, ms=4, mfc="white", mec=_FRONT_COLOUR, zorder=4.5,
                ls="", label=f"of the front, {words}",
            )  # fmt: skip
    compromise = next(k for k, individual in enumerate(outcome.hall) if individual is outcome.best)
    axis.plot(
        *means[compromise, [x, y]], "o", ms=10, mfc="none", mec=_CHOSEN_COLOUR, mew=1.5, zorder=5, ls="",
        label="nearest to the best of each",
    )  # fmt: skip
    everything, _ = _values(outcome, [*many, *few, *excluded, *front])
    axis.set_xscale(scale_of(means[:, x]) if everything[:, x].min() > 0 else "linear")
    axis.set_yscale(scale_of(means[:, y]) if everything[:, y].min() > 0 else "linear")


def _values(outcome: Outcome, estimates: Sequence[Estimates]) -> tuple[np.ndarray, np.ndarray]:
    """Return the means of the objectives, (designs, objectives), and the lower and upper lengths of their
    intervals, (2, designs, objectives), 0 if unknown."""
    objectives = outcome.problem.objectives
    many = len(objectives)
    means = [outcome.problem.costs([e.mean for e in of_all]) for of_all in estimates]
    ends = [
        [interval_of_value(e, one) for e, one in zip(of_all, objectives, strict=True)]
        for of_all in estimates
    ]  # fmt: skip
    centres = np.reshape(np.array(means, float), (-1, many))
    reach = np.abs(np.reshape(np.array(ends, float), (-1, many, 2)) - centres[:, :, None])
    return centres, np.nan_to_num(np.moveaxis(reach, 2, 0))


def _starts(estimates: Iterable[Estimates]) -> str:
    """Return the number of starts, in words: "1 start" or "4 to 30 starts"."""
    numbers = [of_all[0].starts for of_all in estimates]
    low, high = min(numbers), max(numbers)
    many = f"{low}" if low == high else f"{low} to {high}"
    return f"{many} start{'s' * (high != 1)}"


def _heading(label: str, maximise: bool) -> str:
    return f"{superscripts(label)}, {'more' if maximise else 'less'} is better"
