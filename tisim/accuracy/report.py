"""A study as text and as a cell of a notebook: its settings, and the commands for the cheapest."""

from __future__ import annotations

from collections.abc import Sequence
from textwrap import fill

from rich.console import Group, RenderableType
from rich.table import Table
from rich.text import Text

from tisim.accuracy.cost_study import Row, Study
from tisim.accuracy.quantity import ADVICE, tells_apart
from tisim.accuracy.scene_changes import shell_line
from tisim.console import TERMINAL_WIDTH
from tisim.errors import InputError, RunError
from tisim.files import pictures
from tisim.notebook import CELL_DOTS_PER_INCH, card, card_picture, card_table

HEADINGS = (
    "time: median of the wall seconds; spread: longest minus shortest",
    "steps, forces, rejected: steps, force evaluations and rejected steps per particle",
    "best for: the error for which no other setting is faster",
)
"""Explanations of the column headings of the table."""


def table(study: Study) -> RenderableType:
    """Return a table of all settings by method, with median time, work and errors, for printing with rich.

    The last column has the error for which a setting is the cheapest, in brackets if its time
    cannot be told from the time of the recommended setting. Failed settings are listed below each method with
    the reason.
    """
    names = [quantity.name.replace(" ", "\n") for quantity in study.quantities]
    heads = ["", "time\n(s)", "spread\n(s)", "steps", "forces", "re-\njected", *names, "best\nfor"]
    best: dict[tuple[str, str], str] = {}
    for error, (chosen, *others) in study.decades().items():
        best |= {row.key: f"({error:.0e})" for row in others} | {chosen.key: f"{error:.0e}"}
    cells = {row.key: _cells(row, best.get(row.key, "")) for row in study.rows if not row.failed}
    columns = zip(heads, *cells.values(), strict=True)
    first, *widths = (max(len(line) for cell in column for line in cell.split("\n")) for column in columns)
    # Numbers are never cut: setting descriptions wrap between words, and the column fits the longest word.
    longest = max((len(word) for row in study.rows for word in row.setting.split()), default=0)
    widths = [max(1 + longest, min(1 + first, TERMINAL_WIDTH - sum(widths) - len(widths))), *widths]
    for cell in cells.values():
        cell[0] = fill(cell[0], widths[0], initial_indent=" ", subsequent_indent=" ")
    relative = ", ".join(f"{q.name}: relative to {q.relative_to}" for q in study.quantities)
    blocks: list[RenderableType] = [Text(f"errors of {relative}"), _grid([heads], widths, "bold")]
    for method in dict.fromkeys(row.method for row in study.rows):
        rows = study.line(method)
        blocks += [Text(method, "bold"), _grid([cells[row.key] for row in rows if not row.failed], widths)]
        blocks += [Text(f"  {row.setting}: {row.failed}") for row in rows if row.failed]
    return Group(*blocks)


def _grid(lines: list[list[str]], widths: list[int], style: str = "") -> Table:
    """Return lines in columns of these widths; text too long for the first column wraps."""
    grid = Table.grid(padding=(0, 1, 0, 0))
    for k, width in enumerate(widths):
        grid.add_column(
            justify="right" if k else "left", vertical="bottom", width=width, no_wrap=k > 0, style=style
        )
    for line in lines:
        grid.add_row(*line)
    return grid


def error_texts(row: Row) -> list[str]:
    """Return the error of each quantity as text, or its upper bound if the error is not known."""
    return [
        f"{row.errors[k][0]:.1e}" if row.trusted(k) else f"< {row.at_most(k):.0e}"
        for k in range(len(row.errors))
    ]


def _cells(row: Row, best: str) -> list[str]:
    work = [f"{value:.0f}" for value in (row.steps, row.sums, row.rejections)]
    note = "no change" if row.same else best
    return [row.setting, f"{row.median:.3g}", f"{row.spread:.1g}", *work, *error_texts(row), note]


def truths(study: Study) -> list[str]:
    """Return a line for each quantity with the origin and the error of its true value. A second line warns if
    the reference cannot tell settings apart, unless the study then stops with that message."""
    lines = []
    for quantity, truth in zip(study.quantities, study.truths, strict=False):
        own = f"; its own error at most {truth.error:.1e}" if truth.error else ""
        lines.append(f"error of {quantity.name}: against {truth.source}{own}")
        if not tells_apart(quantity, truth) and not study.require_reference:
            lines.append(
                f"{quantity.name}: the reference itself is off by {truth.error:.1g} of the motion, so errors "
                f"say little: {ADVICE}"
            )
    return lines


def notes(study: Study) -> list[str]:
    """Return the lines below the table: the true values, and explanations of terms in the table."""
    lines = truths(study)
    measured = [row for row in study.rows if row.errors]
    lines += HEADINGS if measured else []
    if any(not row.trusted(k) for row in measured for k in range(len(row.errors))):
        lines.append("<: upper bound of an error that is too small to be known")
    if any(len(rows) > 1 for rows in study.decades().values()):
        lines.append(
            "best for, in brackets: within the timing uncertainty as fast as another setting with less work"
        )
    if not study.complete:
        lines.append(
            "not complete: the budget was spent, or the study was stopped, before all settings were run"
        )
    if any(row.same for row in study.rows):
        lines.append("no change: the same errors, up to rounding, as with the law that it approximates")
    return lines


def recipe(row: Row, words: Sequence[str], quantity: int = 0) -> str:
    """Return how to run a setting: as Python in a scene, and as a command.

    words : all arguments of ``tisim run``. quantity : index of the quantity whose error is shown.
    """
    starts = f", over {row.starts} random starts" if row.starts > 1 else ""
    return (
        f"{row.method}: {row.setting}{starts}: {row.median:.3g} s, error {row.at_most(quantity):.1e}\n"
        f"  stepper={row.python}\n"
        f"  {shell_line(['tisim', 'run', *words])}"
    )


def study_cell(study: Study) -> str:
    """Return a study as HTML: the cheapest setting for each power of ten of the error, and the plot of error
    against time."""
    rows, notes = [], list[str]()
    for error, (best, *_) in study.decades().items():
        setting = f"{best.method}: {best.setting}"
        rows.append(
            (f"{error:.0e}", setting, f"{best.median:.3g} s", ", ".join(error_texts(best)), best.options)
        )
    names = ", ".join(quantity.name for quantity in study.quantities)
    head = ("error below", "cheapest setting", "wall time", f"error of {names}", "options of tisim run")
    html = [card_table(head, rows)] if rows else []
    if study.rows:
        try:
            with pictures.drawing("error against time"):
                from tisim.accuracy.figure import plot

                png = pictures.image(plot(study), dpi=CELL_DOTS_PER_INCH)
                html.append(card_picture(png, "error against wall time of all settings"))
        except (InputError, RunError) as failure:
            notes.append(f"{failure}.")
    failed = sum(bool(row.failed) for row in study.rows)
    count = f"{len(study.rows)} settings" + (f", {failed} failed" if failed else "")
    state = "complete" if study.complete else "not complete"
    return card(study.scene.name, f"cost study: {count}, {state}", html, notes)
