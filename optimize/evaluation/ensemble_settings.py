"""Settings of an ensemble: the numbers of random starts over which a fitness is averaged."""

from __future__ import annotations

from pydantic import Field, model_validator

from tisim.components.component import Checked
from tisim.errors import must
from tisim.optimize.problem.problem import Problem

LOOKED_AT = 2
"""Number of designs that are run from two starts, to check whether the starts matter."""


class EnsembleSettings(Checked):
    """The numbers of random starts (seeds) over which a fitness is averaged.

    min_starts : starts of every design; raised if the statistic of an objective needs more (10 for a 0.9
        quantile).
    tolerance : TOL of Z04 Eq. 8.1: starts are added, ``block`` in each call of the evaluator, until the mean
        changes by less than this fraction of it, or max_starts is reached. None: no starts are added.
    common_starts : True: start k is the same for every design, so that designs are compared on equal terms;
        False: each design has its own starts; None: the default of the method.
    race : starts that a generation spends on separating the best designs (0: none).
    select : further starts of each of the best designs at the end of the search, before the best is chosen.
    confirm : held-out starts of each of the best designs afterwards, from which their values are reported (0:
        none, and no intervals); raised if the interval of a statistic needs more.

    An eighth of max_evaluations, or less if that suffices, is reserved for select and confirm; with several
    objectives, or with constraints of the result, a quarter. If the reserve is not enough, fewer designs are
    reported.
    """

    min_starts: int = Field(2, ge=1)
    max_starts: int = Field(48, ge=1)
    tolerance: float | None = Field(None, gt=0, lt=1)
    block: int = Field(2, ge=1)
    common_starts: bool | None = None
    race: int = Field(0, ge=0)
    select: int = Field(4, ge=0)
    confirm: int = Field(16, ge=0)

    @classmethod
    def kind(cls) -> str:
        """Return the name of these settings in messages, as in ``--set search.ensemble.block=2``."""
        return "search.ensemble"

    @model_validator(mode="after")
    def _ordered(self) -> EnsembleSettings:
        must(
            self.min_starts <= self.max_starts,
            "min_starts",
            f"<= max_starts = {self.max_starts}",
            self.min_starts,
        )
        return self


def fewest_starts(problem: Problem, settings: EnsembleSettings) -> int:
    """Return the number of starts of every design: the setting, or more if the statistics need more."""
    return max(settings.min_starts, *(one.statistic.fewest_starts for one in problem.objectives))
