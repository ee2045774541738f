"""A filter of magnetised fibres in a channel that water flows through, and the scene of its particles.

Fibres of one size lie along z, side by side in layers one behind the other, in a uniform field in any
direction of the xz plane. The water flows along y. Fibres of soft steel are magnetised as the field decides
(soft_magnet.py). As in B16, the flow is uniform: that fibres turn it aside is left out.
"""

from __future__ import annotations

from dataclasses import dataclass
from itertools import islice, product

import numpy as np
from tisim.cases.capture.scene import (
    DENSITY,
    DIAMETER,
    SATURATION_MAGNETISATION,
    SATURATION_MOMENTS,
    TEMPERATURE,
    VISCOSITY,
)

from tisim import Cloud, RandomInBox, Scene
from tisim.components.component import Vector
from tisim.effects import LangevinMoment, Magnetophoresis
from tisim.errors import must
from tisim.operators import Capture
from tisim.sources import Cylinder, MagneticCylinders, MagneticField, UniformFlow
from tisim.sources.magnetic.soft_magnet import magnetisation
from tisim.steppers import Brownian, DriftLimit

WIRE = 20 * DIAMETER
"""All fibres together are so long at most, m: as one of B16's longest."""
CHANNEL_WIDTH, CHANNEL_HEIGHT = 6 * DIAMETER, 20 * DIAMETER
"""The channel is so wide along x, and so high along z, m."""
UPSTREAM, SLAB, DOWNSTREAM = 3 * DIAMETER, DIAMETER, 2 * DIAMETER
"""Particles start so far before the first layer, in a slab so thick, and are seen until so far behind the
last one, m."""
FILTER_PARTICLES = 120
"""So many particles flow through a filter in a run."""
FLOW_SPEED, FILTER_RADIUS = 3e-4, 125.0
"""The speed of the flow, m/s, and the radius of the particles, nm, where they are no genes."""
DOMAIN_MOMENT = 2.3e-19
"""The moment of a magnetite grain of 10 nm, A m^2 (B16 7.6): particles are saturated from some 0.1 T on."""
PUSHED, CARRIED = 5e-6, 20e-6
"""How far forces and the flow move a particle in a step at most, m."""
LARGEST = 212
"""The radius of B16's largest particles, nm. Those of other sizes have its moment (table 6.1) by volume."""
TABLE_DIGITS = 3
"""The field of the fibres is tabulated to so many digits; what decides is random."""


@dataclass(frozen=True)
class Filter:
    """A filter, the particles, and how fast they come.

    flux : of the uniform field, T; field_angle : of it to the axis of the fibres, degrees;
    magnetisation_angle : of theirs, saturated, if they are hard magnets; None for soft steel. aspect : L/D.
    number : of fibres, rounded. spacing : of neighbours in D: between axes, and along them the gap is one
    less. speed : of the flow, m/s. radius : of particles, nm.
    """

    flux: float = 1.0
    field_angle: float = 90.0
    magnetisation_angle: float | None = None
    aspect: float = 5 / 3
    number: float = 12.0
    spacing: float = 3.0
    speed: float = FLOW_SPEED
    radius: float = FILTER_RADIUS

    @property
    def length(self) -> float:
        """The length of a fibre, m."""
        return self.aspect * DIAMETER

    def magnetisation(self) -> Vector:
        """Return the magnetisation of the fibres, A/m."""
        if self.magnetisation_angle is not None:
            return _in_plane(SATURATION_MAGNETISATION, self.magnetisation_angle)
        field = _in_plane(self.flux, self.field_angle)
        return magnetisation((0.0, 0.0, 1.0), DIAMETER / 2, self.length, SATURATION_MAGNETISATION, field)

    def places(self) -> list[Vector]:
        """Centres of the fibres, m: layer after layer, each from its middle outwards.

        InputError when there is not wire enough, or no fibre.
        """
        count = round(self.number)
        must(count >= 1, "number of fibres", "at least 1", count)
        must(count * self.length <= WIRE * (1 + 1e-9), "wire", f"at most {WIRE:g} m", count * self.length)
        across, along = self.spacing * DIAMETER, self.length + (self.spacing - 1) * DIAMETER
        columns = _row(1 + int((CHANNEL_WIDTH - DIAMETER) / across + 1e-9), across)
        rows = _row(1 + int((CHANNEL_HEIGHT - self.length) / along + 1e-9), along)
        layer = sorted(product(columns, rows), key=lambda at: (at[0] ** 2 + at[1] ** 2, at))
        layers = ((x, k * across, z) for k in range(count) for x, z in layer)
        return list(islice(layers, count))

    def scene(self, seed: int, number: int = FILTER_PARTICLES) -> Scene:
        """Particles that flow through it."""
        places, radius = self.places(), self.radius * 1e-9
        start = -UPSTREAM - SLAB
        way = places[-1][1] + DOWNSTREAM - start
        half = np.array([CHANNEL_WIDTH, CHANNEL_HEIGHT]) / 2
        fibre = {"radius": DIAMETER / 2, "length": self.length}
        magnetised = self.magnetisation()
        moment = SATURATION_MOMENTS[LARGEST] * (self.radius / LARGEST) ** 3
        return Scene(
            name="filter",
            particles=Cloud(
                number=number,
                radius=radius,
                density=DENSITY,
                placement=RandomInBox(low=(-half[0], start, -half[1]), high=(half[0], start + SLAB, half[1])),
                quantities={"saturation_moment": moment, "domain_moment": DOMAIN_MOMENT},
            ),
            effects=(
                MagneticField(constant=_in_plane(self.flux, self.field_angle)),
                MagneticCylinders(
                    cylinders=tuple(
                        Cylinder(centre=place, magnetisation=magnetised, **fibre) for place in places
                    ),
                    table_digits=TABLE_DIGITS,
                ),
                UniformFlow(velocity=(0.0, self.speed, 0.0)),
                LangevinMoment(temperature=TEMPERATURE),
                Magnetophoresis(),
                Capture(),
            ),
            stepper=Brownian(
                temperature=TEMPERATURE,
                viscosity=VISCOSITY,
                control=DriftLimit(longest=CARRIED / self.speed, shortest=1e-9, drift=PUSHED / radius),
            ),
            duration=way / self.speed,
            seed=seed,
        )


def _row(count: int, pitch: float) -> np.ndarray:
    """Places (m) of so many in a row about 0, a pitch (m) apart."""
    return pitch * (np.arange(count) - (count - 1) / 2)


def _in_plane(size: float, angle: float) -> Vector:
    """Return a vector of a size at an angle (degrees) to z, in the xz plane."""
    return size * float(np.sin(np.radians(angle))), 0.0, size * float(np.cos(np.radians(angle)))
