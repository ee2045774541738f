"""The convergence of a search: fitness by generation (Z04 figure 4)."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from numpy.typing import NDArray

from tisim.optimize.generation_log import best_of
from tisim.optimize.outcome import Outcome
from tisim.optimize.tables import interval_of_value, logbook_columns
from tisim.plotting.style import empty, legend_above, letters, symbols

_BEST, _MEAN, _MARK, _SURE = "#0b5394", "#8a8a8a", "#c9c9c9", "#b45f06"


def convergence_figure(outcome: Outcome) -> Figure:
    """Draw best and mean fitness by generation, and below it the first derived value of the best design.

    Dotted lines mark generations after which the search box was moved. If the best design was run again from
    held-out starts, that value is drawn at the end; the curve itself is biased by lucky starts. The curves
    are those of designs that satisfy the constraints of the result by their means; the mark of a best design
    that violates one, or may do so, is open. With several objectives, the best value of each is drawn, one
    below the other.
    """
    problem = outcome.problem
    if problem.several:
        return _of_several(outcome)
    log = logbook_columns(problem, outcome.logbook)
    derived = next(iter(problem.derived), None)
    panels = 2 if derived else 1
    figure = empty(6.4, 2.9 * panels)
    axes = figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0]
    if log:
        generation = np.array(log["gen"])
        best, mean = _plottable(log["best"]), _plottable(log["mean"])
        axes[0].plot(generation, mean, color=_MEAN, marker="o", ms=2.5, lw=1, label="mean of the population")
        axes[0].plot(generation, best, color=_BEST, marker="o", ms=3.5, lw=1.6, label="best")
        if derived:
            axes[1].plot(generation, _plottable(log[derived]), color=_BEST, marker="o", ms=3.5, lw=1.6)
        if outcome.best is not None and outcome.best.confirmed:
            (sure,) = outcome.best.confirmed
            doubt = outcome.doubt.partition(":")[0]
            face = "white" if doubt else _SURE
            (mean_again,) = problem.costs([sure.mean])
            ends = np.nan_to_num(interval_of_value(sure, problem.objectives[0]), nan=mean_again)
            axes[0].errorbar(
                generation[-1] + 0.4, mean_again, np.abs(ends - mean_again)[:, None], color=_SURE,
                marker="s", mfc=face, ms=3.5, lw=1.2, capsize=2, ls="none",
                label="best, fresh starts, 95 % interval" + f"; {doubt}" * bool(doubt),
            )  # fmt: skip
            if derived:
                of = problem.derived[derived]
                ends = np.array([of(end) for end in ends])
                value = of(mean_again)
                axes[1].errorbar(
                    generation[-1] + 0.4, value, [[value - min(ends)], [max(ends) - value]], color=_SURE,
                    marker="s", mfc=face, ms=3.5, lw=1.2, capsize=2,
                )  # fmt: skip
        _mark_moves(axes, log)
        legend_above(axes[0], 2)
    axes[0].set_ylabel(symbols(problem.objectives[0].label))
    if derived:
        axes[1].set_ylabel(f"{symbols(derived)} of the best")
    _finish(axes)
    return figure


def _of_several(outcome: Outcome) -> Figure:
    labels = [objective.label for objective in outcome.problem.objectives]
    log = logbook_columns(outcome.problem, outcome.logbook)
    figure = empty(5.6, 2.2 * len(labels) + 0.5)
    axes = figure.subplots(len(labels), 1, sharex=True, squeeze=False)[:, 0]
    for axis, label in zip(axes, labels, strict=True):
        axis.set_ylabel(f"best {symbols(label)}")
        if log:
            axis.plot(log["gen"], _plottable(log[best_of(label)]), color=_BEST, marker="o", ms=3.5, lw=1.6)
    _finish(axes)
    return figure


def _mark_moves(axes: NDArray[Any], log: Mapping[str, Any]) -> None:
    # After the last generation nothing is drawn from the box any more.
    moved = np.array(log["gen"])[:-1][np.array(log["recentred"], dtype=bool)[:-1]]
    for axis in axes:
        for count, at in enumerate(moved):
            label = "search box moved" if count == 0 else None
            axis.axvline(at, color=_MARK, ls=":", lw=1.2, zorder=0, label=label)


def _finish(axes: NDArray[Any]) -> None:
    axes[-1].set_xlabel("generation")
    axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    if len(axes) > 1:
        letters(axes)
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(direction="in")


def _plottable(values: list[float]) -> np.ndarray:
    """Return the values to draw, with a gap for generations without a successful design."""
    array = np.array(values, dtype=float)
    return np.where(np.isfinite(array), array, np.nan)
