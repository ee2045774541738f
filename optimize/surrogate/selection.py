"""The designs of an archive from which a Gaussian process is made, and how many others dominate each."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

Array = NDArray[np.float64]


def representative(costs: Array, most: int, exact: bool) -> NDArray[np.intp]:
    """Return the indices of at most ``most`` designs, in their order, from their costs, (n, objectives).

    exact : whether the costs have no noise. Then half of those returned are the best, where the search is,
    and the rest is drawn evenly. With noise all are drawn evenly: those of the lowest means were lucky, and a
    process of lucky designs alone takes the whole region around them for as good.
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
    """Return the indices of designs that are farther apart than this in one gene or more, ascending; of those
    that are closer together the best."""
    kept: list[int] = []
    for i in np.argsort(costs, kind="stable"):
        if not kept or np.abs(points[kept] - points[i]).max(axis=1).min() > apart:
            kept.append(int(i))
    return np.sort(kept)


def beaten_by(costs: Array) -> NDArray[np.int64]:
    """Return by how many of the others each design is dominated: no better in any cost, and worse in one."""
    if costs.shape[1] == 1:
        return np.searchsorted(np.sort(costs[:, 0]), costs[:, 0])
    no_better = np.all(costs[:, None, :] >= costs[None, :, :], axis=2)
    worse = np.any(costs[:, None, :] > costs[None, :, :], axis=2)
    return np.asarray((no_better & worse).sum(axis=1))
