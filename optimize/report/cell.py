"""The outcome of a search as HTML in the output of a cell of a notebook."""

from __future__ import annotations

from tisim.errors import InputError, RunError
from tisim.files import pictures
from tisim.notebook import CELL_DOTS_PER_INCH, card, card_picture, card_table
from tisim.optimize.outcome import Outcome
from tisim.optimize.report.report import shown_designs

DESIGNS_IN_CELL = 5
"""Largest number of designs in a cell."""


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
