"""Selection of the designs that a Gaussian process is fitted to, and the number of designs that dominate
each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]

MOST_LEARNED = 500
"""Largest number of designs that a process is fitted to."""


def representative(costs: Array, most: int, exact: bool) -> NDArray[np.intp]:
    """Return the indices of at most ``most`` designs, in order, from their costs, (n, objectives).

    exact : whether the costs have no noise. If so, half of the returned designs are the best ones, and the
        rest are taken at even intervals from the others, ordered by rank. With noise all are taken at even
        intervals from the whole list: the lowest means are partly luck, and a process fitted to lucky designs
        would predict too low costs in their region.
    """
    if len(costs) <= most:
        return np.arange(len(costs))
    if not exact:
        return np.linspace(0, len(costs) - 1, most).astype(np.intp)
    order = np.lexsort([costs[:, 0], beaten_by(costs)])
    best, others = order[: most // 2], order[most // 2 :]
    drawn = others[np.linspace(0, len(others) - 1, most - len(best)).astype(int)]
    return np.sort(np.concatenate([best, drawn]))


def thinned(points: Array, costs: Array, apart: float) -> NDArray[np.intp]:
    """Return the indices, ascending, of the best of each group of designs closer than ``apart`` in all
    genes."""
    kept: list[int] = []
    for i in np.argsort(costs, kind="stable"):
        if not kept or np.abs(points[kept] - points[i]).max(axis=1).min() > apart:
            kept.append(int(i))
    return np.sort(kept)


def beaten_by(costs: Array) -> NDArray[np.int64]:
    """Return the number of others that dominate each design: no worse in any cost, and better in one."""
    if costs.shape[1] == 1:
        return np.searchsorted(np.sort(costs[:, 0]), costs[:, 0])
    no_better = np.all(costs[:, None, :] >= costs[None, :, :], axis=2)
    worse = np.any(costs[:, None, :] > costs[None, :, :], axis=2)
    return np.asarray((no_better & worse).sum(axis=1))
