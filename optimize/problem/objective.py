"""What a design is judged by: a quantity of its runs, and whether much or little of it is wanted."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from tisim.optimize.problem.statistic import MEAN, Statistic

from tisim.errors import must


@dataclass(frozen=True)
class Objective:
    """A quantity that is to be made small, or large.

    name : heading in tables and plots; unit : of the values, "" if they have none.
    of : Result -> value in that unit, of a plain function FunctionResult -> value. Called for runs that ended
        well only; NaN and inf never win. For a Misfit it returns a dictionary of the measured quantities.
    statistic : what counts of the values from all random starts: Expectation(), Quantile(0.9), WorstOf(8) or
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
        kinds = "Expectation(), Quantile(share), WorstOf(starts) or Misfit(measured)"
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

    @property
    def statistic_of_costs(self) -> Statistic:
        """What counts of the costs of all starts."""
        return self.statistic.mirrored if self.maximise else self.statistic

    def costs(self, values: ArrayLike) -> np.ndarray:
        """Return what the statistic takes: the cost of each run, shape (starts,), or the quantities that were
        measured as they are. values : of the runs, shape (starts, quantities)."""
        columns = np.asarray(values, dtype=float).reshape(-1, len(self.quantities))
        return columns if self.statistic.quantities else self.sign * columns[:, 0]

    def cost(self, values: ArrayLike) -> float:
        """Return the cost of a design by the values of its runs, shape (starts, quantities)."""
        return self.statistic_of_costs.value(self.costs(values))

    def pseudo_costs(self, values: ArrayLike) -> np.ndarray:
        """Return a value of each run of which the cost is about the mean (Statistic.pseudo_values)."""
        return self.statistic_of_costs.pseudo_values(self.costs(values))
