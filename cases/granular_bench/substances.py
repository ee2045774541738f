"""The substances of the spheres in the tests of Chung and Ooi (2011)."""

from __future__ import annotations

from dataclasses import dataclass

SOURCE = "Y. C. Chung and J. Y. Ooi, Granul. Matter 13 (2011) 643-656, doi 10.1007/s10035-011-0277-0"


@dataclass(frozen=True)
class Substance:
    """A substance: Young's modulus (Pa), Poisson's ratio and density (kg/m^3)."""

    young: float
    poisson: float
    density: float

    @property
    def rigid_modulus(self) -> float:
        """Return E* of a sphere of this substance at a rigid plane, E / (1 - nu^2), Pa."""
        return self.young / (1 - self.poisson**2)


SUBSTANCES = {
    "glass": Substance(4.8e10, 0.20, 2800.0),
    "limestone": Substance(2.0e10, 0.25, 2500.0),
    "aluminium alloy": Substance(7.0e10, 0.30, 2699.0),
    "magnesium alloy": Substance(4.0e10, 0.35, 1800.0),
    "aluminium oxide": Substance(3.8e11, 0.23, 4000.0),
    "cast iron": Substance(1.0e11, 0.25, 7000.0),
    "aluminium alloy 2": Substance(7.0e10, 0.33, 2700.0),
    "steel": Substance(2.08e11, 0.30, 7850.0),
    "polyethylene": Substance(1.0e9, 0.40, 1400.0),
    "nylon": Substance(2.5e9, 0.40, 1000.0),
    "copper": Substance(1.2e11, 0.35, 8900.0),
}
"""Substances by name; Chung and Ooi have two alloys of aluminium, the second in test 4 and later tests."""
