"""Permeability of random packings of fibres from the flow through them, beside laws and B16's measured value.

    python tests/benchmarks/packed_permeability.py [--out out/packed_permeability.csv]
        [--figure docs/flows_matrix.png]

Fibres are spherocylinders of B16's size, 0.4 mm by 4 mm (section 7.4.4), in a periodic cube of about 8.3 mm.
Mechanical contraction brings them together from random places. k along z is computed on grids of 64 and 96
cells a side, and extrapolated in the square of their size. Rows of the file that are there already are not
computed again. The figure shows the speed in a plane through fibres, and k beside the laws. A packing takes
one to two minutes of CPU time; 500 000 attempts do not bring fibres to 0.4.
"""

import argparse
import csv
import sys
import warnings
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.optimize import brentq

import tisim
from tisim import Box, Particles, Scene
from tisim.analysis import PackedBodies, solid_bodies
from tisim.effects import HardRods
from tisim.errors import RunWarning
from tisim.plotting import style
from tisim.shapes import SpherocylinderShape
from tisim.sources import SolidCylinder, StokesFlow, kozeny_carman, stokes_flow
from tisim.steppers import MechanicalContraction

DIAMETER, LENGTH, MEASURED = 0.4e-3, 4e-3, 2.2e-8
"""Of B16's fibres, m; their permeability, m^2."""
SIDE = 8.3e-3
"""Of the cube in the end, m; rods must be shorter than half of it."""
FRACTIONS = (0.10, 0.20, 0.30)
GRIDS = (64, 96)
START = 0.05
"""Packing fraction of the start, as in B16, section 2.2.1."""
ATTEMPTS, MOST_ATTEMPTS = 1000, 500_000
"""Attempts to remove overlaps, at first; there are 40 % more until the packing fraction is reached."""
KOZENY = 5.0
TOLERANCE = 1e-3
"""Velocity at walls over the mean velocity; the error of k is of the order of its square."""


def packing(fraction: float, seed: int) -> PackedBodies:
    """Fibres in random directions, brought together until they reach a packing fraction."""
    rod = SpherocylinderShape(length=LENGTH - DIAMETER, diameter=DIAMETER)
    number = round(fraction * SIDE**3 / rod.volume())
    side = float(np.cbrt(number * rod.volume() / START))
    draw = np.random.default_rng(seed)
    turns = draw.normal(size=(number, 4))
    turns /= np.linalg.norm(turns, axis=1)[:, None]
    particles = Particles(
        position=draw.uniform(0, side, (number, 3)),
        velocity=np.zeros((number, 3)),
        mass=np.ones(number),
        radius=np.full(number, rod.bounding_radius()),
        quantities={"orientation": turns},
    )
    attempts = ATTEMPTS
    while True:
        scene = Scene(
            particles=particles,
            effects=[HardRods(rods=(rod,))],
            domain=Box(low=(0, 0, 0), high=(side, side, side)),
            duration=float(round(attempts)),
            stepper=MechanicalContraction(volume_step=1.0, attempts=20000, halvings=4, tolerance=1e-3),
            seed=seed,
        )
        with warnings.catch_warnings():
            # A run that ends before all overlaps are removed has failed.
            warnings.simplefilter("ignore", RunWarning)
            result = tisim.run(scene)
            packed = PackedBodies.from_result(result)
        if result.work["contractions"] and packed.volumes().sum() / packed.box_volume >= fraction:
            return packed
        if attempts > MOST_ATTEMPTS:
            raise SystemExit(f"{number} fibres do not reach {fraction} in {MOST_ATTEMPTS} attempts")
        attempts *= 1.4


def flow(packed: PackedBodies, cells: int) -> StokesFlow:
    """The flow along z."""
    box = packed.low, packed.high, (cells,) * 3
    return stokes_flow(solid_bodies(packed), *box, (0, 0, -1), 1.0, tolerance=TOLERANCE)


def row(fraction: float, seed: int = 1) -> list[float]:
    """Asked and found packing fraction, and k over the square of the diameter: on both grids and
    extrapolated."""
    packed = packing(fraction, seed)
    coarse, fine = (flow(packed, cells).permeability / packed.diameters()[0] ** 2 for cells in GRIDS)
    weight = GRIDS[1] ** 2 / (GRIDS[1] ** 2 - GRIDS[0] ** 2)
    phi = float(packed.volumes().sum() / packed.box_volume)
    return [fraction, phi, coarse, fine, weight * fine + (1 - weight) * coarse]


def rows(file: Path) -> np.ndarray:
    """All rows, of which those in the file are read."""
    known = [list(map(float, line)) for line in csv.reader(file.open())] if file.exists() else []
    for fraction in FRACTIONS:
        if fraction not in [line[0] for line in known]:
            known.append(row(fraction))
            file.parent.mkdir(parents=True, exist_ok=True)
            with file.open("w", newline="") as out:
                csv.writer(out).writerows(known)
    return np.array(sorted(known))


