"""Packings of hard bodies.

Extreme shapes and sizes, a single body, bodies in one place, and bodies that are jammed from the start.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np
from scipy.spatial.transform import Rotation

from tisim import Box, Particles, Result, Scene, run
from tisim.analysis.packings.gaps import near_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.runs import missing
from tisim.cases.packing.measures import volume_of
from tisim.cases.packing.scene import hard, rod, superball
from tisim.effects import Confinement, HardRods
from tisim.geometry import SphericalContainer
from tisim.packing import random_bodies, wall_gaps
from tisim.shapes import SpherocylinderShape
from tisim.shapes.particle_shape import ParticleShape
from tisim.steppers import EnergyMinimisation, MechanicalContraction, MonteCarloGrowth
from tisim.steppers.packing.packing_stepper import PackingStepper

PERMITTED = 1.0001e-4
"""The tolerance of overlaps (D), with rounding."""
SPHERE, LONG_ROD, NEEDLE = rod(1.0), rod(2.5), rod(100.0)


def contraction(**options: Any) -> MechanicalContraction:
    """Return a contraction that needs few attempts."""
    few = {"method": "original", "volume_step": 2.0, "attempts": 300, "halvings": 2, "motion": 0.5}
    return MechanicalContraction(**{**few, **options})


def minimisation(**options: Any) -> EnergyMinimisation:
    """Return an energy minimisation of some thousand evaluations."""
    return EnergyMinimisation(**{"precision": 1e-3, "patience": 200, **options})


def growth(**options: Any) -> MonteCarloGrowth:
    """Return a growth of some ten thousand steps."""
    return MonteCarloGrowth(**{"precision": 1e-2, **options})


def packing(
    bodies: HardRods | Any,
    position: np.ndarray,
    box: Box,
    stepper: PackingStepper,
    duration: float = 1e6,
    container: SphericalContainer | None = None,
    **given: Any,
) -> Scene:
    """Return a scene that packs bodies. given : radius (m), orientation and shape of each body."""
    radius = given.pop("radius", bodies.shapes()[0].bounding_radius())
    particles = Particles(
        position=position, velocity=np.zeros_like(position), mass=1.0, radius=radius, quantities=given
    )
    walls = () if container is None else (Confinement(container=container),)
    return Scene(
        particles=particles, effects=(bodies, *walls), domain=box, duration=duration, stepper=stepper
    )


def at_random(
    shape: ParticleShape, number: int, fraction: float, stepper: PackingStepper, **more: Any
) -> Scene:
    """Return a scene of bodies at random places, without overlaps."""
    start = random_bodies(shape, number, fraction, more.get("container"))
    return packing(hard(shape), start.position, start.box, stepper, orientation=start.orientation, **more)


def cube(volume: float) -> Box:
    """Return a periodic cube of a volume, m^3."""
    side = float(np.cbrt(volume))
    return Box(low=(0, 0, 0), high=(side, side, side))


def deepest(results: Sequence[Result]) -> float:
    """Return the deepest overlap of two bodies, over D of the larger one; 0 if none overlap."""
    found = [0.0]
    for result in results:
        bodies = PackedBodies.from_result(result)
        gaps = near_gaps(bodies, 0.0)
        found.extend(-gaps.gap / bodies.diameters()[gaps.pairs].max(axis=1))
    return max(found)


def deepest_in_walls(results: Sequence[Result]) -> float:
    """Return the deepest overlap of a body with a wall, D."""
    found = []
    for result in results:
        bodies = PackedBodies.from_result(result)
        (around,) = (one for one in result.scene.effects if isinstance(one, Confinement))
        size, side = float(bodies.scale[0]), bodies.high - bodies.low
        places = bodies.position - bodies.low
        gaps = wall_gaps(bodies.shapes[0], places, bodies.orientation, around.container, side, size)
        found.append(-gaps.min() / bodies.diameters()[0])
    return max(found)


def fractions(results: Sequence[Result]) -> list[float]:
    """Return the packing fraction of each result."""
    return [packing_fraction(PackedBodies.from_result(one), volume_of(one)) for one in results]


def not_jammed(results: Sequence[Result]) -> int:
    """Return the number of results that ended before their bodies were jammed."""
    return sum(result.work["jammed"] != 1 for result in results)


def each_in(scenes: Sequence[Scene]) -> list[Result]:
    """Return the results of scenes, in their order; RunError if a run fails."""
    return sound(run(list(scenes)))


@hard_case(
    "One sphere or one rod alone in a periodic box would touch its own images; inside a sphere it has only "
    "the wall.",
    Criterion("in a periodic box: words missing from the messages", 0, 0),
    Criterion("inside a sphere: fraction of a sphere, difference from 1", 1e-3),
    Criterion("inside a sphere: fraction of a rod, difference from its closed form", 1e-3),
    Criterion("inside a sphere: deepest overlap with the wall, D", PERMITTED),
)
def one_body():
    lone = [
        at_random(shape, 1, 0.05, make(), duration=1e5)
        for make in (contraction, minimisation, growth)
        for shape in (SPHERE, LONG_ROD)
    ]
    words = sum(missing(one, "bodies longer than half the periodic box") for one in run(lone))
    around = SphericalContainer()
    within = {
        shape: each_in([
            at_random(shape, 1, 0.05, make(halvings=14) if make is contraction else make(), container=around)
            for make in (contraction, minimisation)
        ])
        for shape in (SPHERE, LONG_ROD)
    }  # fmt: skip
    results = [one for some in within.values() for one in some]
    spheres, rods = fractions(within[SPHERE]), np.array(fractions(within[LONG_ROD]))
    # A rod ends with both ends on the wall.
    expected = LONG_ROD.volume() / (np.pi / 6 * (LONG_ROD.length + LONG_ROD.diameter) ** 3)
    return (
        words, np.abs(np.array(spheres) - 1).max(), np.abs(rods - expected).max(),
        deepest_in_walls(results),
    )  # fmt: skip


@hard_case(
    "Two and three rods or superballs lie in one place, in one orientation or across each other, "
    "and spheres are concentric: no direction leads out.",
    Criterion("runs that did not end at their duration", 0, 0),
    Criterion("deepest overlap, D", PERMITTED),
    Criterion("overlaps at the start", 20, 20),
)
def coincident_bodies():
    scenes = []
    for shape in (SPHERE, LONG_ROD, superball(4.0)):
        places, turns, box = coincident(shape)
        method = "original" if shape.rod() else "revised"
        # Trial moves of superballs that overlap deeply are searched from 17 directions each.
        moves = 3000.0 if shape.rod() else 1000.0
        for stepper, duration in (
            (contraction(volume_step=1e-3, method=method), 3000.0),
            (minimisation(fraction_step=1e-5), 3000.0),
            (growth(rate=1e-9, precision=1e-9), moves),
        ):
            scenes.append(packing(hard(shape), places, box, stepper, duration, orientation=turns))
    results = each_in(scenes)
    start = [PackedBodies.from_state(one.scene.start(), one.scene) for one in results]
    overlaps = [(near_gaps(one, 0.0).gap < 0).sum() for one in start]
    early = sum(one.time != one.scene.duration for one in results)
    return early, deepest(results), min(overlaps)


def coincident(shape: ParticleShape) -> tuple[np.ndarray, np.ndarray, Box]:
    """Return places (m) and orientations of 28 bodies, and their box: eight pairs and four triples in one
    place each, of one orientation in every other place and across each other in the others."""
    groups = [2] * 8 + [3] * 4
    length = 2 * shape.bounding_radius()
    lattice = np.stack(np.meshgrid(*[np.arange(3)] * 3, indexing="ij"), axis=-1).reshape(-1, 3)
    places = np.repeat(2.5 * length * lattice[: len(groups)], groups, axis=0)
    across = Rotation.from_rotvec([[0, 0, 0], [np.pi / 2, 0, 0], [0, np.pi / 2, 0]])
    turns = [across[k] if group % 2 else across[0] for group, size in enumerate(groups) for k in range(size)]
    side = 7.5 * length
    box = Box(low=(0, 0, 0), high=(side, side, side))
    return places, np.array([one.as_quat(scalar_first=True) for one in turns]), box


@hard_case(
    "A start is jammed already: a packing of each stepper is packed again by it, and spheres at a fraction "
    "of 0.72 lie at random.",
    Criterion("packed again: rise of the packing fraction, largest", 0.01),
    Criterion("packed again: fall of the packing fraction, largest", 1e-4),
    Criterion("packed again: deepest overlap, D", PERMITTED),
    Criterion("packed again: runs that did not end jammed", 0, 0),
    Criterion("at random: words missing from the messages", 0, 0),
)
def jammed_start():
    makers = contraction, minimisation, growth
    first = each_in([at_random(SPHERE, 60, 0.2, make()) for make in makers])
    again = []
    for make, one in zip(makers, first, strict=True):
        state, box = one.state, one.scene.domain
        # Overlaps up to the tolerance are left to the steppers that permit them.
        again.append(packing(hard(SPHERE), state["position"], box, make(), radius=state["radius"]))
    second = each_in(again)
    rise = np.array(fractions(second)) - fractions(first)
    box = cube(60 * SPHERE.volume() / 0.72)
    places = np.random.default_rng(0).uniform(0, box.high[0], (60, 3))
    crowded = run([packing(hard(SPHERE), places, box, make(), 2e4) for make in makers])
    words = sum(missing(one, "overlaps of the start were not removed") for one in crowded)
    return rise.max(), -rise.min(), deepest(second), not_jammed([*first, *second]), words


@hard_case(
    "Spheres of sizes 1 and 10 start at random with deep overlaps; sizes are given by radii, and by two "
    "shapes of which either comes first.",
    Criterion("deepest overlap, D of the larger body", PERMITTED),
    Criterion("ratio of the sizes, relative change", 1e-12),
    Criterion("growth of the packing fraction, least", least=1.25),
    Criterion("contractions and minimisations that did not end jammed", 0, 0),
)
def sizes_one_to_ten():
    large, small, start = 10, 300, 0.3
    sizes = np.where(np.arange(large + small) < large, 10.0, 1.0)
    wide = SpherocylinderShape(length=0.0, diameter=10.0)
    box = cube((sizes**3).sum() * SPHERE.volume() / start)
    places = np.random.default_rng(1).uniform(0, box.high[0], (large + small, 3))
    # In D^3 of the small spheres; volumes and tolerances of a scene are in D of its first sphere or shape.
    step = 100.0
    by_radius = contraction(volume_step=step / 10**3), minimisation(precision=1e-2)
    scenes = [packing(hard(SPHERE), places, box, one, radius=sizes / 2) for one in by_radius]
    for shapes, stepper in (
        ((wide, SPHERE), contraction(volume_step=step / 10**3, tolerance=1e-5)),
        ((SPHERE, wide), contraction(volume_step=step)),
    ):
        kinds = (sizes != shapes[0].diameter).astype(int)
        scenes.append(packing(HardRods(rods=shapes), places, box, stepper, radius=sizes / 2, shape=kinds))
    # The room between small spheres limits the growth of a step, so that the end would take a million.
    short = packing(hard(SPHERE), places, box, growth(), 6000.0, radius=sizes / 2)
    *settled, growing = each_in([*scenes, short])
    change = 0.0
    for one in (*settled, growing):
        order = np.argsort(one.state["id"])
        grown = one.state["radius"][order] / sizes
        change = max(change, float(np.ptp(grown) / grown[0]))
    least = min(fractions([*settled, growing])) / start
    return deepest([*settled, growing]), change, least, not_jammed(settled)


@hard_case(
    "Superballs of exponent 20 are cubes with faces that are flat to a part in 1e6, and sharp edges.",
    Criterion("deepest overlap, D", PERMITTED),
    Criterion("growth of the packing fraction, least", least=1.3),
    Criterion("packing fraction of contraction and minimisation, least", least=0.45),
    Criterion("contractions and minimisations that did not end jammed", 0, 0),
)
def near_cubes():
    shape, start = superball(20.0), 0.2
    steppers = contraction(method="revised", attempts=200), minimisation(precision=1e-2, patience=100)
    settled = each_in([at_random(shape, 40, start, one) for one in steppers])
    # Trial moves that overlap deeply are searched from 17 directions each, so this is a short run.
    growing = each_in([at_random(shape, 40, start, growth(), duration=300.0)])
    packed = fractions(settled)
    least = min(*packed, *fractions(growing)) / start
    return deepest([*settled, *growing]), least, min(packed), not_jammed(settled)


@hard_case(
    "Rods a hundred times as long as wide: each is near to most others, and two touch at one point of a "
    "hundred.",
    Criterion("in a narrow periodic box: words missing from the messages", 0, 0),
    Criterion("inside a sphere: deepest overlap, D", PERMITTED),
    Criterion("inside a sphere: deepest overlap with the wall, D", PERMITTED),
    Criterion("inside a sphere: growth of the packing fraction", least=2.0),
    Criterion("inside a sphere: runs that did not end jammed", 0, 0),
)
def needles():
    narrow = run([
        at_random(NEEDLE, 60, 5e-4, one, duration=1e5)
        for one in (contraction(volume_step=1000.0), minimisation(), growth())
    ])  # fmt: skip
    words = sum(missing(one, "bodies longer than half the periodic box") for one in narrow)
    start, around = 5e-3, SphericalContainer()
    results = each_in([
        at_random(NEEDLE, 150, start, one, container=around)
        for one in (contraction(volume_step=1000.0, attempts=100), minimisation(precision=3e-3))
    ])  # fmt: skip
    growth_of = min(fractions(results)) / start
    return words, deepest(results), deepest_in_walls(results), growth_of, not_jammed(results)
