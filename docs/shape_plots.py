"""Rods that flow from a hopper and bricks that settle in a box: the pictures of docs/bodies.md.

    python docs/shape_plots.py [FOLDER]      writes shapes.png; about three minutes

The planes of a scene cannot have an outlet, so the hopper's inclined walls are rows of fixed rods.
"""

from __future__ import annotations

import sys
from pathlib import Path
from typing import Any

import matplotlib
import numpy as np
from matplotlib.axes import Axes
from scipy.spatial.transform import Rotation as Turn

import tisim
from tisim.effects import (
    Granular,
    Gravity,
    HertzMaterial,
    MindlinForce,
    RestitutionDamping,
    RigidRods,
    RigidSuperquadrics,
    Walls,
)
from tisim.geometry import Plane
from tisim.plotting.cloud import directions, gravity, panel
from tisim.plotting.look import Look
from tisim.plotting.scenery import scenery
from tisim.rendering.camera import Window
from tisim.shapes import SpherocylinderShape, SuperquadricShape
from tisim.steppers import FixedStep, Verlet

D = 2e-3
"""Diameter of the rods (m)."""
DEPTH, HALF, OUTLET, STEEPNESS = 10 * D, 9 * D, 6 * D, np.radians(60)
"""Depth, half the width and outlet of the hopper (m), and the angle of its walls to the floor."""
ROD = SpherocylinderShape(length=2 * D, diameter=D)
BAR = SpherocylinderShape(length=DEPTH, diameter=D)
BRICK = SuperquadricShape(semi_axes=(1.2 * D, 0.6 * D, 0.8 * D), exponents=(8.0, 8.0, 8.0))
EGG = SuperquadricShape(semi_axes=(0.7 * D, 0.7 * D, 1.2 * D), exponents=(2.0, 2.0, 2.0))
ALONG_Y = Turn.from_rotvec([np.pi / 2, 0, 0]).as_quat(scalar_first=True)
STEP = 1e-5
LOOK = Look.of(view="-75,12")
HOPPER, BOX = Window(-0.021, -0.028, 0.042, 0.068), Window(-0.016, -0.004, 0.032, 0.028)
"""Parts of the pictures that are shown."""
LAWS = (
    Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce()),
    Gravity(acceleration=(0.0, 0.0, -9.81)),
)
MATERIALS = {"plastic": tisim.Material(young=2e6, poisson=0.3, restitution=0.5, friction=0.4)}


def sides(half: float, depth: float) -> list[Plane]:
    """Return four upright planes around the origin."""
    across = ((-half, 0, 0), (1, 0, 0)), ((half, 0, 0), (-1, 0, 0))
    along = ((0, -depth / 2, 0), (0, 1, 0)), ((0, depth / 2, 0), (0, -1, 0))
    return [Plane(point=point, normal=normal) for point, normal in (*across, *along)]


def sites(half: float, depth: float, apart: float, layers: int, low: float) -> np.ndarray:
    """Return places between the planes, on a lattice."""
    counts = [int((2 * size - apart) / apart) + 1 for size in (half, depth / 2)]
    x, y = (apart * (np.arange(n) - (n - 1) / 2) for n in counts)
    z = low + apart * np.arange(layers)
    return np.stack(np.meshgrid(x, y, z, indexing="ij"), axis=-1).reshape(-1, 3)


def filling(layers: int = 22, duration: float = 0.7) -> tisim.Scene:
    """Return the scene of rods that fall into a closed hopper."""
    along = 0.5 * D * np.arange(int((HALF - OUTLET / 2) / np.cos(STEEPNESS) / (0.5 * D)) + 1)
    x, z = OUTLET / 2 + D / 2 + along * np.cos(STEEPNESS), along * np.sin(STEEPNESS)
    bars = np.concatenate([np.stack([sign * x, 0 * x, z], axis=-1) for sign in (-1, 1)])
    rods = sites(HALF, DEPTH, 3.1 * D, layers, z.max() + 2 * D)
    bar = np.arange(len(bars) + len(rods)) < len(bars)
    turns = Turn.random(len(bar), rng=np.random.default_rng(1)).as_quat(scalar_first=True)
    particles = tisim.Particles.of_shapes(
        (ROD, BAR),
        np.concatenate([bars, rods]),
        density=1200.0,
        shape=bar.astype(int),
        orientation=np.where(bar[:, None], ALONG_Y, turns),
        quantities={"fixed": bar},
    )
    return hopper(particles, [Plane(normal=(0, 0, 1)), *sides(HALF, DEPTH)], duration)


