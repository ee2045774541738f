"""The report of a search: a table like Z04's tables 1 to 3, its convergence (Z04 figure 4), and a cell of a
notebook with both."""

from __future__ import annotations

import csv
import functools
import io
from collections.abc import Callable, Mapping, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tisim.console import TERMINAL_WIDTH
from tisim.errors import InputError, RunError
from tisim.files import pictures
from tisim.files.atomic import replace_file
from tisim.notebook import CELL_DOTS_PER_INCH, card, card_picture, card_table
from tisim.optimize.outcome import Outcome
from tisim.optimize.tables import ERROR, FEASIBLE, HIGH, LOW, best_columns, met_columns, met_points

if TYPE_CHECKING:
    from matplotlib.figure import Figure

DESIGNS_IN_CELL = 5
"""Largest number of designs in a cell of a notebook."""
SHARP = 200
"""The resolution of figures for papers, dots per inch."""


def best_table(outcome: Outcome) -> RenderableType:
    """Return the best designs for the terminal: a column for each design, genes in their units, fitness from
    held-out starts with its 95 % interval, derived values.

    Several tables are used if the columns do not fit into TERMINAL_WIDTH. Of a front, at most
    ``hall_of_fame`` designs are shown, spread along it.
    """
    columns = best_columns(outcome.problem, outcome.hall)
    places = outcome.settings.hall_of_fame if outcome.problem.several else len(outcome.hall)
    indices = spread(len(outcome.hall), places)
    headings, *rows = ((heading, *(text(values[k]) for k in indices)) for heading, values in columns.items())
    designs = max(1, (TERMINAL_WIDTH - max(len(row[0]) for row in rows)) // (1 + _widest(rows)))
    title = outcome.problem.title or outcome.problem.name
    part = (
        f"; {len(indices)} of the {len(outcome.hall)} designs of its front" if outcome.problem.several else ""
    )
    blocks: list[RenderableType] = [Text(title + part, "italic")]
    for first in range(1, max(2, len(headings)), designs):
        table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
        table.add_column(headings[0], no_wrap=True)
        for heading in headings[first : first + designs]:
            table.add_column(heading, justify="right", no_wrap=True)
        for name, *cells in rows:
            table.add_row(Text(name), *cells[first - 1 : first - 1 + designs])
        blocks += ["", table]
    return Group(*blocks)


def shown_designs(outcome: Outcome, most: int) -> tuple[list[str], list[list[str]]]:
    """Return headings, and a row of text for each of the best designs: genes, objectives and constraints in
    their units, with 95 % intervals if they are known. Of a front, ``most`` designs spread along it are
    shown, otherwise the first."""
    columns = best_columns(outcome.problem, outcome.hall)
    count = len(outcome.hall)
    indices = spread(count, most) if outcome.problem.several else range(min(count, most))
    return list(columns), [[text(values[k]) for values in columns.values()] for k in indices]


def notes(outcome: Outcome) -> RenderableType:
    """Return a line if no design satisfies the constraints, and explanations of the headings of
    ``best_table``, a line each; empty if there is no design."""
    problem, ensemble = outcome.problem, outcome.settings.ensemble
    if not outcome.hall:
        return Group()
    first = outcome.hall[0]
    warnings = []
    if outcome.violated:
        warnings.append(f"no design satisfies the constraints; of the first one, {outcome.violated}")
    elif outcome.doubt:
        warnings.append(f"the {'compromise' if problem.several else 'first design'} {outcome.doubt}")
    words = {
        "starts": "number of random starts in the mean",
        ERROR: "standard error of that mean; it does not include the bias from choosing the best designs",
    }
    if all(estimate.exact for estimate in first.estimates):
        words = {"starts": "one: all random starts of a design give the same run"}
    if any(individual.estimates[0].converged for individual in outcome.hall) and ensemble.tolerance:
        words["converged"] = (
            f"yes if the last start changed the mean by less than {ensemble.tolerance:g} of it"
        )
    if first.confirmed:
        words["fresh starts"] = "held-out starts, not used to choose the designs"
        words[f"{LOW}, {HIGH}"] = "ends of the 95 % confidence interval of the mean"
    if problem.result_constraints:
        words[FEASIBLE] = (
            "yes if the intervals of all constraints lie within the bounds; no if a mean does not; unproven "
            "if an interval contains a bound, or is not known"
        )
    meanings = {**problem.meanings, **words}
    return Group(
        "",
        *(Text(warning, "bold") for warning in warnings),
        *(Text(f"{heading}: {meaning}", "dim") for heading, meaning in meanings.items()),
    )


def met_table(outcome: Outcome) -> RenderableType:
    """Return the ranges of the genes over all designs with a fitness of ``met_at`` or better that satisfy the
    constraints of the result, for the terminal."""
    problem = outcome.problem
    points, (objective,) = met_points(problem, outcome.estimates, outcome.limits), problem.objectives
    bound = "at least" if objective.maximise else "at most"
    number = f"{len(points)} of {len(outcome.estimates)} designs"
    also = " and satisfy the constraints" if problem.result_constraints else ""
    title = Text(f"{number} have {objective.label} of {bound} {problem.met_at:g}{also}", "italic")
    if not points:
        return Group("", title)
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False)
    table.add_column("over these", no_wrap=True)
    for heading in ("lowest", "highest", "part of its range"):
        table.add_column(heading, justify="right", no_wrap=True)
    for gene, values in zip(problem.genome.searched, problem.genome.canonical(points).T, strict=True):
        if gene.kind == "category":
            met = {text(gene.decode(u)) for u in values}
            table.add_row(Text(gene.label), Text(", ".join(sorted(met))), "", f"{len(met)} of {gene.width}")
            continue
        ends = float(values.min()), float(values.max())
        low, high = (text(gene.decode(end)) for end in ends)
        table.add_row(Text(gene.label), low, high, f"{100 * (ends[1] - ends[0]):.0f} %")
    return Group("", title, table)


