"""Figures of calibration and sensitivity."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.transforms import ScaledTranslation

from tisim.optimize.analysis.calibration import Calibration, GeneEstimate, shown
from tisim.optimize.analysis.sensitivity import LEAST_Q2, MOVES, Between, Sensitivity
from tisim.plotting.style import empty, letters, plain, superscripts

_KNOWN, _RANGE, _FIRST, _TOTAL = "#0b5394", "0.88", "#0b5394", "#9fc5e8"
_FAR, _CLOSE = "#b45f06", "#0b5394"
_ROW = 0.5
"""Height of the row of a gene, inches."""


def calibration_figure(found: Calibration) -> Figure:
    """Draw the 95 % interval of each gene within its range, and the correlations of the estimates."""
    genes = found.genes
    size = max(2.2, _ROW * len(genes) + 1.2)
    figure = empty(5.2 + size + 1.2, size)
    left, right = figure.subplots(1, 2, width_ratios=(5.2, size))
    for row, one in enumerate(genes):
        _interval(left, row, one)
    left.set_yticks(range(len(genes)), [_label(one.name, one.unit) for one in genes])
    left.set_ylim(len(genes) - 0.4, -0.6)
    left.set_xlim(-0.02, 1.02)
    left.set_xticks([0, 0.5, 1], ["lowest", "range of the search", "highest"])
    left.spines[["top", "right", "left"]].set_visible(False)
    left.tick_params(axis="both", length=0)
    left.set_title("estimate and 95 % interval")
    _correlations(right, found)
    letters((left, right))
    return figure


def _interval(axis: Axes, row: int, one: GeneEstimate) -> None:
    axis.barh(row, 1.0, color=_RANGE, height=0.3)
    axis.barh(row, one.high_part - one.low_part, left=one.low_part, color=_KNOWN, height=0.3,
              alpha=1.0 if one.told else 0.35)  # fmt: skip
    for end, is_open, mark in ((one.low_part, one.open_low, "<"), (one.high_part, one.open_high, ">")):
        if is_open:
            axis.plot(end, row, mark, color=_KNOWN, ms=7, clip_on=False)
    if one.told:
        axis.plot(one.estimate_part, row, "o", color="white", mec=_KNOWN, ms=5)
    estimate, low, high = shown(one)
    words = f"{estimate}  ({low} to {high})" if one.told else "not told"
    middle = float(np.clip((one.low_part + one.high_part) / 2, 0.22, 0.78))
    axis.text(middle, row - 0.22, words, ha="center", va="bottom", fontsize=8)


def _correlations(axis: Axes, found: Calibration) -> None:
    names = [one.name for one in found.genes]
    drawn = axis.imshow(found.correlation, cmap="RdBu_r", vmin=-1, vmax=1)
    axis.set_facecolor(_RANGE)
    for (i, j), value in np.ndenumerate(found.correlation):
        if np.isnan(value):
            continue
        colour = "white" if abs(value) > 0.6 else "black"
        number = _minus(f"{value:.2f}".replace("-0.00", "0.00"))
        axis.text(j, i, number, ha="center", va="center", fontsize=8, color=colour)
    axis.set_xticks(range(len(names)), names, rotation=35, ha="right")
    axis.set_yticks(range(len(names)), names)
    axis.tick_params(length=0, labelsize=8)
    axis.set_title("correlation of the estimates")
    axis.figure.colorbar(drawn, ax=axis, shrink=0.8)


def sensitivity_figure(found: Sequence[Sensitivity]) -> Figure:
    """Draw a row of panels for each objective: its change as each gene moves from the best design, and the
    first-order and total indices over the whole range; bars are 95 % intervals."""
    genes = len(found[0].genes)
    figure = empty(8.6, (0.42 * genes + 1.7) * len(found))
    panels = figure.subplots(len(found), 2, squeeze=False, sharey=True)
    for (left, right), one in zip(panels, found, strict=True):
        _changes(left, one)
        _indices(right, one)
        left.set_yticks(range(genes), [_label(gene.name, gene.unit) for gene in one.genes])
        left.set_ylim(genes - 0.4, -0.6)
    letters(panels.ravel(), 9)
    return figure


def _changes(axis: Axes, one: Sensitivity) -> None:
    plain(axis)
    axis.axvline(0.0, color="0.6", lw=0.8)
    for move, place in zip(MOVES, (-0.24, -0.08, 0.08, 0.24), strict=True):
        values, rows, sides = _bars([gene.changes[move] for gene in one.genes], place)
        axis.errorbar(
            values, rows, xerr=sides, fmt="<" if move < 0 else ">", ms=5, lw=1.0, capsize=0,
            color=_FAR if abs(move) > 0.05 else _CLOSE, label=_minus(f"{100 * move:+g} % of range"),
        )  # fmt: skip
    axis.set_xlabel(f"change of {superscripts(one.label)}")
    doubt = one.doubt.partition(":")[0]
    axis.set_title("moved from the best design" + f",\nwhich {doubt}" * bool(doubt), fontsize=9)
    _legend_below(axis, 4)


def _indices(axis: Axes, one: Sensitivity) -> None:
    plain(axis)
    axis.set_title("part of the variance over all ranges", fontsize=9)
    axis.set_xlabel(f"Sobol' index of {superscripts(one.objective)}")
    axis.set_xlim(0.0, 1.0)
    if not one.trusted:
        words = f"{one.q2.value:.2f} of the variance of designs left out,\nless than {LEAST_Q2:g}"
        axis.text(0.5, 0.5, f"not given: the surrogate predicts\n{words}", ha="center", va="center",
                  color="0.4", fontsize=9, transform=axis.transAxes)  # fmt: skip
        return
    ends = 1.0
    for what, colour, place, label in (
        ([gene.first for gene in one.genes], _FIRST, -0.17, "alone (first order)"),
        ([gene.total for gene in one.genes], _TOTAL, 0.17, "with others (total)"),
    ):
        values, at, sides = _bars(what, place)
        axis.barh(at, np.maximum(values, 0.0), height=0.32, color=colour, label=label)
        axis.errorbar(values, at, xerr=sides, fmt="none", ecolor="0.25", lw=1.0)
        ends = max(ends, max(between.high for between in what))
    axis.set_xlim(0.0, ends)
    _legend_below(axis, 2)


def _legend_below(axis: Axes, columns: int) -> None:
    """Put a legend below the label of the axis, at the same distance for panels of any height."""
    inches = axis.figure.dpi_scale_trans
    axis.legend(
        frameon=False, fontsize=7, ncols=columns, loc="upper center", bbox_to_anchor=(0.5, 0.0),
        bbox_transform=axis.transAxes + ScaledTranslation(0.0, -0.4, inches),
    )  # fmt: skip


def _bars(what: Sequence[Between], place: float) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Return values, rows and the lengths of the interval on either side."""
    values = np.array([one.value for one in what])
    sides = np.array([[one.value - one.low for one in what], [one.high - one.value for one in what]])
    return values, np.arange(len(what)) + place, np.maximum(sides, 0.0)


def _minus(number: str) -> str:
    return number.replace("-", "\N{MINUS SIGN}")


def _label(name: str, unit: str) -> str:
    return superscripts(f"{name} ({unit})") if unit else name
