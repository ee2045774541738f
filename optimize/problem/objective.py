"""What a design is judged by: a quantity of its runs, and whether much or little of it is wanted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from optimize.problem.statistic import MEAN, Statistic
from tisim.errors import must


@dataclass(frozen=True)
class Objective:
    """A quantity that is to be made small, or large.

    name : heading in tables and plots; unit : of the values, "" if they have none.
    of : Result -> value in that unit, of a plain function FunctionResult -> value. Called for runs that ended
        well only; NaN and inf never win. For a Misfit it returns a dictionary of the measured quantities.
    statistic : what counts of the values from all random starts: Mean(), Quantile(0.9), WorstOf(8) or
        Misfit({"angle": (27.9, 3.0)}).
    Raises InputError for an empty name, for a statistic that is none, and for a misfit that is maximised.
    """

    name: str
    of: Callable[[Any], Any]
    unit: str = ""
    maximise: bool = False
    statistic: Statistic = MEAN

    def __post_init__(self) -> None:
        must(bool(self.name.strip()), "objective name", "a non-empty string", self.name)
        kinds = "Mean(), Quantile(share), WorstOf(starts) or Misfit(measured)"
        must(isinstance(self.statistic, Statistic), f"statistic of {self.name}", kinds, self.statistic)
        wanted = self.maximise and bool(self.statistic.quantities)
        must(not wanted, f"maximise of {self.name}", "False, as it is a misfit", self.maximise)

    @property
    def sign(self) -> float:
        """Cost = sign * value. A cost is minimised; the search knows costs only, people see values only."""
        return -1.0 if self.maximise else 1.0

    @property
    def label(self) -> str:
        """The name, the unit and the statistic, as a heading."""
        heading = f"{self.name} ({self.unit})" if self.unit else self.name
        return f"{heading}, {self.statistic.label}" if self.statistic.label else heading

    @property
    def quantities(self) -> tuple[str, ...]:
        """The names of the values that are kept of each run: its own, or those that were measured."""
        return self.statistic.quantities or (self.name,)

    def cost(self, values: ArrayLike) -> float:
        """Return the cost of a design; values : of its runs, shape (starts, quantities)."""
        return self.sign * self.statistic.value(self._columns(values), self.sign)

    def pseudo_costs(self, values: ArrayLike) -> np.ndarray:
        """Return a value of each run of which the cost is about the mean (Statistic.pseudo_values)."""
        return self.sign * self.statistic.pseudo_values(self._columns(values), self.sign)

    def interval_of_cost(self, values: ArrayLike, seen: ArrayLike = ()) -> tuple[float, float]:
        """Return the ends of the 95 % interval of the cost; seen : values that runs of other designs have
        had."""
        ends = self.statistic.interval(self._columns(values), np.asarray(seen, dtype=float), self.sign)
        return ends if self.sign > 0 else (-ends[1], -ends[0])

    def _columns(self, values: ArrayLike) -> np.ndarray:
        """Return values as its statistic takes them: without the second axis where there is one quantity that
        has no name of its own."""
        columns = np.asarray(values, dtype=float).reshape(-1, len(self.quantities))
        return columns if self.statistic.quantities else columns[:, 0]
