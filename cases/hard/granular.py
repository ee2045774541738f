"""Crowded granular packings.

Contacts that last: columns at rest, friction at its limit, and a thousand spheres that all overlap.
"""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike
from scipy.optimize import brentq

from tisim import Material, Scene
from tisim.cases.common.two_spheres import hertz_force
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.runs import ends, given, kinetic, looks, momentum, verlet
from tisim.cases.hard.singular import overlap_energy, overlapping
from tisim.effects import Granular, Gravity, HertzMaterial, MindlinForce, RestitutionDamping, Walls
from tisim.geometry import Plane

Substance = Mapping[str, float]
"""Properties of a material, SI units."""
GROUND = ((0.0, 0.0, 0.0), (0.0, 0.0, 1.0))
"""Point and normal of the plane z = 0."""
GRAIN_WEIGHT = 10.0
"""Gravity (m/s^2), and the weight of a grain of 1 kg, N."""


@dataclass(frozen=True)
class GrainLaw:
    """A granular law, with everything that a hard case must know of it.

    scene : makes a scene from positions, velocities and spins; a grain has 1 kg and a radius of 1 m unless
    given.
    push : force (N) at an overlap (m) for an effective radius (m) and a material. stored : energy (J) there.
    elastic : a material without losses. lossy : two materials that lose energy in every way of the law.
    """

    scene: Callable[..., Scene]
    push: Callable[[float, float, Substance], float]
    stored: Callable[[float, float, Substance], float]
    elastic: Substance
    lossy: tuple[Substance, Substance]

    def unbonded(self) -> dict[str, float]:
        """Return the first of the lossy materials without adhesion, rolling and twisting."""
        dry = {**self.lossy[0], "cohesion_energy_density": 0.0, "surface_energy": 0.0}
        return {key: dry[key] for key in self.elastic}


ELASTIC_GRAIN = {"young": 1e6, "poisson": 0.3, "restitution": 1.0, "friction": 0.0}
"""A material without losses for Hertz and Mindlin."""


def hertz_mindlin(
    position: ArrayLike, velocity: ArrayLike, spin: ArrayLike | None = None, **more: Any
) -> Scene:
    """Return grains under Hertz, Mindlin and damping by restitution, at planes and under gravity.

    more : radius and mass; ``first`` and ``second``, properties of the two materials that differ from
    ELASTIC_GRAIN; ``material``, the index of each grain; ``planes``, point and normal of each; ``gravity``;
    ``dt`` (s) and ``steps``.
    """
    position = np.asarray(position, float)
    planes = more.get("planes", [((0.0, 0.0, -1e6), GROUND[1])])
    materials = {
        name: Material(**{**ELASTIC_GRAIN, **more.get(name, {})}) for name in ("first", "second")
    }  # fmt: skip
    particles = given(
        position, velocity, more.get("radius", 1.0), more.get("mass", 1.0),
        spin=np.zeros_like(position) if spin is None else spin,
    )  # fmt: skip
    return Scene(
        particles=particles.model_copy(update={"material": more["material"]} if "material" in more else {}),
        materials=materials,
        effects=(
            Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce()),
            Walls(planes=[Plane(point=point, normal=normal) for point, normal in planes]),
            Gravity(acceleration=more.get("gravity", (0.0, 0.0, 0.0))),
        ),
        stepper=verlet(more["dt"]),
        duration=more["dt"] * more["steps"],
    )


def _modulus(material: Substance) -> float:
    return material["young"] / (2 * (1 - material["poisson"] ** 2))


HERTZ_MINDLIN_LAW = GrainLaw(
    hertz_mindlin,
    lambda overlap, radius, material: float(hertz_force(overlap, radius, _modulus(material))),
    lambda overlap, radius, material: float(
        8 / 15 * _modulus(material) * radius**0.5 * max(overlap, 0.0) ** 2.5
    ),
    ELASTIC_GRAIN,
    (
        {"young": 1e5, "poisson": 0.25, "restitution": 0.6, "friction": 0.4},
        {"young": 1e6, "poisson": 0.4, "restitution": 0.9, "friction": 0.1},
    ),
)


@hard_case(
    "A thousand spheres at random places in a box for a tenth of them: each overlaps a dozen others.",
    Criterion("energy, kinetic and stored, relative change", 1e-4),
    Criterion("momentum over the sum of its magnitudes", 1e-12),
    Criterion("stored energy left", 0.9),
    Criterion("overlaps at the start", least=5001),
)
def thousand_overlapping_spheres():
    draw, n = np.random.Generator(np.random.Philox(20040101)), 1000
    place, radius = draw.uniform(0, 1, (n, 3)), draw.uniform(0.05, 0.09, n)
    (state,) = ends([overlapping(place, radius, np.full(n, 1e-2), 2e-5, 400)])

    def potential(position):
        gap = position[None] - position[:, None]
        d = np.linalg.norm(gap - np.round(gap), axis=2)
        near = np.argwhere(np.triu(d < radius[:, None] + radius, 1))
        return sum(overlap_energy(d[i, j], radius[i], radius[j]) for i, j in near), len(near)

    (before, contacts), (after, _) = potential(place), potential(state["position"])
    size = (state["mass"] * np.linalg.norm(state["velocity"], axis=1)).sum()
    return (
        abs((kinetic(state) + after) / before - 1), np.abs(momentum(state)).max() / size, after / before,
        contacts,
    )  # fmt: skip


