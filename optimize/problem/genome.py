"""Named genes with units and ranges, the unit cube the search works in, and the search box inside it."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import ArrayLike, NDArray

from tisim.errors import is_number, must


@dataclass(frozen=True)
class Gene:
    """One design variable.

    name : the key of the design; unit : for people, "" if it has none.
    low, high : the full search range in that unit, low < high.
    scale : "linear", or "log" when the range spans decades (low > 0); the search is uniform on this scale.
    Raises InputError for an empty name, a range that is not finite and increasing, or an unknown scale.
    """

    name: str
    unit: str
    low: float
    high: float
    scale: Literal["linear", "log"] = "linear"

    def __post_init__(self) -> None:
        must(bool(self.name.strip()), "gene name", "a non-empty string", self.name)
        for which in ("low", "high"):
            value = getattr(self, which)
            must(is_number(value), f"{which} of gene {self.name}", "a number", value)
            # In 8 bits a range of 200 is below 0.
            object.__setattr__(self, which, float(value))
        finite = math.isfinite(self.low) and math.isfinite(self.high)
        must(
            finite and self.low < self.high,
            f"range of gene {self.name}",
            "finite with low < high",
            (self.low, self.high),
        )
        must(self.scale in ("linear", "log"), f"scale of gene {self.name}", "'linear' or 'log'", self.scale)
        must(
            self.scale == "linear" or self.low > 0, f"low of gene {self.name} on a log scale", "> 0", self.low
        )

    @property
    def label(self) -> str:
        """The name and the unit, as a table heading."""
        return f"{self.name} ({self.unit})" if self.unit else self.name

    def decode(self, u: float) -> float:
        """Return the physical value at u in 0..1; exactly low at 0 and high at 1."""
        if self.scale == "log":
            value = self.low * (self.high / self.low) ** u
        else:
            value = self.low + u * (self.high - self.low)
        return float(min(max(value, self.low), self.high))


@dataclass(frozen=True)
class Genome:
    """The genetic string: an ordered tuple of genes with different names (Z04 Eq. 7.3)."""

    genes: tuple[Gene, ...]

    def __post_init__(self) -> None:
        names = [gene.name for gene in self.genes]
        must(len(names) > 0, "genome", "one gene or more", self.genes)
        must(len(set(names)) == len(names), "gene names", "all different", names)

    def __len__(self) -> int:
        return len(self.genes)

    @property
    def names(self) -> tuple[str, ...]:
        return tuple(gene.name for gene in self.genes)

    def decode(self, u: Sequence[float] | NDArray[np.float64]) -> dict[str, float]:
        """Return the design in physical units of a point u, shape (genes,), of the unit cube. InputError
        outside it."""
        point = np.asarray(u, dtype=float)
        must(point.shape == (len(self),), "unit-cube point", f"of shape ({len(self)},)", point.shape)
        must(bool(np.all((point >= 0) & (point <= 1))), "unit-cube point", "within 0..1", point.tolist())
        return {gene.name: gene.decode(float(x)) for gene, x in zip(self.genes, point, strict=True)}


@dataclass(frozen=True, eq=False)
class SearchBox:
    """The part of the unit cube that fresh strings are drawn from: arrays low and high, shape (genes,)."""

    low: NDArray[np.float64]
    high: NDArray[np.float64]

    @classmethod
    def full(cls, genes: int) -> SearchBox:
        """Return the whole unit cube of that many genes."""
        return cls(np.zeros(genes), np.ones(genes))

    @property
    def width(self) -> NDArray[np.float64]:
        return self.high - self.low

    def sample(self, rng: np.random.Generator) -> NDArray[np.float64]:
        """Return a point drawn uniformly, shape (genes,)."""
        return np.clip(self.low + rng.random(len(self.low)) * self.width, self.low, self.high)

    def recentre(self, best: ArrayLike, factor: float) -> SearchBox:
        """Return the box shrunk by factor (0 < factor <= 1) around best, shifted to stay in the unit cube.

        The new box contains best but may reach beyond the old one, so an optimum that an earlier box cut
        off can still be found. Z04 section 8: every four generations the search domain was restricted and
        rescaled to be centred around the best parameter set. InputError outside the unit cube.
        """
        centre = np.asarray(best, dtype=float)
        must(0 < factor <= 1, "recentre factor", "within 0 < factor <= 1", factor)
        must(bool(np.all((centre >= 0) & (centre <= 1))), "best point", "within 0..1", centre.tolist())
        width = self.width * factor
        low = np.clip(centre - width / 2, 0.0, 1.0 - width)
        return SearchBox(np.minimum(low, centre), np.maximum(np.minimum(low + width, 1.0), centre))
