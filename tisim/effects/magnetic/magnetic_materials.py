"""Soft magnetic materials by name, for laws whose magnetisation saturates."""

from __future__ import annotations

from dataclasses import dataclass

from scipy.constants import mu_0

from tisim.errors import InputError


@dataclass(frozen=True)
class MagneticMaterial:
    """A magnetic material holds the magnetisation and density of the material of grains.

    saturation : saturation magnetisation, A/m. susceptibility : in weak fields, mu_r - 1; None if it depends
    on the preparation of the material. For spheres it hardly matters if it is far above 3. density : kg/m^3.
    source : reference of the numbers.
    """

    name: str
    saturation: float
    susceptibility: float | None
    density: float
    source: str

    def parameters(self, susceptibility: float | None = None) -> dict[str, float]:
        """Return its parameters for ``FroehlichMoment``, ``MutualFroehlichMoment`` and
        ``EwaldFroehlichMoment``; a given susceptibility replaces its own."""
        own = self.susceptibility if susceptibility is None else susceptibility
        if own is None:
            rule = "given, as it depends on the preparation of the material"
            raise InputError(f"susceptibility of {self.name} must be {rule}; received nothing")
        return {"susceptibility": own, "saturation": self.saturation}


CARBONYL_IRON = MagneticMaterial(
    name="carbonyl iron",
    saturation=2.1 / mu_0,
    susceptibility=999.0,
    density=7860.0,
    source="J. M. Ginder, L. C. Davis, L. D. Elie, Int. J. Mod. Phys. B 10 (1996) 3293: mu_0 M_s = 2.1 T, "
    "mu_r = 1000; density of iron",
)
IRON = MagneticMaterial(
    name="iron",
    saturation=1.714e6,
    susceptibility=None,
    density=7874.0,
    source="B. D. Cullity, C. D. Graham, Introduction to Magnetic Materials (2009), appendix 5, at 20 C",
)
MAGNETITE = MagneticMaterial(
    name="magnetite",
    saturation=4.8e5,
    susceptibility=None,
    density=5197.0,
    source="D. J. Dunlop, O. Oezdemir, Rock Magnetism (1997), table 3.1",
)