def balanced(law, material, n):
    """Return positions of n grains of 1 kg at rest on each other and on the floor, from the law alone."""
    place = np.zeros((n, 3))
    for k in range(n):
        load, radius = GRAIN_WEIGHT * (n - k), 0.5 if k else 1.0
        overlap = brentq(lambda d, f=load, r=radius: law.push(d, r, material) - f, 0, 0.9, xtol=1e-16)
        place[k, 2] = place[k - 1, 2] + 2 - overlap if k else 1 - overlap
    return place


def column_energy(law, material, state):
    """Return the kinetic, potential and contact energy of a column, J."""
    z = state["position"][:, 2]
    contacts = [law.stored(1 - z[0], 1.0, material)]
    contacts += [law.stored(2 - d, 0.5, material) for d in np.diff(z)]
    return kinetic(state) + GRAIN_WEIGHT * z.sum() + sum(contacts)


@hard_case(
    "Ten grains on each other for 200 periods of a contact: no creep, no heat, with and without losses.",
    Criterion("in balance: largest displacement, m of 1", 1e-11),
    Criterion("in balance: kinetic energy, J", 1e-18),
    Criterion("off balance, elastic: energy, change over the energy given", 3e-3),
    Criterion("off balance, with losses: largest rise of the energy, over the energy given", 1e-6),
    Criterion("off balance, with losses: energy left, over the energy given", 0.02),
)
def column_at_rest(law: GrainLaw = HERTZ_MINDLIN_LAW, strong: Substance = {"restitution": 0.1}):  # noqa: B006
    """law : the law of contact. strong : properties of its material that bring a column to rest soon."""
    materials = law.elastic, {**law.elastic, **law.lossy[0], **strong}
    free, damped, start = columns(law, materials)
    moved = max(
        np.abs(state["position"] - states[0]["position"]).max() for states in start for state in states
    )
    heat = max(kinetic(state) for states in start for state in states)
    rise = np.diff(damped).max() / damped[0]
    return moved, heat, np.abs(free / free[0] - 1).max(), rise, damped[-1] / damped[0]


def columns(law, materials):
    """Return energies above rest (J) of an elastic and of a lossy column that start off balance, at 41 times,
    and the states of two columns that start in balance."""
    scenes = []
    for lift in (0.0, 1e-4):
        for material in materials:
            place = balanced(law, material, 10)
            place[5:, 2] += lift
            scenes.append(
                law.scene(
                    place, np.zeros((10, 3)), first=material, planes=[GROUND], gravity=(0, 0, -GRAIN_WEIGHT),
                    dt=1e-4, steps=40_000,
                )
            )  # fmt: skip
    series = looks(scenes, 40)
    energies = [
        np.array([column_energy(law, material, state) for state in moving])
        - column_energy(law, material, still[0])
        for material, still, moving in zip(materials, series[:2], series[2:], strict=True)
    ]
    return *energies, series[:2]


SQUEEZE = 0.02
"""Overlap (m) of a grain with each of the two planes that enclose it."""


@hard_case(
    "A grain between two planes is pulled along them by 0.99 and by 1.01 of the largest friction.",
    Criterion("below: speed over the limit, m/s a N", 1e-9),
    Criterion("below: way in the last eighth of the run, m", 1e-9),
    Criterion("above: acceleration by the excess force, relative error", 1e-6),
    Criterion("spin, rad/s", 1e-9),
)
def friction_at_its_limit(
    law: GrainLaw = HERTZ_MINDLIN_LAW,
    grip: Substance = {"friction": 0.5, "restitution": 0.0},  # noqa: B006
    adhesion=0.0,
    drag=0.0,
):
    """grip : properties with enough damping. adhesion : its force on the two planes, N. drag : coefficient of
    a friction that is a dashpot, N s/m; the speed below the limit is then relative to its own."""
    material = {**law.elastic, **grip}
    limit = 2 * grip["friction"] * (law.push(SQUEEZE, 1.0, material) + adhesion)
    planes = [GROUND, ((0.0, 0.0, 2 - 2 * SQUEEZE), (0.0, 0.0, -1.0))]
    scenes = [
        law.scene(
            [[0, 0, 1 - SQUEEZE]], np.zeros((1, 3)), planes=planes, gravity=(part * limit, 0, 0),
            first=material, dt=2e-5, steps=40_000,
        )
        for part in (0.99, 1.01)
    ]  # fmt: skip
    (*_, late, last), (*_, before, after) = looks(scenes, 8)
    creep = 0.99 * limit / drag if drag else 0.0
    speed = max(abs(state["velocity"][0, 0] - creep) for state in (late, last)) / (creep or limit)
    way = last["position"][0, 0] - late["position"][0, 0] - creep * scenes[0].duration / 8
    gained = (after["velocity"] - before["velocity"])[0, 0] / (scenes[0].duration / 8)
    spin = max(np.abs(state["spin"]).max() for state in (last, after))
    return speed, abs(way), abs(gained / (0.01 * limit) - 1), spin
