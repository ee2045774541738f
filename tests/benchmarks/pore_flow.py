"""Slow flow through matrices on a grid: iterations, time and error of the permeability, by resolution.

    python tests/benchmarks/pore_flow.py [--cells 16 32 64] [--tolerance 1e-4] [--kernel]

Simple cubic lattices of spheres (A. A. Zick, G. M. Homsy, J. Fluid Mech. 115 (1982) 13), a round tube, and
random fibres, whose reference is a grid of half as many cells again as the finest. ``order`` is the order of
convergence from the row above. Times are CPU time of all threads. ``staircase`` is the error if the velocity
is 0 at all faces inside bodies and nothing else is done, for comparison. With ``--kernel``, the time of a
velocity in a kernel.
"""

import argparse
import resource
import sys
from collections.abc import Iterator
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from tests.sources.pore_flow import lattices
from tisim.sources import Cylinder, PoreFlow, SolidCylinder, sample, stokes_flow
from tisim.sources.pore_flow import no_slip

SHIFT = (0.013, 0.027, 0.041)
"""Place of lattices among the cells, which is not symmetric."""
FIBRES, RADIUS, LENGTH = 20, 0.08, 0.5
"""Random fibres in a box of side 1, which may overlap."""


def cpu() -> float:
    """CPU time of this process, s."""
    usage = resource.getrusage(resource.RUSAGE_SELF)
    return usage.ru_utime + usage.ru_stime


def random_fibres(number: int = FIBRES, seed: int = 1) -> list[SolidCylinder]:
    """Fibres at random places and in random directions."""
    draw = np.random.default_rng(seed)
    axes = draw.normal(size=(number, 3))
    axes /= np.linalg.norm(axes, axis=1)[:, None]
    places = draw.uniform(size=(number, 3))
    return [SolidCylinder(tuple(c), tuple(n), RADIUS, LENGTH) for c, n in zip(places, axes, strict=True)]


def problems() -> Iterator[tuple[str, list, float | None, dict]]:
    """Name, bodies, permeability and options of each problem, in a box of side 1."""
    for fraction in (0.125, 0.45):
        exact = lattices.sphere_permeability(
            "simple cubic", fraction, lattices.ZICK_HOMSY["simple cubic", fraction]
        )
        yield f"spheres, {fraction}", lattices.spheres("simple cubic", fraction, SHIFT), exact, {}
    yield "tube", [], np.pi / 128, {"column": "tube", "axis": 2}
    yield "random fibres", random_fibres(), None, {}


def solve(solids: list, cells: int, tolerance: float, options: dict) -> tuple[float, int, float]:
    """Permeability, iterations and CPU time (s)."""
    before = cpu()
    fall = (0.0, 0.0, -1.0) if options else (-1.0, 0.0, 0.0)
    found = stokes_flow(solids, (0, 0, 0), (1, 1, 1), (cells,) * 3, fall, 1.0, tolerance=tolerance, **options)
    return found.permeability, found.iterations, cpu() - before


def staircase(solids: list, cells: int, tolerance: float, options: dict) -> float:
    """The permeability without the friction of faces next to walls."""
    kept = no_slip._kappa
    no_slip._kappa = lambda *given: (0 * given[0], kept(*given)[1])
    try:
        return solve(solids, cells, tolerance, options)[0]
    finally:
        no_slip._kappa = kept


def table(cells: list[int], tolerance: float) -> None:
    """Print a row for each problem and resolution."""
    heads = f"{'k':>10} {'error':>9} {'order':>6} {'staircase':>9} {'it.':>5} {'CPU s':>7}"
    print(f"{'problem':16} {'cells':>5} {heads}")
    for name, solids, exact, options in problems():
        rows = [(n, *solve(solids, n, tolerance, options)) for n in cells]
        reference = exact or solve(solids, 3 * cells[-1] // 2, tolerance, options)[0]
        before = None
        for n, k, iterations, spent in rows:
            wrong = k / reference - 1
            order = np.log(abs(before[1] / wrong)) / np.log(n / before[0]) if before and wrong else np.nan
            rough = staircase(solids, n, tolerance, options) / reference - 1
            row = f"{k:10.4g} {wrong:9.1e} {order:6.2f} {rough:9.1e} {iterations:5} {spent:7.2f}"
            print(f"{name:16} {n:5} {row}", flush=True)
            before = n, wrong


def kernel(points: int = 400_000) -> None:
    """Print the time of a velocity and its gradient at a point."""
    rods = [
        Cylinder(centre=rod.centre, axis=rod.axis, radius=RADIUS, length=LENGTH) for rod in random_fibres()
    ]
    source = PoreFlow(
        low=(0, 0, 0), high=(1, 1, 1), cells=(64, 64, 64), speed=1.0, viscosity=1.0, cylinders=rods,
    )  # fmt: skip
    spent = []
    # The first call compiles; the difference between the others is free of their preparations.
    for number in (10, points, 3 * points):
        places, before = np.random.default_rng(2).uniform(size=(number, 3)), cpu()
        sample((source,), "flow_velocity", places)
        spent.append(cpu() - before)
    print(f"velocity and gradient: {1e9 * (spent[2] - spent[1]) / (2 * points):.0f} ns of CPU time a point")


def main() -> None:
    """Read the command line and print the tables."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--cells", type=int, nargs="+", default=[16, 32, 64])
    parser.add_argument("--tolerance", type=float, default=1e-4)
    parser.add_argument("--kernel", action="store_true")
    given = parser.parse_args()
    table(given.cells, given.tolerance)
    if given.kernel:
        kernel()


if __name__ == "__main__":
    main()
