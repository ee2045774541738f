"""The contract of size distributions, and the sampling of sizes from them."""

from __future__ import annotations

from typing import ClassVar, Literal

import numpy as np

from tisim.components.component import Component, option

By = Literal["number", "volume", "mass"]


class SizeDistribution(Component):
    """Contract of a distribution of radii, by number, volume or mass.

    Distributions by volume and by mass are equal, because all grains of a class have the same density; they
    are the result of sieving and weighing. Classes with other densities have their own ``share`` of the mass.
    The densities by volume, q_3, and by number, q_0, are related by

        q_0(r) = q_3(r) / r^3 / integral q_3(r) / r^3 dr

    For equal volume fractions, the number of grains is therefore inversely proportional to the cube of the
    radius. Each distribution provides nodes of sufficient density. Between nodes the density is constant in
    the quantity of the distribution.

    Source: T. Allen, Particle Size Measurement (1997), chapter 2.
    """

    contract: ClassVar[bool] = True

    by: By = option(
        "quantity of the distribution: the number of grains, their volume, or their mass", examples=["volume"]
    )

    def nodes(self) -> tuple[np.ndarray, np.ndarray]:
        """Return radii (m), increasing, and the cumulative fraction, 0 to 1, of number, volume or mass up to
        each."""
        raise NotImplementedError(f"{type(self).__name__} must define nodes")

    def table(self) -> np.ndarray:
        """Return radii (m) and the cumulative fraction of the number of grains; shape (nodes, 2)."""
        radius, passing = self.nodes()
        counts = np.diff(passing) * self._counts_per_part(radius)
        return np.column_stack([radius, np.concatenate([[0.0], np.cumsum(counts)]) / counts.sum()])

    def radii(self, uniform: np.ndarray) -> np.ndarray:
        """Return the radii (m) at these cumulative fractions, 0 to 1, of the number of grains."""
        table = self.table()
        at = np.clip(np.searchsorted(table[:, 1], uniform, side="right") - 1, 0, len(table) - 2)
        (a, first), (b, last) = table[at].T, table[at + 1].T
        part = np.clip((uniform - first) / np.where(last > first, last - first, 1.0), 0.0, 1.0)
        return a + part * (b - a) if self.by == "number" else a / np.sqrt(1 - part * (1 - (a / b) ** 2))

    def mean_radius(self) -> float:
        """Return the mean radius over the number of grains, m."""
        radius, passing = self.nodes()
        a, b, part = radius[:-1], radius[1:], np.diff(passing)
        if self.by == "number":
            return float((part * (a + b) / 2).sum())
        # The means between two nodes of r/r^3 and of 1/r^3.
        return float((part / (a * b)).sum() / (part * self._counts_per_part(radius)).sum())

    def mean_cube(self) -> float:
        """Return the mean of r^3 over the number of grains, m^3."""
        radius, passing = self.nodes()
        a, b, part = radius[:-1], radius[1:], np.diff(passing)
        if self.by == "number":
            return float((part * (a + b) * (a * a + b * b) / 4).sum())
        return float(1 / (part * self._counts_per_part(radius)).sum())

    def _counts_per_part(self, radius: np.ndarray) -> np.ndarray:
        """Return the number of grains per fraction between two nodes, up to a factor: the mean there of 1, or
        of 1/r^3."""
        a, b = radius[:-1], radius[1:]
        return np.ones(len(a)) if self.by == "number" else (a + b) / (2 * a**2 * b**2)