def flowing(filled: dict[str, np.ndarray], duration: float = 0.2) -> tisim.Scene:
    """Return the scene of a filled hopper without its floor."""
    names = ("shape", "orientation", "spin", "fixed")
    particles = tisim.Particles(
        **{name: filled[name] for name in ("position", "velocity", "radius", "mass")},
        quantities={name: filled[name] for name in names},
    )
    return hopper(particles, sides(HALF, DEPTH), duration)


def hopper(particles: tisim.Particles, planes: list[Plane], duration: float) -> tisim.Scene:
    """Return a scene of rods between planes."""
    return tisim.Scene(
        particles=particles,
        effects=(RigidRods(rods=(ROD, BAR)), *LAWS, Walls(planes=planes)),
        materials=MATERIALS,
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=duration,
    )


def box(layers: int = 9, duration: float = 0.5) -> tisim.Scene:
    """Return the scene of bricks and ellipsoids that fall into a box."""
    half = 5.5 * D
    places = sites(half, 2 * half, 3.4 * D, layers, 3 * D)
    particles = tisim.Particles.of_shapes(
        (BRICK, EGG),
        places,
        density=1200.0,
        shape=np.arange(len(places)) % 2,
        orientation=Turn.random(len(places), rng=np.random.default_rng(2)).as_quat(scalar_first=True),
    )
    planes = [Plane(normal=(0, 0, 1)), *sides(half, 2 * half)]
    shapes = RigidSuperquadrics(superquadrics=(BRICK, EGG))
    return tisim.Scene(
        particles=particles,
        effects=(shapes, *LAWS, Walls(planes=planes)),
        materials=MATERIALS,
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=duration,
    )


def draw(axes: Axes, result: tisim.Result, shapes: tuple[Any, ...], colour: np.ndarray, part: Window) -> None:
    """Draw bodies and the walls around them, with a colour each."""
    around = scenery(result.scene, [result.state], result.time)
    panel(axes, result.state, part, around, colour, shapes, LOOK)
    directions(axes, part, gravity(result.scene), camera=LOOK.camera)


def main(folder: Path) -> None:
    """Run both scenes and write the picture."""
    matplotlib.use("Agg")
    from matplotlib import pyplot

    figure = pyplot.figure(figsize=(10, 4.4), layout="constrained")
    panels = figure.subplots(1, 4, width_ratios=(1, 1, 1, 1.25))
    scene = flowing(tisim.run(filling()).state)
    simulation = tisim.Simulation(scene, worlds=1, capacity=scene.capacity())
    simulation.load([scene])
    for axes, time in zip(panels, (0.0, 0.07, 0.2), strict=False):
        simulation.run(until=time)
        (result,) = simulation.results()
        state, bar = result.state, result.state["shape"] == 1
        speed = np.clip(np.linalg.norm(state["velocity"], axis=1) / 0.5, 0, 1)
        colour = np.where(bar[:, None], 0.55, pyplot.get_cmap("viridis")(speed)[:, :3])
        draw(axes, result, (ROD, BAR), colour, HOPPER)
        below = int((state["position"][~bar, 2] < 0).sum())
        axes.set_title(f"{time:g} s: {below} of {(~bar).sum()} out")
        print(f"{time:g} s: {result.status.reason}; {below} rods out", flush=True)
    result = tisim.run(box())
    state = result.state
    tints = np.array([(0.85, 0.45, 0.3), (0.35, 0.55, 0.8)])[state["shape"].astype(int)]
    draw(panels[3], result, (BRICK, EGG), tints, BOX)
    panels[3].set_title("bricks and ellipsoids at rest")
    energy = 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1)).sum()
    energy += 0.5 * (state["angular_momentum"] * state["spin"]).sum()
    fall = (state["mass"] * 9.81 * D).sum()
    print(f"box: {result.status.reason}; kinetic energy over that of a fall by D {energy / fall:.1e}")
    weight = 9.81 * state["mass"].sum()
    print(f"floor carries {-result.measures['walls_force_z'] / weight:.3f} of the weight")
    figure.savefig(folder / "shapes.png", dpi=110)


if __name__ == "__main__":
    main(Path(sys.argv[1]) if len(sys.argv) > 1 else Path(__file__).parent)
