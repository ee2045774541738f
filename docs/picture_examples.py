"""A hopper from an STL file, cut rods, and the fibres of a filter: the picture of docs/pictures.md.

python docs/picture_examples.py [FOLDER]      writes pictures.png; some two minutes
"""

from __future__ import annotations

import sys
from itertools import pairwise
from pathlib import Path
from tempfile import TemporaryDirectory

import matplotlib
import numpy as np
from matplotlib.axes import Axes

import tisim
from tisim.analysis import PackedBodies
from tisim.cases.packed_filter.pictures import draw_filter
from tisim.cases.packed_filter.scene import scene_for
from tisim.cases.packing.scene import of_shape, rod
from tisim.effects import Granular, Gravity, HertzMaterial, RestitutionDamping, ViscousFriction, Walls
from tisim.geometry import Plane, TriangulatedSurface
from tisim.plotting.bodies import shapes_of
from tisim.plotting.cloud import directions, gravity, panel
from tisim.plotting.colours import colouring
from tisim.plotting.look import Look
from tisim.plotting.scenery import scenery, window
from tisim.plotting.style import empty, letters
from tisim.steppers import FixedStep, Verlet

RINGS = ((0.0, 0.011), (0.06, 0.045), (0.13, 0.045))
"""Height and radius (m) of the rings of the hopper: outlet, upper end of the cone, rim."""
SECTORS = 40
DIAMETER = 5e-3
"""Largest diameter of a grain, m."""
STEP, DURATION = 2e-5, 0.36
"""s."""
CAPTURE = 145.0
"""Time at which the filter is drawn, before the field is switched off, s."""
MATERIALS = {
    "steel": tisim.Material(young=1e7, poisson=0.28, restitution=0.5, friction=0.2),
    "rubber": tisim.Material(young=1e6, poisson=0.45, restitution=0.3, friction=0.7),
}


def write_stl(path: Path) -> None:
    """Write the hopper as a text STL file, in mm."""
    angle = 2 * np.pi * np.arange(SECTORS + 1) / SECTORS
    rings = [1e3 * np.stack([r * np.cos(angle), r * np.sin(angle), 0 * angle + z], axis=1) for z, r in RINGS]
    lines = ["solid hopper"]
    for low, high in pairwise(rings):
        for k in range(SECTORS):
            for corners in ((low[k], low[k + 1], high[k + 1]), (low[k], high[k + 1], high[k])):
                points = [f"vertex {x:.6f} {y:.6f} {z:.6f}" for x, y, z in corners]
                lines += ["facet normal 0 0 0", "outer loop", *points, "endloop", "endfacet"]
    path.write_text("\n".join([*lines, "endsolid hopper", ""]))


def hopper() -> tisim.Scene:
    """Return the scene of steel and rubber grains in a hopper above a floor."""
    with TemporaryDirectory() as folder:
        write_stl(Path(folder) / "hopper.stl")
        surface = TriangulatedSurface.read(Path(folder) / "hopper.stl", scale=1e-3)
    apart = 1.1 * DIAMETER
    across = apart * np.arange(-9, 10)
    height = RINGS[1][0] + apart * np.arange(14)
    place = np.stack(np.meshgrid(across, across, height, indexing="ij"), axis=-1).reshape(-1, 3)
    place = place[np.hypot(place[:, 0], place[:, 1]) < RINGS[1][1] - 0.6 * DIAMETER]
    draw = np.random.default_rng(1)
    particles = tisim.Particles(
        position=place,
        velocity=0.02 * draw.normal(size=place.shape),
        radius=DIAMETER / 2 * draw.uniform(0.8, 1.0, len(place)),
        density=2500.0,
        material=[list(MATERIALS)[k] for k in draw.integers(0, 2, len(place))],
    )
    return tisim.Scene(
        particles=particles,
        materials=MATERIALS,
        effects=(
            Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=ViscousFriction()),
            Gravity(acceleration=(0.0, 0.0, -9.81)),
            Walls(name="hopper", surface=surface),
            Walls(name="floor", planes=[Plane(point=(0, 0, -0.05))]),
        ),
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=DURATION,
    )


def draw(axis: Axes, result: tisim.Result, look: Look) -> None:
    """Draw the end of a run."""
    scene, state = result.scene, result.state
    colours = colouring(scene, [state])
    both = [result.start, state]
    around = scenery(scene, both, result.time, result.measures, state)
    part = window(both, [around], look)
    panel(axis, state, part, around, None if colours is None else colours.of(state), shapes_of(scene), look)
    directions(axis, part, gravity(scene), camera=look.camera)
    if colours is not None:
        axis.legend(handles=colours.patches(), frameon=False, loc="upper left", fontsize=9)


def main(folder: Path) -> None:
    """Run the scenes and write the picture."""
    matplotlib.use("Agg")
    figure = empty(12.6, 4.3)
    axes = figure.subplots(1, 3)
    poured = tisim.run(hopper())
    draw(axes[0], poured, Look.of(view="-62,22", crop="0.2,0.8,0.3,0.9"))
    axes[0].set_title("grains of two materials in a hopper")
    packed = tisim.run(of_shape(rod(4.0), "small", 0, number=600, attempts=150))
    middle = PackedBodies.from_result(packed).low + np.ptp(packed.state["position"], axis=0) / 2
    look = Look.of(view="-50,25", clip=(f"y>{middle[1]:g}",))
    draw(axes[1], packed, look)
    axes[1].set_title("packed rods, cut")
    caught = tisim.run(scene_for("small", 0).replace({"duration": CAPTURE}))
    draw_filter(figure, axes[2], caught.scene, caught.state, caught.time)
    letters(axes)
    figure.savefig(folder / "pictures.png", dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
