"""The CSV file of a campaign: a line for each told value, in their order."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Any

import numpy as np

from tisim.errors import must
from tisim.files import regular_file
from tisim.files.atomic import replace_file
from tisim.optimize.designs_csv import GENERATION, WHETHER_ASKED, Row, naming, rows
from tisim.optimize.experiments import Values
from tisim.optimize.problem.problem import Problem
from tisim.optimize.tables import error_of

Tried = tuple[Values, Values, Values]
"""The values, standard errors and constraint values of one trial of a design."""


class CampaignFile:
    """The file of a campaign, or its lines alone if there is no file.

    problem : gives the columns. path : of the file, or None.
    lines : the lines below the heading, in order (see ``campaign_line``).
    """

    def __init__(self, problem: Problem, path: Path | None) -> None:
        self.problem, self.path = problem, path
        self.lines: list[list[str]] = []
        self._content = b""

    def rows(self) -> Iterator[Row]:
        """Yield the place and the values by column of each line of an existing file.

        InputError if it is not the file of a campaign.
        """
        content = None if self.path is None else regular_file.content(self.path)
        if self.path is None or not content:
            return
        self._content = content
        for place, row in rows(self.path, "campaign file"):
            with naming(place):
                known = {GENERATION, WHETHER_ASKED} <= set(row)
                must(known, "campaign file", "one of an AskTell", str(self.path))
            yield place, row

    def append(self, lines: list[list[str]]) -> None:
        """Append these lines. InputError if another program has changed the file; RunError if the disk is
        full."""
        if self.path is not None:
            rule = "as this campaign has left it; make a new AskTell to go on with it"
            same = (regular_file.content(self.path) or b"") == self._content
            must(same, "campaign file", rule, f"{self.path}, which has changed")
            text = io.StringIO(newline="")
            csv.writer(text).writerows([self._heading, *self.lines, *lines])
            content = text.getvalue().encode()
            replace_file(self.path, content)
            self._content = content
        self.lines += lines

    @property
    def _heading(self) -> list[str]:
        problem = self.problem
        return [
            GENERATION, WHETHER_ASKED, *(gene.label for gene in problem.genome.searched),
            *(objective.label for objective in problem.objectives),
            *(error_of(objective.name) for objective in problem.objectives),
            *(constraint.name for constraint in problem.result_constraints),
        ]  # fmt: skip


def campaign_line(generation: int, asked: bool, design: Mapping[str, Any], tried: Tried) -> list[str]:
    """Return the line of a trial: the number of the generation, whether the design was asked for, its genes,
    and its values; nothing for a value that is not known."""
    values, errors, limits = tried
    numbers = ("" if np.isnan(number) else repr(number) for number in (*values, *errors, *limits))
    return [str(generation), "yes" if asked else "no", *map(str, design.values()), *numbers]