def spread(number: int, places: int) -> list[int]:
    """Return at most ``places`` evenly spaced indices out of ``number``, the first and the last included."""
    return sorted({round(k) for k in np.linspace(0, number - 1, min(number, places))})


def details_table(details: Mapping[str, float]) -> RenderableType:
    """Return the details of the best design's run, for the terminal."""
    table = Table(box=None, padding=(0, 1, 0, 0), pad_edge=False, show_header=False)
    for name, value in details.items():
        table.add_row(name, text(value))
    return Group("", Text("the best design, run once more", "italic"), table)


def details_csv(details: Mapping[str, float]) -> bytes:
    """Return the details of the best design's run as CSV, all digits."""
    return columns_csv({"quantity": [*details], "value": [*details.values()]})


def _widest(rows: Sequence[Sequence[str]]) -> int:
    return max((len(cell) for row in rows for cell in row[1:]), default=0)


def best_csv(outcome: Outcome) -> bytes:
    """Return the best designs as CSV, all digits, one column per heading of best_columns."""
    return columns_csv(best_columns(outcome.problem, outcome.hall))


def met_csv(outcome: Outcome) -> bytes:
    """Return the designs of ``met_table`` as CSV, all digits."""
    return columns_csv(met_columns(outcome.problem, outcome.estimates, outcome.limits))


def columns_csv(columns: Mapping[str, Sequence[Any]]) -> bytes:
    """Return columns as CSV, all digits: a heading, and a line for each row."""
    stream = io.StringIO(newline="")
    writer = csv.writer(stream)
    writer.writerow(columns)
    writer.writerows(zip(*columns.values(), strict=True))
    return stream.getvalue().encode()


def write(outcome: Outcome, folder: str | Path) -> dict[str, Path]:
    """Write best.csv, met.csv (if the problem has ``met_at``), and convergence and front (for several
    objectives) as .png and .pdf into a folder, which is made if missing; return name -> path.

    Each file is, at every instant, the old one or the new one. RunError if the disk is full. A figure that
    cannot be drawn is skipped, with a message on standard error.
    """
    folder = Path(folder)
    folder.mkdir(parents=True, exist_ok=True)
    contents = {"best.csv": best_csv(outcome)}
    if outcome.problem.met_at is not None:
        contents["met.csv"] = met_csv(outcome)
    for name, content in contents.items():
        replace_file(folder / name, content)
    paths = [folder / name for name in contents]
    figures = {"convergence": _convergence}
    if outcome.problem.several:
        figures["front"] = _front
    for name, draw in figures.items():
        paths += picture(folder / name, functools.partial(draw, outcome))
    return {path.name: path for path in paths}


def picture(path: Path, draw: Callable[[], Figure]) -> list[Path]:
    """Write a figure as .png and .pdf; return their paths, none if it cannot be drawn."""
    figure = functools.cache(draw)
    written = pictures.write_beside_data(path.with_suffix(".png"), figure, SHARP)
    return written and written + pictures.write_beside_data(path.with_suffix(".pdf"), figure)


def _convergence(outcome: Outcome) -> Figure:
    from tisim.optimize.report.convergence import convergence_figure

    return convergence_figure(outcome)


def _front(outcome: Outcome) -> Figure:
    from tisim.optimize.report.front import front_figure

    return front_figure(outcome)


def text(value: Any) -> str:
    """Return a number with four digits, as 1.5e8 instead of the longer 1.5e+08; a text unchanged."""
    if not isinstance(value, float):
        return str(value)
    digits, power, exponent = f"{value:.4g}".partition("e")
    return f"{digits}e{int(exponent)}" if power else digits


def outcome_cell(outcome: Outcome) -> str:
    """Return the outcome of a search as HTML: its best designs in their units, and the convergence, or the
    front of several objectives."""
    problem, notes = outcome.problem, list[str]()
    html = []
    if outcome.hall:
        html.append(card_table(*shown_designs(outcome, DESIGNS_IN_CELL)))
        try:
            with pictures.drawing("the search"):
                from tisim.optimize.report.convergence import convergence_figure
                from tisim.optimize.report.front import front_figure

                draw = front_figure if problem.several else convergence_figure
                text = "the front of the objectives" if problem.several else "the best value by generation"
                html.append(card_picture(pictures.image(draw(outcome), dpi=CELL_DOTS_PER_INCH), text))
        except (InputError, RunError) as failure:
            notes.append(f"{failure}.")
    if outcome.violated:
        notes.append(f"No design satisfies the constraints; of the first one, {outcome.violated}.")
    elif outcome.doubt:
        notes.append(f"The {'compromise' if problem.several else 'first design'} {outcome.doubt}.")
    if not outcome.hall and outcome.failures:
        first = next(iter(outcome.failures.values()))[0]
        notes.append(f"All designs failed; the first one: {first.reason}")
    runs = f"{outcome.evaluations:,} runs" + (f", {outcome.hits:,} from the file" if outcome.hits else "")
    ended = f"stopped by {outcome.stopped}" if outcome.stopped else "not finished"
    return card(problem.title or problem.name, f"search: {runs}, {ended}", html, notes)
