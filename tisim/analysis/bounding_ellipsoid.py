"""The smallest ellipsoid around particles."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from tisim.errors import Words, must

STEPS_AT_MOST = 100_000
"""Largest number of steps of the search; some hundreds are usual."""
CUTS = 200
"""Largest number of times that protruding spheres are added; about ten are usual."""
NEWCOMERS = 50
"""Largest number of spheres that are added at once."""
AFRESH = 100
"""After this number of steps the updated quantities are computed anew, to limit rounding errors."""


@dataclass(frozen=True)
class Ellipsoid:
    """The set of points r with sum_k ((r - centre) . axes_k / semi_axes_k)^2 <= 1.

    centre : m. semi_axes : the largest first (m). axes : unit vectors, as rows, shape (3, 3).
    """

    centre: np.ndarray
    semi_axes: np.ndarray
    axes: np.ndarray

    @property
    def volume(self) -> float:
        """Return the volume, m^3."""
        return float(4 / 3 * np.pi * np.prod(self.semi_axes))

    def level(self, position: np.ndarray) -> np.ndarray:
        """Return the scaled distance of points (n, 3), m, from the centre: 0 at the centre, 1 on the surface;
        shape (n,)."""
        scaled = (position - self.centre) @ self.axes.T / self.semi_axes
        return np.asarray(np.linalg.norm(scaled, axis=1))


def bounding_ellipsoid(
    position: np.ndarray, radius: np.ndarray | float = 0.0, tolerance: float = 1e-3
) -> Ellipsoid:
    """Return an ellipsoid that contains all spheres of a radius (m) at positions (n, 3), m; its volume is at
    most 1 + ``tolerance`` times the minimum.

    Khachiyan's algorithm with the away steps of Todd and Yildirim finds the smallest ellipsoid around the
    outermost points of some spheres. Weights of the points define an ellipsoid, which is never larger than
    the smallest one. The outermost points of protruding spheres are added until the ellipsoid, enlarged to
    contain all spheres, is within the tolerance.

    Source: L. G. Khachiyan, Math. Oper. Res. 21 (1996) 307; M. J. Todd, E. A. Yildirim, Discrete Appl. Math.
    155 (2007) 1731.
    """
    r = np.asarray(position, float)
    size = np.broadcast_to(np.asarray(radius, float), len(r))
    must(0 < tolerance < 1, "tolerance", "above 0 and below 1", tolerance)
    must(len(r) > 0, "particles", "at least one", len(r))
    # Centre and scale the coordinates to reduce rounding errors.
    middle = (r.min(axis=0) + r.max(axis=0)) / 2
    scale = float(np.abs(r - middle).max() + size.max()) or 1.0
    x, size = (r - middle) / scale, size / scale
    flat = int((np.linalg.svd(x - x.mean(axis=0), compute_uv=False) > 1e-9).sum())
    must(
        bool(size.max() > 0) or flat == 3,
        "particles",
        "spheres, or points not all in a plane",
        Words("points"),
    )
    points, growth = _outermost(x, size), np.inf
    weights = np.full(len(points), 1 / len(points))
    for _ in range(CUTS):
        # While spheres protrude far, a rough ellipsoid is sufficient to select them.
        weights = _weights(points, weights, max(tolerance / 4, min(0.1, (growth - 1) / 4)))
        centre, shape = _ellipsoid(points, weights)
        squares, axes = np.linalg.eigh(shape)
        levels, farthest = _farthest((x - centre) @ axes, size, squares)
        growth = levels.max()
        if growth**3 <= 1 + tolerance:
            break
        worst = np.argsort(levels)[-NEWCOMERS:]
        worst = worst[levels[worst] > 1 + (growth - 1) / 2]
        used = weights > 0
        points = np.vstack([points[used], farthest[worst] @ axes.T + centre])
        fresh = np.full(len(worst), 0.1 / len(worst))
        weights = np.concatenate([0.9 * weights[used], fresh])
    must(growth**3 <= 1 + tolerance, "tolerance", "larger, as the search ends before it", tolerance)
    semi_axes = scale * growth / np.sqrt(squares)
    return Ellipsoid(middle + scale * centre, semi_axes, np.ascontiguousarray(axes.T))


def _outermost(x: np.ndarray, size: np.ndarray) -> np.ndarray:
    """Return the outermost points of the spheres along some directions."""
    steps = np.stack(np.meshgrid(*3 * [[-1.0, 0.0, 1.0]], indexing="ij"), -1).reshape(-1, 3)
    directions = steps[np.any(steps != 0, axis=1)]
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    # Rotate the directions, so that they are not normal to faces of a lattice.
    turn = np.linalg.qr(np.array([[1.0, 0.2, 0.1], [-0.3, 1.0, 0.2], [0.1, -0.2, 1.0]]))[0]
    directions = directions @ turn.T
    chosen = np.argmax(x @ directions.T + size[:, None], axis=0)
    return x[chosen] + size[chosen, None] * directions


def _weights(points: np.ndarray, weights: np.ndarray, tolerance: float) -> np.ndarray:
    """Return weights of points, starting from given ones, such that no point lies outside sqrt(1 + tolerance)
    times their ellipsoid."""
    n, d = points.shape
    lifted, weights = np.column_stack([points, np.ones(n)]), weights.copy()
    for turn in range(STEPS_AT_MOST):
        if turn % AFRESH == 0:
            inverse = np.linalg.pinv(lifted.T @ (weights[:, None] * lifted), hermitian=True)
            far = ((lifted @ inverse) * lifted).sum(axis=1)
        # Either the outermost point gains weight, or the innermost point with a weight loses it.
        used = np.where(weights > 0, far, np.inf)
        k, deepest = int(far.argmax()), int(used.argmin())
        if far[k] <= (1 + tolerance) * (d + 1):
            break
        least = 0.0
        if far[k] / (d + 1) - 1 < 1 - far[deepest] / (d + 1):
            k = deepest
            least = -weights[k] / (1 - weights[k])
        best = (far[k] - d - 1) / ((d + 1) * (far[k] - 1)) if far[k] > 1 else -np.inf
        step = max(best, least)
        weights *= 1 - step
        weights[k] = max(weights[k] + step, 0.0) if step > least else 0.0
        # Rank-one update of the inverse (Sherman-Morrison).
        column = inverse @ lifted[k]
        part = step / (1 - step + step * far[k])
        far = (far - part * (lifted @ column) ** 2) / (1 - step)
        inverse = (inverse - part * np.outer(column, column)) / (1 - step)
    return weights


def _ellipsoid(points: np.ndarray, weights: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return centre c and matrix A of the ellipsoid (r - c) A (r - c) <= 1 defined by weights of points. Its
    volume does not exceed that of any ellipsoid around the points."""
    centre = weights @ points
    away = points - centre
    return centre, np.linalg.inv(points.shape[1] * away.T @ (weights[:, None] * away))


def _farthest(y: np.ndarray, size: np.ndarray, squares: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Return, for each sphere, the scaled distance and the position of its outermost point relative to an
    ellipsoid.

    y : centres along the axes of the ellipsoid.
    squares : squared inverse semi-axes, increasing.

    The point z satisfies A z = l (z - y) with l above all eigenvalues of A, so z = l y / (l - A), at a
    distance R from y. l is found by bisection.
    """
    # A sphere centred in a symmetry plane of the ellipsoid has two such points, and one is chosen.
    y = np.where(np.abs(y) < 1e-12, 1e-12, y)
    pull = np.linalg.norm(squares * y, axis=1)
    reach = np.maximum(size, 1e-15)
    low, high = np.zeros(len(y)), pull / reach
    for _ in range(60):
        excess = (low + high) / 2
        away = squares * y / (squares[-1] - squares + excess[:, None])
        near = np.linalg.norm(away, axis=1) <= reach
        low, high = np.where(near, low, excess), np.where(near, excess, high)
    z = y + np.where(size[:, None] > 0, away * (size / np.linalg.norm(away, axis=1))[:, None], 0.0)
    return np.sqrt((squares * z**2).sum(axis=1)), z
