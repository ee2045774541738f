"""The slow flow of a viscous fluid between bodies at rest, driven by a pressure gradient."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from tisim.backend.runtime import cores
from tisim.errors import InputError, RunError, Words, is_number, is_whole, must
from tisim.sources.pore_flow.connectivity import through_paths
from tisim.sources.pore_flow.no_slip import NoSlip
from tisim.sources.pore_flow.solids import Column, Grid, SolidBody
from tisim.sources.pore_flow.stokes_operator import StokesOperator

WALL_TOLERANCE = 1e-4
"""Velocity at walls over the mean velocity at which iterations end."""
TOLERANCES = (1e-7, 0.1)
"""Range of the tolerance; rounding ends the convergence near 1e-8."""
ITERATION_LIMIT = 5000
FEWEST_CELLS = 2
"""Cells that the thinnest body must span."""
MOST_PERIODS = 10
"""Sides of the box along a periodic axis that a body may span."""


@dataclass(frozen=True)
class StokesFlow:
    """A slow flow through a periodic box with bodies, or with walls.

    grid : of faces and cells, whose ``shape`` includes cells inside the walls.
    velocity : components on the faces with their normals along x, y and z (m/s), shape (3, nx, ny, nz);
        component a of a cell is on its face nearer to the lower corner along axis a.
    pressure : in the cells, without its mean gradient (Pa), shape (nx, ny, nz); without meaning in bodies.
    mean_velocity : the superficial velocity, the mean over the box with the bodies (m/s), shape (3,).
    pressure_gradient : the mean gradient that drives the fluid (Pa/m), shape (3,).
    viscosity : Pa s. porosity : the part of the box that is fluid.
    solid : solid faces, shape (3, nx, ny, nz). friction : eta kappa (Pa s/m^2) of fluid faces next to walls,
        of the same shape. iterations : of the solution. residual : the velocity at walls over the mean
        velocity, as root mean square.
    """

    grid: Grid
    velocity: np.ndarray
    pressure: np.ndarray
    mean_velocity: np.ndarray
    pressure_gradient: np.ndarray
    viscosity: float
    porosity: float
    solid: np.ndarray
    friction: np.ndarray
    iterations: int
    residual: float

    @property
    def permeability(self) -> float:
        """Return k (m^2) in Darcy's law along the pressure gradient: k = -eta U . grad p / |grad p|^2."""
        fall = -self.pressure_gradient
        return float(self.viscosity * self.mean_velocity @ fall / (fall @ fall))

    def divergence(self) -> np.ndarray:
        """Return the divergence of the velocity in the cells (1/s), shape (nx, ny, nz)."""
        return self._operator().divergence(self.velocity)

    def dissipation(self) -> float:
        """Return the energy that viscosity dissipates in the box per time (W): the sum of squared differences
        of neighbouring velocities, and the friction at walls."""
        shear = -self.viscosity * (self.velocity * self._operator().second_difference(self.velocity)).sum()
        return float((shear + (self.friction * self.velocity**2).sum()) * np.prod(self.grid.spacing))

    def work(self) -> float:
        """Return the work of the pressure gradient per time (W), which viscosity dissipates."""
        volume = np.prod(self.grid.spacing) * np.prod(self.grid.cells)
        return float(-self.pressure_gradient @ self.mean_velocity * volume)

    def _operator(self) -> StokesOperator:
        return StokesOperator(self.grid.shape, self.grid.spacing)


