"""The front of several objectives, drawn: what is given up of one for more of another."""

from __future__ import annotations

from itertools import combinations

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from optimize.outcome import Outcome
from tisim.plotting.style import empty, plain

_FRONT, _SEEN, _CHOSEN = "#0b5394", "#bdbdbd", "#b45f06"


def front_figure(outcome: Outcome) -> Figure:
    """A panel for each pair of objectives: the front with 95 % confidence intervals, all designs that were
    estimated behind it, and the compromise (Outcome.best). Values from fresh starts where there are any.
    """
    pairs = list(combinations(range(len(outcome.problem.objectives)), 2))
    figure = empty(5.2 * len(pairs), 4.2)
    for axis, (x, y) in zip(figure.subplots(1, len(pairs), squeeze=False)[0], pairs, strict=True):
        _panel(axis, outcome, x, y)
    return figure


def _panel(axis: Axes, outcome: Outcome, x: int, y: int) -> None:
    objectives = outcome.problem.objectives
    plain(axis)
    axis.set_xlabel(_heading(objectives[x].label, objectives[x].maximise))
    axis.set_ylabel(_heading(objectives[y].label, objectives[y].maximise))
    if outcome.seen:
        seen = np.array(outcome.seen)
        axis.plot(seen[:, x], seen[:, y], ".", color=_SEEN, ms=3, label="designs estimated")
    if not outcome.hall:
        return
    estimates = [string.confirmed or string.estimates for string in outcome.hall]
    means = np.array([outcome.problem.costs([e.mean for e in of_all]) for of_all in estimates])
    widths = np.nan_to_num([[estimate.half_width for estimate in of_all] for of_all in estimates])
    axis.errorbar(
        means[:, x], means[:, y], xerr=widths[:, x], yerr=widths[:, y], fmt="o", color=_FRONT, ms=4, lw=0.8,
        label="front, 95 % CI",
    )  # fmt: skip
    chosen = next(k for k, string in enumerate(outcome.hall) if string is outcome.best)
    axis.plot(
        *means[chosen, [x, y]],
        "o",
        ms=10,
        mfc="none",
        mec=_CHOSEN,
        mew=1.5,
        label="nearest to the best of each",
    )
    axis.legend(framealpha=1, edgecolor="none", fontsize=8)


def _heading(label: str, maximise: bool) -> str:
    return f"{label}, {'more' if maximise else 'less'} is better"
