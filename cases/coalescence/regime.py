"""Governing numbers of the clouds of L21 and of their copies, in closed form: times, spins, energies and
forces on a grain."""

import math
from collections.abc import Iterator

import numpy as np
from scipy.constants import G

from tisim.cases.case import Shown
from tisim.cases.coalescence import published
from tisim.cases.coalescence.scene import DEFAULT, IMPACT, ROTATION, scale_of, step, thermal_speed, young
from tisim.cases.common.rubble_pile import critical_spin, free_fall, mean_density
from tisim.cases.common.two_spheres import attraction, hertz_depth, hertz_overlap, reduced, sphere_mass

ACCELERATION = 5e-6
"""Gravity at the surface of L21's asteroids, m/s^2; section 4.6."""
FALLS = {d: free_fall(mean_density(d, published.SPACING, published.DENSITY)) for d in published.DIAMETERS}
"""The free-fall time (s) of a cloud without pressure, by grain diameter (m)."""
COMPARED = published.DURATION * FALLS[published.DIAMETERS[1]] / FALLS[published.DIAMETERS[0]]
"""The time, s, for grains of 100 cm that equals 15 000 s for L21's grains of 50 cm in units of the free-fall
time."""

MAGNETISED_BY = {5e-7: 1.19, 5e-6: 11.9, 5e-5: 119.0, 5e-4: 1190.0, 5e-3: 11_900.0}
"""The magnetisation of a single sphere, A/m, by the field, T; section 4.5."""
IRON_DENSITY = 7860.0
"""Density of iron, kg/m^3; section 4.5 prints none."""

PACKED = 0.6
"""Packing fraction of a pile, approximately."""


def rotation_over_gravity(rotation: float, density: float) -> float:
    """Return the rotational energy of a ball of some density (kg/m^3) divided by its gravitational energy.

    It is a third of (rotation over critical spin)^2; rotation : rad/s.
    """
    return (rotation / critical_spin(density)) ** 2 / 3


def virial_ratio_of_cloud(diameter: float, number: int = published.NUMBER) -> float:
    """Return twice the thermal energy of L21's cloud, without its seed, over its gravitational energy, 3/5 G
    M^2 / R.

    Above 1 the cloud expands at first, and above 2 it is not bound by gravity. diameter : of the grains, m.
    """
    mass = number * sphere_mass(diameter, published.DENSITY)
    radius = (3 * number / (4 * np.pi)) ** (1 / 3) * published.SPACING
    square = 3 * float(thermal_speed(diameter, np.array(mass / number))) ** 2
    return float(mass * square / (0.6 * G * mass**2 / radius))


def impact_depth(diameter: float, scale: float, softened: float = 1.0) -> float:
    """Return the largest overlap of two grains in an impact at scale * IMPACT, divided by a radius."""
    mass = sphere_mass(diameter, published.DENSITY)
    modulus = young(scale, softened) / (2 * (1 - published.POISSON**2))
    return float(hertz_depth(scale * IMPACT, diameter / 4, reduced(mass, mass), modulus)) / (diameter / 2)


def magnetic_depth(diameter: float, scale: float, magnetisation: float, softened: float = 1.0) -> float:
    """Return the overlap of two magnets in line under their attraction, divided by a radius.

    magnetisation : of L21's grains, A/m.
    """
    modulus = young(scale, softened) / (2 * (1 - published.POISSON**2))
    force = attraction(diameter, scale * magnetisation)
    return float(hertz_overlap(force, diameter / 4, modulus)) / (diameter / 2)


def regime() -> Iterator[Shown]:
    """Yield the governing numbers of L21's clouds, and of the copy of the default size."""
    for d in published.DIAMETERS:
        yield from of_clouds(d)
    yield Shown(f"100 cm: time equivalent to {published.DURATION:g} s of 50 cm, s", COMPARED)
    scale, d = scale_of(DEFAULT["number"]), published.DIAMETERS[1]
    yield Shown("default: scale of the copy", scale)
    yield Shown("default: magnetisation for L21's 1190 A/m, A/m", scale * published.MAGNETISATIONS[-1])
    yield Shown("default: step, s", step(d, scale))
    yield Shown("default: overlap of an impact over a radius", impact_depth(d, scale))
    packed = critical_spin(PACKED * published.DENSITY)
    yield Shown(
        "default: final over critical spin", spin_when_packed(ROTATION, d, published.SPACING) / packed
    )