def jackson_james(phi: np.ndarray) -> np.ndarray:
    """k over the square of the diameter (Can. J. Chem. Eng. 64 (1986) 364), for dilute random fibres."""
    return 3 * (-np.log(phi) - 0.931) / (80 * phi)


def long_fibres(phi: np.ndarray) -> np.ndarray:
    """k over the square of the diameter, by Kozeny and Carman, with the surface of the fibres' sides."""
    return np.asarray(kozeny_carman(1 - phi, 0.25, KOZENY))


def report(found: np.ndarray) -> None:
    """Print the table, and the packing fraction of B16's permeability."""
    print(
        f"{'phi':>6} {'k (cm2)':>9} {'k/D2':>8} {'64 cells':>9} {'96 cells':>9} {'J and J':>8} {'K and C':>8}"
    )
    for _, phi, coarse, fine, k in found:
        laws = f"{jackson_james(phi) / k:8.2f} {long_fibres(phi) / k:8.2f}"
        print(f"{phi:6.3f} {1e4 * k * DIAMETER**2:9.2g} {k:8.4f} {coarse / k:9.3f} {fine / k:9.3f} {laws}")
    phi, log_k = found[:, 1], np.log(found[:, 4] * DIAMETER**2)
    there = brentq(lambda x: np.interp(x, phi, log_k) - np.log(MEASURED), phi[0], phi[-1])
    print(f"B16's {1e4 * MEASURED:.2g} cm2 at {there:.3f}")


def draw(found: np.ndarray, file: Path) -> None:
    """Draw a plane of the flow, and k by packing fraction."""
    figure = style.empty(11, 4.4)
    left, right = figure.subplots(1, 2)
    slice_of_flow(figure, left)
    phi = np.linspace(0.04, 0.45, 200)
    dilute = phi < 0.25
    right.plot(
        phi[dilute], jackson_james(phi[dilute]), color="#228833", label="Jackson and James, random fibres"
    )
    right.plot(phi, long_fibres(phi), color="#cc6677", label="Kozeny and Carman, C = 5")
    right.plot(found[:, 1], found[:, 4], "o", color="#4477aa", label="flow through random fibres")
    right.axhline(MEASURED / DIAMETER**2, color="0.4", ls="--", lw=1)
    right.annotate("measured (B16)", (0.30, 1.12 * MEASURED / DIAMETER**2), color="0.3")
    right.set_yscale("log")
    right.set_xlabel("packing fraction")
    right.set_ylabel("k / D²")
    right.legend(frameon=False)
    style.plain(right)
    figure.savefig(file, dpi=150)


def slice_of_flow(figure, axes) -> None:
    """The speed and the streamlines in a plane along the flow through random fibres in a cube of side 1."""
    generator = np.random.default_rng(8)
    directions = generator.normal(size=(24, 3))
    directions /= np.linalg.norm(directions, axis=1)[:, None]
    fibres = [
        SolidCylinder(tuple(c), tuple(n), 0.05, 0.6)
        for c, n in zip(generator.uniform(size=(24, 3)), directions, strict=True)
    ]
    found = stokes_flow(fibres, (0, 0, 0), (1, 1, 1), (96, 96, 96), (0, 0, -1), 1.0)
    plane = 40
    v = found.velocity[:, :, plane, :] / found.mean_velocity[2]
    across, along = (v[0] + np.roll(v[0], -1, 0)) / 2, (v[2] + np.roll(v[2], -1, 1)) / 2
    solid = found.grid.distances(1, fibres)[:, plane, :] <= 0
    speed = np.ma.masked_where(solid, np.hypot(across, along))
    places = (np.arange(96) + 0.5) / 96
    axes.set_facecolor("0.55")
    image = axes.pcolormesh(places, places, speed.T, cmap="viridis", shading="nearest", rasterized=True)
    masked = (np.where(solid, np.nan, one).T for one in (across, along))
    axes.streamplot(places, places, *masked, color="white", density=1.1, linewidth=0.6, arrowsize=0.6)
    axes.set_aspect("equal")
    axes.set_xlim(places[0], places[-1])
    axes.set_ylim(places[0], places[-1])
    axes.set_xlabel("x / side")
    axes.set_ylabel("z / side (mean flow)")
    figure.colorbar(image, ax=axes, label="speed / superficial speed")


def main() -> None:
    """Read the command line, compute and draw."""
    parser = argparse.ArgumentParser(description=__doc__.partition("\n")[0])
    parser.add_argument("--out", type=Path, default=Path("out/packed_permeability.csv"))
    parser.add_argument("--figure", type=Path, default=Path("docs/flows_matrix.png"))
    given = parser.parse_args()
    tisim.init("cpu", precision="f64")
    found = rows(given.out)
    report(found)
    draw(found, given.figure)


if __name__ == "__main__":
    main()
