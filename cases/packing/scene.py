"""Random packings by mechanical contraction (B16 chapters 2 to 4).

Equal bodies start at random places in random directions in a periodic box, or inside a container, and are
contracted until overlaps remain. Lengths are in units of D, the diameter of a rod or the shortest side of the
box around another body, which is 1 m.

B16 contracts by 0.1 D^3 in each step, whatever the volume of a body. Here the first step is a given part of
the volume of a body, 0.19 for spheres in B16, so that packings of long rods need no more steps than those of
short ones.
"""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

import numpy as np

from tisim import Cloud, Particles, Scene
from tisim.cases.case import Size, size_named
from tisim.effects import Confinement, Effect, HardRods, HardSuperquadrics
from tisim.geometry.container import Container
from tisim.packing import random_bodies
from tisim.shapes import SpherocylinderShape, SuperquadricShape
from tisim.shapes.particle_shape import ParticleShape
from tisim.steppers import MechanicalContraction, Stepper

TITLE = "Random packings of spheres, rods, ellipsoids and superballs (B16)"
DIAMETER = 1.0
"""D, m."""
PUBLISHED_STEP = 0.1 / (np.pi / 6)
"""The first step of the volume in B16, in volumes of a sphere."""

SEARCH_SETTINGS: dict[str, Any] = {
    "options": {"population": 8, "first": 12}, "ensemble": {"confirm": 8},
}  # fmt: skip
"""Settings of searches of every size."""
SIZES = {
    "small": Size(
        "60 bodies from a packing fraction of 0.2, 200 attempts: a quick look, far from jammed",
        {"number": 60, "start": 0.2, "step": 2.0, "attempts": 200, "halvings": 3},
        {"generations": 8, "max_evaluations": 80, **SEARCH_SETTINGS},
    ),
    "default": Size(
        "200 bodies from a packing fraction of 0.1, 2000 attempts",
        {"number": 200, "start": 0.1, "step": 1.0, "attempts": 2000},
        {"generations": 20, "max_evaluations": 200, **SEARCH_SETTINGS},
    ),
    "paper": Size(
        "500 bodies from a packing fraction of 0.05, 100,000 attempts, for spheres as in B16 chapter 2",
        {"number": 500, "start": 0.05, "step": PUBLISHED_STEP, "attempts": 100_000},
    ),
}


def rod(aspect: float) -> SpherocylinderShape:
    """Return a spherocylinder of aspect ratio Lambda = L/D + 1 (B16 (2.1)); 1 is a sphere."""
    return SpherocylinderShape(length=(aspect - 1) * DIAMETER, diameter=DIAMETER)


def superball(exponent: float) -> SuperquadricShape:
    """Return a superball: 2 is a sphere, and large exponents approach a cube."""
    half = DIAMETER / 2
    return SuperquadricShape(semi_axes=(half, half, half), exponents=(exponent, exponent, exponent))


def spheroid(aspect: float) -> SuperquadricShape:
    """Return an ellipsoid of revolution, ``aspect`` times as long as wide."""
    half = DIAMETER / 2
    return SuperquadricShape(semi_axes=(half, half, aspect * half), exponents=(2.0, 2.0, 2.0))


def hard(shape: ParticleShape) -> Effect:
    """Return the effect of hard bodies of one shape."""
    if isinstance(shape, SuperquadricShape):
        return HardSuperquadrics(superquadrics=(shape,))
    assert isinstance(shape, SpherocylinderShape)
    return HardRods(rods=(shape,))


def scene(
    shape: ParticleShape,
    number: int,
    start: float,
    step: float,
    attempts: int,
    halvings: int = 4,
    container: Container | None = None,
    sizes: tuple[float, float] | None = None,
    seed: int = 0,
    **options: Any,
) -> Scene:
    """Return a scene that packs bodies by mechanical contraction.

    start, container, sizes : as of ``packed_by``. step : first step of the volume, in volumes of a body.
        attempts, halvings, options : of ``MechanicalContraction``.
    """
    unit = 2 * float(shape.half_extents().min())
    volume_step = step * shape.volume() / unit**3
    stepper = MechanicalContraction(volume_step=volume_step, attempts=attempts, halvings=halvings, **options)
    return packed_by(stepper, shape, number, start, container, sizes, seed)


def packed_by(
    stepper: Stepper,
    shape: ParticleShape,
    number: int,
    start: float,
    container: Container | None = None,
    sizes: tuple[float, float] | None = None,
    seed: int = 0,
) -> Scene:
    """Return a scene in which a packing stepper packs bodies.

    start : packing fraction of the start. container : None for a periodic cube. sizes : for a mixture of two
        sizes, their ratio, and the share of the volume that the larger bodies have.
    """
    placed = random_bodies(shape, number, start, container, seed)
    bodies = placed.particles()
    if sizes is not None:
        bodies["radius"] = placed.radius * mixed(number, *sizes, seed)
    walls = () if container is None else (Confinement(container=container),)
    return Scene(
        name="packing",
        particles=Particles(**bodies),
        effects=(hard(shape), *walls),
        domain=placed.box,
        duration=1e9,
        stepper=stepper,
        seed=seed,
    )


def mixed(number: int, ratio: float, share: float, seed: int) -> np.ndarray:
    """Return the sizes of bodies of two kinds in random order, with a total volume of ``number`` bodies of
    size 1."""
    large = share / ratio**3
    count = round(number * large / (large + 1 - share))
    size = np.where(np.arange(number) < count, ratio, 1.0)
    size *= np.cbrt(number / (size**3).sum())
    return np.random.default_rng([seed, 0x312E5]).permutation(size)


def scene_for(size: str, seed: int) -> Scene:
    """Return a packing of spheres, the start of which follows from the seed of the scene, so that
    ``tisim cost`` can draw many."""
    packed = of_shape(rod(1.0), size, seed)
    number = len(packed.particles.masses(seed))
    cloud = Cloud(number=number, radius=DIAMETER / 2, density=1.0)
    return packed.model_copy(update={"particles": cloud})


def of_shape(shape: ParticleShape, size: str, seed: int, **options: Any) -> Scene:
    """Return a packing of bodies of one shape, from the random start of a seed."""
    return scene(shape, seed=seed, **{**size_named(size, SIZES).scene, **options})


PACKING_SCENES: Mapping[str, Callable[[str, int], Scene]] = {
    "spheres": scene_for,
    "rods": partial(of_shape, rod(1.5)),
    "long-rods": partial(of_shape, rod(5.0), number=500),
    "ellipsoids": partial(of_shape, spheroid(1.5)),
    "superballs": partial(of_shape, superball(3.0)),
    "mixture": partial(of_shape, rod(1.0), number=300, sizes=(3.0, 0.7)),
}
"""Scenes of ``tisim run packing --variant``."""
