"""Objectives: quantities of a run that are minimised or maximised."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tisim.errors import must
from tisim.optimize.problem.statistic import MEAN, Statistic


@dataclass(frozen=True)
class Objective:
    """A quantity that is minimised, or maximised.

    name : heading in tables and plots; unit : of the values, "" if there is none.
    of : Result -> value in that unit; for a plain function FunctionResult -> value. It is called only for
        runs that ended well; NaN and inf never win. For a Misfit it returns a dictionary of the measured
        quantities.
    statistic : how the values from all random starts are combined: Expectation(), Quantile(0.9), WorstOf(8)
        or Misfit({"angle": (27.9, 3.0)}).
    Raises InputError for an empty name, an invalid statistic, and a misfit that is maximised.
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
        """Cost = sign * value. The search minimises costs; users see only values."""
        return -1.0 if self.maximise else 1.0

    @property
    def label(self) -> str:
        """The name, the unit and the statistic, as a heading."""
        heading = f"{self.name} ({self.unit})" if self.unit else self.name
        return f"{heading}, {self.statistic.label}" if self.statistic.label else heading

    @property
    def quantities(self) -> tuple[str, ...]:
        """The names of the values that are stored for each run: its own name, or the measured quantities."""
        return self.statistic.quantities or (self.name,)

    @property
    def statistic_of_costs(self) -> Statistic:
        """The statistic that is applied to the costs of all starts."""
        return self.statistic.mirrored if self.maximise else self.statistic

    def costs(self, values: ArrayLike) -> np.ndarray:
        """Return the input of the statistic: the cost of each run, shape (starts,), or the measured
        quantities unchanged.

        values : of the runs, shape (starts, quantities).
        """
        columns = np.asarray(values, dtype=float).reshape(-1, len(self.quantities))
        return columns if self.statistic.quantities else self.sign * columns[:, 0]

    def cost(self, values: ArrayLike) -> float:
        """Return the cost of a design from the values of its runs, shape (starts, quantities)."""
        return self.statistic_of_costs.value(self.costs(values))

    def pseudo_costs(self, values: ArrayLike) -> np.ndarray:
        """Return a value for each run such that their mean approximates the cost
        (Statistic.pseudo_values)."""
        return self.statistic_of_costs.pseudo_values(self.costs(values))
