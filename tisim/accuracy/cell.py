"""A cost study as HTML in the output of a cell of a notebook."""

from __future__ import annotations

from tisim.accuracy.cost_study import Study
from tisim.accuracy.report import error_texts
from tisim.errors import InputError, RunError
from tisim.files import pictures
from tisim.notebook import CELL_DOTS_PER_INCH, card, card_picture, card_table


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