def stokes_flow(
    solids: Sequence[SolidBody],
    low: ArrayLike,
    high: ArrayLike,
    cells: Sequence[int],
    pressure_gradient: Sequence[float],
    viscosity: float,
    column: Column = "none",
    axis: int = 2,
    tolerance: float = WALL_TOLERANCE,
    progress: Callable[[float], None] | None = None,
) -> StokesFlow:
    """Return the slow flow through a matrix of bodies at rest, driven by a mean pressure gradient.

        eta Lap v - grad p = 0,    div v = 0,    v = 0 on bodies and walls

    Inertia is neglected; the Reynolds number of the pores must be far below 1. Bodies and fluid continue
    periodically across the faces of the box, except across walls. Bodies may overlap. Layers without bodies
    before and after a matrix make it an open filter; its pressure drop is then the mean gradient times the
    side of the box.

    solids : bodies, such as ``SolidCylinder`` and ``SolidSphere``. low, high : corners of the box (m).
    cells : of the grid along x, y and z; the thinnest body must span at least two. One cell along an axis
        makes the flow two-dimensional, for bodies that do not vary along it.
    pressure_gradient : mean gradient (Pa/m); the fluid flows in the opposite direction. viscosity : Pa s.
    column : walls at the faces of the box around ``axis`` (0, 1 or 2): "duct", or "tube" for a round tube
        that touches them. The pressure gradient is then along this axis.
    tolerance : velocity at walls over the mean velocity, as root mean square, at which iterations end. The
        relative error of the permeability by it is less than 100 times its square.
    progress : called with the finished part, 0..1.

    The equations of a staggered grid are solved by conjugate gradients for the forces at walls; see
    ``NoSlip`` and ``StokesOperator``. Mean velocity and permeability are second-order accurate in the
    spacing.

    InputError for values without meaning, and if the pores do not lead through the box along the pressure
    gradient. RunError if iterations do not converge.
    """
    grid = _grid(low, high, cells, column, axis)
    drive = -np.asarray(pressure_gradient, float)
    given = tuple(float(g) for g in pressure_gradient)
    must(is_number(viscosity) and viscosity > 0, "viscosity", "above 0 Pa s", viscosity)
    least, most = TOLERANCES
    must(least <= tolerance <= most, "tolerance", f"from {least:g} to {most:g}", tolerance)
    strength = float(np.linalg.norm(drive))
    must(0 < strength < math.inf, "pressure_gradient", "finite and not 0", given)
    across = np.delete(drive, axis) if column != "none" else np.zeros(2)
    must(not across.any(), "pressure_gradient", f"along the {column}, axis {axis}", given)
    # In units in which the longest side of the grid, the viscosity and the pressure gradient are 1.
    unit = float((grid.spacing * grid.shape).max())
    _check_resolved(solids, grid)
    distances = [grid.distances(a, solids) / unit for a in range(3)]
    walls = NoSlip.at(distances, grid.spacing / unit)
    _check_open(walls, grid, drive)
    operator = StokesOperator(grid.shape, grid.spacing / unit, cores())
    force, mean, iterations, residual = _forces(walls, operator, drive / strength, tolerance, progress)
    moving = operator.velocity(force)
    # The mean along the drive follows from the dissipation, whose error is quadratic in the residual.
    dissipated = (force * moving).sum() + (force.reshape(-1)[walls.index] ** 2 * walls.compliance).sum()
    mean += drive / strength * (dissipated / np.prod(grid.shape) - mean @ drive / strength)
    velocity = moving + mean[:, None, None, None]
    speed = strength * unit**2 / viscosity
    part = np.prod(grid.shape) / np.prod(grid.cells)
    friction = np.zeros(walls.solid.size)
    felt = walls.compliance > 0
    friction[walls.index[felt]] = viscosity / (walls.compliance[felt] * unit**2)
    fluid = np.mean([np.clip(0.5 + d / (grid.spacing.mean() / unit), 0, 1).mean() for d in distances])
    return StokesFlow(
        grid,
        velocity * speed,
        operator.pressure(force) * strength * unit,
        mean * speed * part,
        -drive,
        viscosity,
        float(min(fluid * part, 1.0)),
        walls.solid,
        friction.reshape(walls.solid.shape),
        iterations,
        residual,
    )


def permeability_tensor(
    solids: Sequence[SolidBody],
    low: ArrayLike,
    high: ArrayLike,
    cells: Sequence[int],
    tolerance: float = WALL_TOLERANCE,
) -> np.ndarray:
    """Return the permeability K of a periodic matrix in U = -K/eta grad p, m^2, shape (3, 3).

    It is symmetric and, if pores lead through the box along all axes, positive definite. U is the superficial
    velocity. See ``stokes_flow`` for the parameters and errors.
    """
    flows = [
        stokes_flow(solids, low, high, cells, g, 1.0, tolerance=tolerance) for g in (-np.eye(3)).tolist()
    ]
    return np.stack([flow.mean_velocity for flow in flows], axis=1)


def _grid(low: ArrayLike, high: ArrayLike, cells: Sequence[int], column: Column, axis: int) -> Grid:
    lower, upper = np.asarray(low, float), np.asarray(high, float)
    must(lower.shape == (3,) and np.isfinite(lower).all(), "low", "three finite numbers of m", lower.tolist())
    ordered = upper.shape == (3,) and np.isfinite(upper).all() and (lower < upper).all()
    must(bool(ordered), "high", "above low in every component", upper.tolist())
    whole = len(cells) == 3 and all(is_whole(n, 1) for n in cells)
    must(whole, "cells", "three whole numbers, at least 1", tuple(cells))
    must(column in ("none", "duct", "tube"), "column", "'none', 'duct' or 'tube'", column)
    must(axis in (0, 1, 2), "axis", "0, 1 or 2", axis)
    x, y, z = (int(n) for n in cells)
    grid = Grid(lower, (upper - lower) / (x, y, z), (x, y, z), column, axis)
    if column == "tube":
        first, second = (upper - lower)[np.flatnonzero(grid.walled)]
        rule = "as far from low along both axes across the tube"
        must(math.isclose(first, second, rel_tol=1e-9), "high", rule, upper.tolist())
    return grid


