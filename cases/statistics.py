"""Statements about means of random runs, for the checks of cases."""

from __future__ import annotations

from dataclasses import dataclass
from typing import ClassVar

import numpy as np

from tisim.analysis import Mean
from tisim.numerics.statistics import CONFIDENCE


@dataclass(frozen=True)
class Claim:
    """A statement about random runs; it holds if the whole confidence interval is within least..most."""

    name: str
    mean: Mean
    least: float = -np.inf
    most: float = np.inf

    @property
    def ok(self) -> bool:
        return (
            self.least <= self.mean.value - self.mean.half and self.mean.value + self.mean.half <= self.most
        )

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Return mean, bounds, an empty cell and the confidence level as text for a table."""
        bounds = [f"above {self.least:.4g}"] * bool(np.isfinite(self.least))
        bounds += [f"below {self.most:.4g}"] * bool(np.isfinite(self.most))
        return str(self.mean), ", ".join(bounds), "", f"{CONFIDENCE:.0%} confidence"


@dataclass(frozen=True)
class Shown:
    """A number that is shown with a value from elsewhere, without a verdict."""

    name: str
    value: float | Mean
    beside: str = ""
    ok: ClassVar[None] = None

    @property
    def cells(self) -> tuple[str, str, str, str]:
        """Return the number and the value shown beside it as text for a table."""
        return str(self.value) if isinstance(self.value, Mean) else f"{self.value:.4g}", self.beside, "", ""
