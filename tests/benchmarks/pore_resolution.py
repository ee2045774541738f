"""Print the diffusion through pores by voxels across a sphere: docs/packing_measures.md, Voxels.

    python tests/benchmarks/pore_resolution.py [FRACTION ...]

A packing of 60 spheres is made by mechanical contraction, and its spheres are then reduced to the packing
fractions (0.3 and 0.48). The reference is extrapolated in the side of the voxels from 20 and 40 voxels across
a sphere. Each line has the error of D_eff of an image, and of ``packing_diffusion`` with these voxels. Some
minutes of one core.
"""

import sys
from dataclasses import replace
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim import run
from tisim.analysis import PackedBodies, packing_diffusion, packing_fraction, pore_diffusion, pore_image
from tisim.cases.packing.scene import rod, scene

FRACTIONS = (0.3, 0.48)
VOXELS = (10, 20, 40)
"""Voxels across a sphere."""


def jammed() -> PackedBodies:
    """Return 60 spheres, packed densely."""
    packed = scene(rod(1.0), number=60, start=0.2, step=2.0, attempts=300, halvings=2)
    return PackedBodies.from_result(run(packed))


def main(fractions: tuple[float, ...]) -> None:
    """Print the table of each packing fraction."""
    dense = jammed()
    for fraction in fractions:
        scale = (fraction / packing_fraction(dense)) ** (1 / 3)
        packing = replace(dense, scale=dense.scale * scale)
        sides = [float(packing.diameters().max()) / voxels for voxels in VOXELS]
        images = [pore_image(packing, side) for side in sides]
        found = [pore_diffusion(one).relative for one in images]
        ratio = len(images[-1]) / len(images[-2])
        reference = (ratio * found[-1] - found[-2]) / (ratio - 1)
        print(f"packing fraction {fraction}: D_eff/D = {reference:.4f}", flush=True)
        for voxels, side, one in zip(VOXELS[:-1], sides, found, strict=False):
            limit = packing_diffusion(packing, side).relative
            errors = f"{one / reference - 1:+.1%}, packing_diffusion {limit / reference - 1:+.1%}"
            print(f"    {voxels} voxels across a sphere: {errors}", flush=True)


if __name__ == "__main__":
    main(tuple(float(one) for one in sys.argv[1:]) or FRACTIONS)
