"""The duct of a valve and its constriction: shape, walls, the oil in it, and the flow without a field.

The simulation cannot give the flow that a pressure drives through a valve without a field, because its oil is
a prescribed flow that neither grains nor walls change. That flow is computed by the law of Hagen and
Poiseuille for a duct of slowly changing width, with the viscosity of Krieger and Dougherty. It does not
depend on the size of grains; only jams do.
"""

import itertools
from dataclasses import dataclass

import numpy as np

from tisim.cases.common.magnetorheological_fluid import RANDOM_PACKING, relative_viscosity
from tisim.cases.valve import published
from tisim.effects import Walls
from tisim.errors import must
from tisim.geometry import ConicalSurface, CylindricalSurface
from tisim.packing import RandomInDuct
from tisim.sources import ConstrictionFlow

SLICES = 400
"""Number of slices of each part of the duct in integrals."""


@dataclass(frozen=True)
class Duct:
    """A round duct along z with a constriction in its middle, m.

    throat, bore : diameters of the constriction and of the duct. straight : length of the constriction.
    taper : length of the cones before and after it. length : of the whole duct, which is its period.
    """

    throat: float
    bore: float
    straight: float
    taper: float
    length: float

    def __post_init__(self) -> None:
        rule = f"above 0 and below {self.bore:g} m, the bore"
        must(0 < self.throat < self.bore, "diameter of the constriction", rule, self.throat)
        must(self.straight > 0, "length of the constriction", "above 0", self.straight)
        must(self.taper > 0, "length of a cone", "above 0", self.taper)
        least = self.straight + 2 * self.taper
        rule = f"above {least:g} m, the length of the constriction with its cones"
        must(self.length > least, "length of the duct", rule, self.length)

    @property
    def area(self) -> float:
        """Return the cross-section of the duct, m^2."""
        return np.pi * self.bore**2 / 4

    def profile(self) -> tuple[np.ndarray, np.ndarray]:
        """Return positions along the duct, from its lower end up, and its radius there, m."""
        near, far = self.straight / 2, self.straight / 2 + self.taper
        wide, narrow = self.bore / 2, self.throat / 2
        place = np.array([-self.length / 2, -far, -near, near, far, self.length / 2])
        return place + self.length / 2, np.array([wide, wide, narrow, narrow, wide, wide])

    def depth(self, rho: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the distance of points in the duct from the wall, m; rho, z : distances from the axis and
        along it, m."""
        heights, radii = self.profile()
        corners, places = np.column_stack([radii, heights - self.length / 2]), np.column_stack([rho, z])
        nearest = np.full(len(places), np.inf)
        for a, b in itertools.pairwise(corners):
            part = np.clip((places - a) @ (b - a) / ((b - a) @ (b - a)), 0.0, 1.0)
            nearest = np.minimum(nearest, np.linalg.norm(places - a - part[:, None] * (b - a), axis=1))
        return nearest

    def filling(self) -> RandomInDuct:
        """Return the initial placement of grains: anywhere in the duct."""
        heights, radii = self.profile()
        return RandomInDuct(
            centre=(0.0, 0.0, -self.length / 2), heights=tuple(heights.tolist()), radii=tuple(radii.tolist())
        )

    def walls(self) -> Walls:
        """Return the walls of the duct.

        They extend one bore beyond both ends, so that they have no rims at the periodic boundary.
        """
        near, far, end = self.straight / 2, self.straight / 2 + self.taper, self.length / 2 + self.bore

        def at(z: float) -> tuple[float, float, float]:
            return (0.0, 0.0, z)

        wide, narrow = self.bore / 2, self.throat / 2
        return Walls(
            name="valve",
            cylinders=[
                CylindricalSurface(start=at(-end), end=at(-far), radius=wide),
                CylindricalSurface(start=at(-near), end=at(near), radius=narrow),
                CylindricalSurface(start=at(far), end=at(end), radius=wide),
            ],
            cones=[
                ConicalSurface(start=at(-far), end=at(-near), start_radius=wide, end_radius=narrow),
                ConicalSurface(start=at(near), end=at(far), start_radius=narrow, end_radius=wide),
            ],
        )

    def oil(self, speed: float) -> ConstrictionFlow:
        """Return the flow of the oil for a speed along the duct, m/s, as in L21.

        The speed increases abruptly at the ends of the straight part of the constriction.
        """
        return ConstrictionFlow(
            speed=speed, throat_radius=self.throat / 2, duct_radius=self.bore / 2, length=self.straight
        )

    def oil_speed(self, rho: np.ndarray, z: np.ndarray) -> np.ndarray:
        """Return the speed of the oil relative to its speed along the duct, as in ``oil``.

        rho, z : distances from the axis and along it, m.
        """
        wide, narrow = self.bore / 2, self.throat / 2
        faster = np.where(np.abs(z) <= self.straight / 2, (wide / narrow) ** 2, 1.0)
        return np.where(rho <= narrow, faster, np.clip((wide - rho) / (wide - narrow), 0.0, 1.0))

    def oil_through(self) -> float:
        """Return the integral of ``oil_speed`` over the duct, m^3."""
        heights, radii = self.profile()
        part = (np.arange(SLICES) + 0.5) / SLICES
        total, narrow, wide = 0.0, self.throat / 2, self.bore / 2
        for low, high, first, last in zip(heights[:-1], heights[1:], radii[:-1], radii[1:], strict=True):
            z, b = low + part * (high - low) - self.length / 2, first + part * (last - first)
            core = np.pi * narrow**2 * self.oil_speed(np.zeros(SLICES), z)
            # From the radius of the constriction out to the wall.
            ring = 2 * np.pi * (wide * (b**2 - narrow**2) / 2 - (b**3 - narrow**3) / 3) / (wide - narrow)
            total += float((core + ring).mean() * (high - low))
        return total


def resistance(duct: Duct) -> float:
    """Return the hydraulic resistance of a duct divided by the viscosity, 1/m^3.

    It is 8/pi times the integral of 1/r^4, which is l (r_1^2 + r_1 r_2 + r_2^2) / (3 r_1^3 r_2^3) along a
    cone of the length l from r_1 to r_2.
    """
    heights, radii = duct.profile()
    a, b = radii[:-1], radii[1:]
    parts = np.diff(heights) * (a * a + a * b + b * b) / (3 * a**3 * b**3)
    return float(8 / np.pi * parts.sum())


def suspension_viscosity(fraction: float) -> float:
    """Return the viscosity without field of oil with a volume fraction of equal grains, Pa s."""
    return published.OIL_VISCOSITY * relative_viscosity(fraction, RANDOM_PACKING)


def open_flow(duct: Duct, pressure: float, fraction: float) -> float:
    """Return the volume flow rate, m^3/s, that a pressure (Pa) drives through a duct without a field."""
    return pressure / (suspension_viscosity(fraction) * resistance(duct))


def yield_pressure(duct: Duct, stress: float) -> float:
    """Return the pressure (Pa) below which a fluid with a yield stress (Pa) does not flow through a duct.

    The pressure on each slice is borne by the yield stress at the wall, so it is the stress times the
    integral of 2/r, which is 2 l ln(r_2/r_1) / (r_2 - r_1) along a cone of the length l from r_1 to r_2. L21
    (1.1) and (3.1) write tau L/d, without the factor of 4 of a round duct of the diameter d.
    """
    heights, radii = duct.profile()
    a, b = radii[:-1], radii[1:]
    # (b - a) / ln(b/a), the logarithmic mean, is a where both are equal.
    same = np.isclose(a, b, rtol=1e-12, atol=0.0)
    mean = np.where(same, a, (b - a) / np.where(same, 1.0, np.log(b / a)))
    return float(stress * (2 * np.diff(heights) / mean).sum())
