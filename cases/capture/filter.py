"""A filter of magnetised fibres in a channel with flowing water, and the scene of its particles.

Fibres of one size lie along z, side by side in successive layers, in a uniform field in any direction of the
xz plane. The water flows along y. The field determines the magnetisation of fibres of soft steel
(``tisim/sources/magnetic/soft_magnet.py``). The flow is uniform, as in B16: its deflection by the fibres is
neglected.
"""

from dataclasses import dataclass
from itertools import islice, product

import numpy as np

from tisim import Cloud, RandomInBox, Scene
from tisim.cases.capture.scene import DENSITY
from tisim.cases.common import magnetic_fibre as b16
from tisim.components.component import Vector
from tisim.effects import LangevinMoment, Magnetophoresis
from tisim.errors import must
from tisim.operators import Capture
from tisim.sources import Cylinder, MagneticCylinders, MagneticField, UniformFlow
from tisim.sources.magnetic.soft_magnet import magnetisation
from tisim.steppers import Brownian, DriftLimit

WIRE = 20 * b16.FIBRE_DIAMETER
"""Largest total length of the fibres, m: the length of one of B16's longest."""
CHANNEL_WIDTH, CHANNEL_HEIGHT = 6 * b16.FIBRE_DIAMETER, 20 * b16.FIBRE_DIAMETER
"""Width of the channel along x and height along z, m."""
UPSTREAM, SLAB, DOWNSTREAM = 3 * b16.FIBRE_DIAMETER, b16.FIBRE_DIAMETER, 2 * b16.FIBRE_DIAMETER
"""Distance between the starting slab and the first layer, thickness of that slab, and distance behind the
last layer at which the simulation ends, m."""
FILTER_PARTICLES = 120
"""Number of particles that flow through a filter in a run."""
FLOW_SPEED, FILTER_RADIUS = 3e-4, 125.0
"""Speed of the flow, m/s, and radius of the particles, nm, unless they are genes."""
DOMAIN_MOMENT = 2.3e-19
"""The moment of a magnetite grain of 10 nm, A m^2 (B16 7.6): particles are saturated above about 0.1 T."""
PUSHED, CARRIED = 5e-6, 20e-6
"""Largest displacement of a particle in a step by forces and by the flow, m."""
LARGEST = 212
"""The radius of B16's largest particles, nm. The moment of other sizes is scaled from theirs (table 6.1) by
volume."""
TABLE_DIGITS = 3
"""Number of digits in the table of the fibres' field; random motion outweighs this error."""


@dataclass(frozen=True)
class Filter:
    """A filter, the particles, and the speed of the flow.

    flux : of the uniform field, T. field_angle : between the field and the axis of the fibres, degrees.
    magnetisation_angle : between the magnetisation of saturated hard magnets and that axis; None for soft
    steel.
    aspect : L/D. number : of fibres, rounded.
    spacing : of neighbours in D, between their axes; the gap along the axes is spacing - 1.
    speed : of the flow, m/s. radius : of particles, nm.
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
        """Return the length of a fibre, m."""
        return self.aspect * b16.FIBRE_DIAMETER

    def magnetisation(self) -> Vector:
        """Return the magnetisation of the fibres, A/m."""
        if self.magnetisation_angle is not None:
            return _in_plane(b16.SATURATION_MAGNETISATION, self.magnetisation_angle)
        field = _in_plane(self.flux, self.field_angle)
        return magnetisation(
            (0.0, 0.0, 1.0), b16.FIBRE_DIAMETER / 2, self.length, b16.SATURATION_MAGNETISATION, field
        )

    def places(self) -> list[Vector]:
        """Return the centres of the fibres, m: layer after layer, each from its middle outwards.

        InputError if there is no fibre, or if the fibres need more wire than is available.
        """
        count = round(self.number)
        must(count >= 1, "number of fibres", "at least 1", count)
        must(count * self.length <= WIRE * (1 + 1e-9), "wire", f"at most {WIRE:g} m", count * self.length)
        across, along = (
            self.spacing * b16.FIBRE_DIAMETER,
            self.length + (self.spacing - 1) * b16.FIBRE_DIAMETER,
        )
        columns = _row(1 + int((CHANNEL_WIDTH - b16.FIBRE_DIAMETER) / across + 1e-9), across)
        rows = _row(1 + int((CHANNEL_HEIGHT - self.length) / along + 1e-9), along)
        layer = sorted(product(columns, rows), key=lambda at: (at[0] ** 2 + at[1] ** 2, at))
        layers = ((x, k * across, z) for k in range(count) for x, z in layer)
        return list(islice(layers, count))

    def scene(self, seed: int, number: int = FILTER_PARTICLES) -> Scene:
        """Return the scene of particles that flow through the filter."""
        places, radius = self.places(), self.radius * 1e-9
        start = -UPSTREAM - SLAB
        way = places[-1][1] + DOWNSTREAM - start
        half = np.array([CHANNEL_WIDTH, CHANNEL_HEIGHT]) / 2
        fibre = {"radius": b16.FIBRE_DIAMETER / 2, "length": self.length}
        magnetised = self.magnetisation()
        moment = b16.SATURATION_MOMENTS[LARGEST] * (self.radius / LARGEST) ** 3
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
                LangevinMoment(temperature=b16.WATER_TEMPERATURE),
                Magnetophoresis(),
                Capture(),
            ),
            stepper=Brownian(
                temperature=b16.WATER_TEMPERATURE,
                viscosity=b16.WATER_VISCOSITY,
                control=DriftLimit(longest=CARRIED / self.speed, shortest=1e-9, drift=PUSHED / radius),
            ),
            duration=way / self.speed,
            seed=seed,
        )


def _row(count: int, pitch: float) -> np.ndarray:
    """Return the positions (m) of ``count`` points in a row about 0, a pitch (m) apart."""
    return pitch * (np.arange(count) - (count - 1) / 2)


def _in_plane(size: float, angle: float) -> Vector:
    """Return a vector of a size at an angle (degrees) to z, in the xz plane."""
    return size * float(np.sin(np.radians(angle))), 0.0, size * float(np.cos(np.radians(angle)))
