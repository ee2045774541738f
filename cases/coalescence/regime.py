"""Governing numbers of the clouds of L21 and their copies, in closed form: times, spins, energies and
forces."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
from scipy.constants import G

from tisim.cases.coalescence.published import (
    AXES,
    DENSITY,
    DIAMETERS,
    DURATION,
    MAGNETISATIONS,
    NUMBER,
    POISSON,
    ROTATIONS,
    SPACING,
)
from tisim.cases.coalescence.scaling import (
    PACKED,
    attraction,
    critical_spin,
    free_fall,
    mean_density,
    sphere_mass,
    spin_when_packed,
    surface_weight,
)
from tisim.cases.coalescence.scene import DEFAULT, IMPACT, ROTATION, scale_of, step, thermal_speed, young
from tisim.cases.granular_bench.closed_forms import hertz_depth, hertz_overlap, reduced
from tisim.cases.statistics import Shown

ACCELERATION = 5e-6
"""Gravity at the surface of L21's asteroids, m/s^2; section 4.6."""
FALLS = {d: free_fall(mean_density(d, SPACING, DENSITY)) for d in DIAMETERS}
"""The free-fall time (s) of a cloud without pressure, by grain diameter (m)."""
COMPARED = DURATION * FALLS[DIAMETERS[1]] / FALLS[DIAMETERS[0]]
"""The time, s, for grains of 100 cm that equals 15 000 s for L21's grains of 50 cm in units of the free-fall
time."""


def rotation_over_gravity(rotation: float, density: float) -> float:
    """Return the rotational energy of a ball of some density (kg/m^3) divided by its gravitational energy.

    It is a third of (rotation over critical spin)^2; rotation : rad/s.
    """
    return (rotation / critical_spin(density)) ** 2 / 3


def virial_ratio_of_cloud(diameter: float, number: int = NUMBER) -> float:
    """Return twice the thermal energy of L21's cloud, without its seed, over its gravitational energy, 3/5 G
    M^2 / R.

    Above 1 the cloud expands at first, and above 2 it is not bound by gravity. diameter : of the grains, m.
    """
    mass = number * sphere_mass(diameter, DENSITY)
    radius = (3 * number / (4 * np.pi)) ** (1 / 3) * SPACING
    square = 3 * float(thermal_speed(diameter, np.array(mass / number))) ** 2
    return float(mass * square / (0.6 * G * mass**2 / radius))


def impact_depth(diameter: float, scale: float, softened: float = 1.0) -> float:
    """Return the largest overlap of two grains in an impact at scale * IMPACT, divided by a radius."""
    mass = sphere_mass(diameter, DENSITY)
    modulus = young(scale, softened) / (2 * (1 - POISSON**2))
    return float(hertz_depth(scale * IMPACT, diameter / 4, reduced(mass, mass), modulus)) / (diameter / 2)


def magnetic_depth(diameter: float, scale: float, magnetisation: float, softened: float = 1.0) -> float:
    """Return the overlap of two magnets in line under their attraction, divided by a radius.

    magnetisation : of L21's grains, A/m.
    """
    modulus = young(scale, softened) / (2 * (1 - POISSON**2))
    force = attraction(diameter, scale * magnetisation)
    return float(hertz_overlap(force, diameter / 4, modulus)) / (diameter / 2)


def regime() -> Iterator[Shown]:
    """Yield the governing numbers of L21's clouds, and of the copy of the default size."""
    for d in DIAMETERS:
        yield from of_clouds(d)
    yield Shown(f"100 cm: time equivalent to {DURATION:g} s of 50 cm, s", COMPARED)
    scale, d = scale_of(DEFAULT["number"]), DIAMETERS[1]
    yield Shown("default: scale of the copy", scale)
    yield Shown("default: magnetisation for L21's 1190 A/m, A/m", scale * MAGNETISATIONS[-1])
    yield Shown("default: step, s", step(d, scale))
    yield Shown("default: overlap of an impact over a radius", impact_depth(d, scale))
    packed = critical_spin(PACKED * DENSITY)
    yield Shown("default: final over critical spin", spin_when_packed(ROTATION, d, SPACING) / packed)


def of_clouds(d: float) -> Iterator[Shown]:
    """Yield numbers of L21's clouds and asteroids with grains of a diameter (m)."""
    name, density, packed = (
        f"{1e2 * d:g} cm",
        mean_density(d, SPACING, DENSITY),
        critical_spin(PACKED * DENSITY),
    )
    yield Shown(f"{name}: density of the cloud, kg/m^3", density)
    yield Shown(f"{name}: free-fall time, s", FALLS[d])
    yield Shown(f"{name}: critical spin of the cloud, urad/s", 1e6 * critical_spin(density))
    for rotation in ROTATIONS:
        turns, end = f"{name}, {1e6 * rotation:g} urad/s", spin_when_packed(rotation, d, SPACING) / packed
        yield Shown(f"{turns}: over critical spin of the cloud", rotation / critical_spin(density))
        yield Shown(
            f"{turns}: rotational over gravitational energy", rotation_over_gravity(rotation, density)
        )
        yield Shown(f"{turns}: final over critical spin", end)
        axes = AXES.get((d, rotation, 0.0))
        beside = f"L21: axes {axes[0] / axes[2]:.2f}" if axes else ""
        yield Shown(f"{turns}, read as microdegrees: final over critical spin", end * np.pi / 180, beside)
    speed = 3**0.5 * float(thermal_speed(d, np.array(sphere_mass(d, DENSITY))))
    yield Shown(f"{name}: thermal speed, mm/s", 1e3 * speed)
    yield Shown(f"{name}: 2 K / |U| of the cloud", virial_ratio_of_cloud(d))
    for m in MAGNETISATIONS[1:]:
        weight = surface_weight(d, DENSITY, ACCELERATION)
        yield Shown(f"{name}, {m:g} A/m: attraction of two grains over weight", attraction(d, m) / weight)
