"""CPU time and memory of a picture of grains.

    python tests/benchmarks/rendering.py [--number 100000] [--shape spheres] [--columns 1600] [--rows 1200]

A dense bed of spheres, of rods three times as long as wide, or of superquadrics, coloured by height, is drawn
three times. Printed are the least CPU time, its part for the shade of narrow places, and the peak of the
memory that NumPy holds for the picture. ``--out`` writes the picture.
"""

from __future__ import annotations

import argparse
import sys
import time
import tracemalloc
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.spatial.transform import Rotation

from tisim.plotting.image import around, window_of
from tisim.plotting.style import TIME
from tisim.rendering.camera import USUAL_CAMERA, Raster
from tisim.rendering.render import FINER, render
from tisim.rendering.shading import occlusion
from tisim.rendering.solids import DrawnRods, DrawnSpheres, Solids
from tisim.rendering.superquadrics import DrawnSuperquadrics

JITTER = 0.08
"""Standard deviation of positions from a cubic lattice of constant 1."""
REPEATS = 3


def bed(number: int, shape: str) -> Solids:
    """A cube of solids of diameter 1 or of its volume."""
    draw = np.random.Generator(np.random.Philox(1))
    side = round(number ** (1 / 3))
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    place = lattice + JITTER * draw.normal(size=lattice.shape)
    colour = TIME(lattice[:, 2] / side)[:, :3]
    turns = Rotation.random(len(place), rng=draw).as_matrix()
    if shape == "spheres":
        return DrawnSpheres(centre=place, colour=colour, radius=np.full(len(place), 0.5))
    if shape == "rods":
        radius = (1 / 32) ** (1 / 3)
        return DrawnRods(
            centre=place, colour=colour, axis=turns[:, :, 2], half=np.full(len(place), 2 * radius),
            radius=np.full(len(place), radius),
        )  # fmt: skip
    return DrawnSuperquadrics(
        centre=place, colour=colour, turn=turns, semi_axes=np.tile([0.5, 0.4, 0.45], (len(place), 1)),
        exponents=np.full((len(place), 3), 4.0),
    )  # fmt: skip


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--number", type=int, default=100_000)
    parser.add_argument("--shape", choices=("spheres", "rods", "superquadrics"), default="spheres")
    parser.add_argument("--columns", type=int, default=1600)
    parser.add_argument("--rows", type=int, default=1200)
    parser.add_argument("--out", type=Path, help="file of the picture")
    options = parser.parse_args()
    solids = bed(options.number, options.shape)
    box = around([solids])
    low, size = np.array([box.left, box.bottom]), np.array([box.width, box.height])
    window = window_of(low, low + size, options.columns / options.rows)
    raster = Raster(USUAL_CAMERA, window, options.columns, options.rows)
    times = []
    for _ in range(REPEATS):
        begin = time.process_time()
        picture = render(raster, [solids])
        times.append(time.process_time() - begin)
    begin = time.process_time()
    occlusion(picture.depth, 0.5 * raster.scale)
    shade = time.process_time() - begin
    tracemalloc.start()
    render(raster, [solids])
    _, peak = tracemalloc.get_traced_memory()
    rays = FINER**2 * options.columns * options.rows
    print(f"{len(solids)} {options.shape}, {options.columns} x {options.rows} pixels, {rays:.3g} rays")
    print(f"{min(times):.2f} s of CPU time, {shade:.2f} s for the shade; {peak / 1e6:.0f} MB")
    if options.out is not None:
        from matplotlib import image

        white = 1 - picture.rgba[..., 3:]
        flat = np.clip(picture.rgba[..., :3] * picture.rgba[..., 3:] + white, 0, 1)
        image.imsave(options.out, flat[::-1])


if __name__ == "__main__":
    main()