def _check_resolved(solids: Sequence[SolidBody], grid: Grid) -> None:
    """Raise InputError unless bodies or walls resist the fluid, and bodies are wider than cells and shorter
    than some periods of the box."""
    must(bool(solids) or grid.column != "none", "solids", "bodies, or a column with walls", Words("none"))
    used = np.array(grid.cells) > 1
    spacing = float(grid.spacing[used].min(initial=np.inf))
    thinnest = min((one.width for one in solids), default=math.inf)
    rule = f"fine enough for {FEWEST_CELLS} of them across the thinnest body, of {thinnest:g} m"
    wide = thinnest >= FEWEST_CELLS * spacing * (1 - 1e-9) or not solids
    must(wide, "cells", rule, grid.cells)
    if not solids:
        return
    # Bodies that are shorter than a cell along one axis may lie between the faces of the grid.
    low, high = np.swapaxes([one.extent() for one in solids], 0, 1)
    for b in np.flatnonzero(used):
        shortest = float((high - low)[:, b].min())
        rule = f"fine enough for {FEWEST_CELLS} of them along axis {b} across a body of {shortest:g} m"
        must(shortest >= FEWEST_CELLS * grid.spacing[b] * (1 - 1e-9), "cells", rule, grid.cells)
    # The images of longer bodies overlap so often that they would hardly leave a pore.
    for b in np.flatnonzero(~np.array(grid.walled)):
        longest, most = float((high - low)[:, b].max()), MOST_PERIODS * grid.cells[b] * float(grid.spacing[b])
        rule = f"at most {most:g} m long along axis {b}, {MOST_PERIODS} periods of the box"
        must(longest <= most, "solids", rule, longest)


def _check_open(walls: NoSlip, grid: Grid, drive: np.ndarray) -> None:
    """Raise InputError unless the fluid can flow along the driving force, and something resists it there."""
    missed = bool(((np.array(walls.counts) == 0) & (drive != 0)).any())
    must(not missed, "cells", "such that faces of the grid lie in the bodies", grid.cells)
    paths = through_paths(walls.solid) * (grid.spacing * grid.shape)
    along = np.abs(paths @ drive)
    if not (along > 1e-9 * np.linalg.norm(paths, axis=1) * np.linalg.norm(drive)).any():
        cells = " x ".join(map(str, grid.cells))
        rule = f"open along the pressure gradient at {cells} cells, so that a fluid can flow through"
        raise InputError(f"pores must be {rule}; received bodies and walls that block it")


def _forces(
    walls: NoSlip,
    operator: StokesOperator,
    drive: np.ndarray,
    tolerance: float,
    progress: Callable[[float], None] | None,
) -> tuple[np.ndarray, np.ndarray, int, float]:
    """Return the force densities on faces, shape (3, nx, ny, nz), the mean velocity, the number of iterations
    and the residual, for a unit viscosity.

    The forces at walls solve (G + 1/kappa) f = -U with a given sum of f, which balances the driving force. G
    is ``StokesOperator`` between these faces. The matrix is symmetric and positive semidefinite, and the
    mean velocity U is the multiplier of the given sum. Conjugate gradients are preconditioned by the
    diagonal; all their vectors have sums of 0.
    """
    parts = np.split(np.arange(len(walls.index)), np.cumsum(walls.counts)[:-1])
    own = np.repeat(operator.own, walls.counts)
    weight = 1 / (own + walls.compliance)
    totals = [float(weight[part].sum()) for part in parts]
    cells = float(np.prod(operator.shape))

    def spread(f: np.ndarray) -> np.ndarray:
        force = np.zeros((3, *operator.shape))
        force.reshape(-1)[walls.index] = f
        return force

    def apply(f: np.ndarray) -> np.ndarray:
        return np.asarray(operator.velocity(spread(f)).reshape(-1)[walls.index] + walls.compliance * f)

    def means(r: np.ndarray) -> np.ndarray:
        pairs = zip(parts, totals, strict=True)
        return np.array([(weight[p] * r[p]).sum() / total if total else 0.0 for p, total in pairs])

    def precondition(r: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        mean = means(r)
        return weight * (r - np.repeat(mean, walls.counts)), mean

    # Inside bodies and walls nothing drives the fluid that replaces them; its surface balances the rest.
    inside = -drive[:, None, None, None] * walls.inside()
    left = -drive * cells - inside.sum(axis=(1, 2, 3))
    balance = [force / total if total else 0.0 for force, total in zip(left, totals, strict=True)]
    f = weight * np.repeat(balance, walls.counts)
    r = -apply(f) - operator.velocity(inside).reshape(-1)[walls.index]
    z, mean = precondition(r)
    p, product, first = z.copy(), (r * z).sum(), 0.0
    for iteration in range(1, ITERATION_LIMIT + 1):
        response = apply(p)
        # A first guess without an error is a solution.
        step = product / (p * response).sum() if product else 0.0
        f += step * p
        r -= step * response
        z, mean = precondition(r)
        residual = math.sqrt(((own * z) ** 2).mean()) / math.hypot(*mean)
        if progress:
            first = first or max(residual, 2 * tolerance)
            gained = math.log(first / max(residual, tolerance)) / math.log(first / tolerance)
            progress(max(0.0, gained))
        if residual <= tolerance:
            return spread(f) + inside, mean, iteration, residual
        before, product = product, (r * z).sum()
        p = z + (product / before) * p
    raise RunError(
        f"the flow through the matrix has not converged in {ITERATION_LIMIT} iterations: {residual:g}"
    )
