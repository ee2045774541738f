"""What a finished search shows: a table like Z04's tables 1 to 3, and its convergence (Z04 figure 4)."""

from __future__ import annotations

import csv
import io
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from optimize.outcome import Outcome
from optimize.tables import best_columns, logbook_columns
from tisim.durable import replace_file
from tisim.figure import empty

WIDTH = 80
"""Of the table of the best designs; every terminal has as many columns."""
_BEST, _MEAN, _MARK, _SURE = "#0b5394", "#8a8a8a", "#c9c9c9", "#b45f06"


def best_table(outcome: Outcome) -> RenderableType:
    """The best designs for the terminal: a column per design, genes in their units, fitness with its 95 %
    interval, derived values. In several tables where they would not fit on WIDTH columns side by side.
    """
    headings, *rows = (
        (heading, *map(_text, values))
        for heading, values in best_columns(outcome.problem, outcome.hall).items()
    )
    designs = max(1, (WIDTH - max(len(row[0]) for row in rows)) // (1 + _widest(rows)))
    blocks: list[RenderableType] = [Text(outcome.problem.title or outcome.problem.name, "italic")]
    for first in range(1, max(2, len(headings)), designs):
        table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
        table.add_column(headings[0], no_wrap=True)
        for heading in headings[first : first + designs]:
            table.add_column(heading, justify="right", no_wrap=True)
        for name, *cells in rows:
            table.add_row(Text(name), *cells[first - 1 : first - 1 + designs])
        blocks += ["", table]
    return Group(*blocks)


def details_table(details: Mapping[str, float]) -> RenderableType:
    """What the run of the best design shows, for the terminal."""
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, show_header=False)
    for name, value in details.items():
        table.add_row(name, _text(value))
    return Group("", Text("the best design, run once more", "italic"), table)


def details_csv(details: Mapping[str, float]) -> bytes:
    """The same as CSV, all digits."""
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(["quantity", "value"])
    writer.writerows(details.items())
    return text.getvalue().encode()


def _widest(rows: Sequence[Sequence[str]]) -> int:
    return max((len(cell) for row in rows for cell in row[1:]), default=0)


def best_csv(outcome: Outcome) -> bytes:
    """The best designs as CSV, all digits, one column per heading of best_columns."""
    columns = best_columns(outcome.problem, outcome.hall)
    text = io.StringIO(newline="")
    writer = csv.writer(text)
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return text.getvalue().encode()


def convergence_figure(outcome: Outcome) -> Figure:
    """Best and mean fitness against generation, and below it the problem's first derived value of the best.

    Dotted lines mark the generations after which the search box was re-centred. Where the best design has
    been run again from fresh starts, that stands at the end: the curve is lower by the luck of a winner.
    """
    problem = outcome.problem
    log = logbook_columns(problem, outcome.logbook)
    derived = next(iter(problem.derived), None)
    panels = 2 if derived else 1
    figure = empty(5.6, 2.7 * panels)
    axes = figure.subplots(panels, 1, sharex=True, squeeze=False)[:, 0]
    if log:
        generation = np.array(log["gen"])
        best, mean = _plottable(log["best"]), _plottable(log["mean"])
        axes[0].plot(generation, mean, color=_MEAN, marker="o", ms=2.5, lw=1, label="mean of the population")
        axes[0].plot(generation, best, color=_BEST, marker="o", ms=3.5, lw=1.6, label="best")
        if derived:
            axes[1].plot(generation, _plottable(log[derived]), color=_BEST, marker="o", ms=3.5, lw=1.6)
        sure = outcome.best.confirmed if outcome.best else None
        if sure is not None:
            axes[0].errorbar(
                generation[-1] + 0.4, sure.mean, sure.half_width, color=_SURE, marker="s", ms=3.5, lw=1.2,
                capsize=2, ls="none", label="best, from fresh starts, 95 % CI",
            )  # fmt: skip
            if derived:
                value = problem.derived[derived](sure.mean)
                axes[1].plot(generation[-1] + 0.4, value, color=_SURE, marker="s", ms=3.5)
        for axis in axes:
            for count, at in enumerate(generation[np.array(log["recentred"], dtype=bool)]):
                label = "search box re-centred" if count == 0 else None
                axis.axvline(at, color=_MARK, ls=":", lw=1.2, zorder=0, label=label)
        axes[0].legend(framealpha=1, edgecolor="none", fontsize=8)
    axes[0].set_ylabel(problem.symbol)
    if derived:
        axes[1].set_ylabel(f"{derived} of the best")
    axes[-1].set_xlabel("generation")
    axes[-1].xaxis.set_major_locator(MaxNLocator(integer=True))
    for axis in axes:
        axis.spines[["top", "right"]].set_visible(False)
        axis.tick_params(direction="in")
    return figure


def write(outcome: Outcome, folder: str | Path) -> dict[str, Path]:
    """Write best.csv, convergence.png and convergence.pdf into a folder (made if missing); name -> path.

    Each file is, at every instant, the old one or the new one. RunError if the disk is full.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    figure = convergence_figure(outcome)
    contents = {
        "best.csv": best_csv(outcome),
        "convergence.png": drawn(figure, "png", dpi=200),
        "convergence.pdf": drawn(figure, "pdf"),
    }
    for name, content in contents.items():
        replace_file(folder / name, content)
    return {name: folder / name for name in contents}


def drawn(figure: Figure, kind: str, **options: Any) -> bytes:
    """A figure as the bytes of a file of that kind."""
    file = io.BytesIO()
    figure.savefig(file, format=kind, **options)
    return file.getvalue()


def _text(value: Any) -> str:
    """Four digits; 1.5e8 and not 1.5e+08, which is two columns more."""
    if not isinstance(value, float):
        return str(value)
    digits, power, exponent = f"{value:.4g}".partition("e")
    return f"{digits}e{int(exponent)}" if power else digits


def _plottable(values: list[float]) -> np.ndarray:
    """Generations without a successful design leave a gap."""
    array = np.array(values, dtype=float)
    return np.where(np.isfinite(array), array, np.nan)