def of_clouds(d: float) -> Iterator[Shown]:
    """Yield numbers of L21's clouds and asteroids with grains of a diameter (m)."""
    name, density, packed = (
        f"{1e2 * d:g} cm",
        mean_density(d, published.SPACING, published.DENSITY),
        critical_spin(PACKED * published.DENSITY),
    )
    yield Shown(f"{name}: density of the cloud, kg/m^3", density)
    yield Shown(f"{name}: free-fall time, s", FALLS[d])
    yield Shown(f"{name}: critical spin of the cloud, urad/s", 1e6 * critical_spin(density))
    for rotation in published.ROTATIONS:
        turns, end = (
            f"{name}, {1e6 * rotation:g} urad/s",
            spin_when_packed(rotation, d, published.SPACING) / packed,
        )
        yield Shown(f"{turns}: over critical spin of the cloud", rotation / critical_spin(density))
        yield Shown(
            f"{turns}: rotational over gravitational energy", rotation_over_gravity(rotation, density)
        )
        yield Shown(f"{turns}: final over critical spin", end)
        axes = published.AXES.get((d, rotation, 0.0))
        beside = f"L21: axes {axes[0] / axes[2]:.2f}" if axes else ""
        yield Shown(f"{turns}, read as microdegrees: final over critical spin", end * np.pi / 180, beside)
    speed = 3**0.5 * float(thermal_speed(d, np.array(sphere_mass(d, published.DENSITY))))
    yield Shown(f"{name}: thermal speed, mm/s", 1e3 * speed)
    yield Shown(f"{name}: 2 K / |U| of the cloud", virial_ratio_of_cloud(d))
    if d == published.DIAMETERS[0]:
        yield from of_moments(d)
    for m in published.MAGNETISATIONS[1:]:
        weight = surface_weight(d, published.DENSITY, ACCELERATION)
        yield Shown(f"{name}, {m:g} A/m: attraction of two grains over weight", attraction(d, m) / weight)


def of_moments(d: float) -> Iterator[Shown]:
    """Yield the moments of L21's seed particle, and of all of its grains in random directions (section
    4.2.2.4)."""
    ratio = (published.SEED_DIAMETER / d) ** 3
    for m in published.MAGNETISATIONS[1:]:
        name, grain = f"{1e2 * d:g} cm, {m:g} A/m", m * math.pi / 6 * d**3
        beside = f"L21, asteroid: {published.BULK[m].moment:.2g}"
        yield Shown(f"{name}: moment of the seed particle, A m^2", ratio * grain, beside)
        alone, whole = (random_moment(published.NUMBER, seed) for seed in (0.0, ratio))
        yield Shown(f"{name}: moment of grains in random directions, A m^2", alone * grain, beside)
        yield Shown(f"{name}: the same with the seed particle, A m^2", whole * grain, beside)


def random_moment(number: int, seed: float = 0.0) -> float:
    """Return the mean magnitude of the sum of moments in random directions, divided by the moment of a grain.

    number : of grains of equal moments; their sum is then normally distributed, with a variance of number/3
    along each axis. seed : moment of the seed particle, divided by the moment of a grain. Without it the mean
    is sqrt(8 number / (3 pi)).
    """
    s = math.sqrt(number / 3)
    if seed == 0:
        return s * math.sqrt(8 / math.pi)
    normal = math.sqrt(2 / math.pi) * s * math.exp(-0.5 * (seed / s) ** 2)
    return normal + (seed + s * s / seed) * math.erf(seed / (math.sqrt(2) * s))


def spin_when_packed(rotation: float, diameter: float, spacing: float) -> float:
    """Return the angular velocity (rad/s) of the pile that a rotating ball of grains on a lattice becomes.

    The pile is assumed to be a ball with the same angular momentum. rotation : of the lattice, rad/s.
    """
    shrinks = math.pi / 6 * diameter**3 / PACKED / spacing**3
    return rotation * shrinks ** (-2 / 3)


def surface_weight(diameter: float, density: float, acceleration: float) -> float:
    """Return the weight of a grain, N (L21 Eq. 4.13)."""
    return sphere_mass(diameter, density) * acceleration


def balanced_gravity(diameter: float, magnetisation: float, density: float) -> float:
    """Return the gravity (m/s^2) in which a grain weighs as much as it attracts its neighbour.

    L21 Fig. 4.16 has its lines. diameter : m. magnetisation : of both grains, A/m. density : kg/m^3.
    """
    return attraction(diameter, magnetisation) / sphere_mass(diameter, density)


def dominated(
    magnetisation: float, gravity: float, cleanliness: float, density: float
) -> tuple[float, float]:
    """Return the diameters (m) between which magnetism exceeds both the cohesion and the weight of a grain.

    The attraction of two grains is proportional to the square of the diameter, cohesion to the diameter and
    weight to its cube. magnetisation : A/m. gravity : m/s^2. cleanliness : S of (4.15). density : kg/m^3.
    """
    per_square = attraction(1.0, magnetisation)
    return (
        surface_cohesion(1.0, cleanliness) / per_square,
        per_square / surface_weight(1.0, density, gravity),
    )


def mutual_gravity(diameter: float, density: float) -> float:
    """Return the gravitational attraction of two grains in contact: G (2/3 pi rho R^2)^2, N. L21 Eq. (4.14)
    has 1/3."""
    return G * (2 / 3 * math.pi * density * (diameter / 2) ** 2) ** 2


def surface_cohesion(diameter: float, cleanliness: float) -> float:
    """Return the cohesion 0.036 S^2 R, N (L21 Eq. 4.15); S is 1 for clean surfaces."""
    return 3.6e-2 * cleanliness**2 * diameter / 2


def dmt_cohesion(diameter: float, surface_energy: float) -> float:
    """Return the cohesion of two grains, 4 pi gamma R*, N (L21 Eq. 4.5)."""
    return math.pi * surface_energy * diameter
