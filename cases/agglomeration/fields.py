"""Charges and fields in the flow of Z04: the near field of its remark 4.2, which it leaves to others.

Half of the grains belong to each of two classes, which differ only in their charge. The grains interact by
Coulomb's law (Z13 Eq. 22, the near field of Eq. 24). An electric field across the flow acts on their charges
(Z13 Eq. 3). A magnetic field along the flow magnetises them as iron, so that they interact as dipoles (L21
Eqs 4.8, 4.9). Each field has a constant and an oscillating part (Z13 Eq. 16).

The charge of a grain is given as a surface charge density, and its magnetic moment is its magnetisation times
its volume. Therefore the speed that two grains gain by attraction before they meet does not depend on their
size, and neither does the speed above which they bond (Z04 4.15). The genes have the same meaning in all
sizes of the case.

A magnetic field also turns the velocities of charges, by q B t/m, which is below 3e-4 in a whole flow for
grains of 1 mm and more. This is left out so that a leapfrog, which keeps pressed grains at rest, can
integrate all forces.
"""

import math
from collections.abc import Mapping

from scipy.constants import epsilon_0, mu_0

from tisim.effects import CARBONYL_IRON, DipoleDipole, Effect, FroehlichMoment, Lorentz, NearField
from tisim.optimize import Gene
from tisim.packing import EqualSizes, GrainClass
from tisim.sources import ElectricField, MagneticField
from tisim.steppers import ApproachTime, Stepper, Verlet

CHARGE_GENES = (
    # The electric field at the surface, at most 4.5e8 V/m, is half of the field that pulls electrons out of
    # a metal in vacuum; air withstands less than a hundredth of it.
    Gene("surface_charge", "C/m^2", 0.0, 4e-3),
    Gene("charge_ratio", "", -1.0, 1.0),
)
"""Surface charge density of the first class of grains, and the ratio of the second class's density to it."""
ELECTRIC_GENES = (
    # Vacuum between electrodes withstands some 1e7 V/m.
    Gene("electric_field", "V/m", 0.0, 1e7),
    Gene("electric_amplitude", "V/m", 0.0, 1e7),
    Gene("electric_frequency", "Hz", 50.0, 1e3, "log"),
)
MAGNETIC_GENES = (
    # Iron spheres saturate at 0.7 T.
    Gene("magnetic_field", "T", 0.0, 1.0),
    Gene("magnetic_amplitude", "T", 0.0, 1.0),
    Gene("magnetic_frequency", "Hz", 50.0, 1e3, "log"),
)
FIELD_GENES = (*CHARGE_GENES, *ELECTRIC_GENES, *MAGNETIC_GENES)
"""All genes of charges and fields. Frequencies range from half an oscillation to ten in a flow, amplitudes
from zero to values at which the field dominates the flow."""
NO_FIELDS: Mapping[str, float] = {gene.name: max(gene.low, 0.0) for gene in FIELD_GENES}
"""Values of these genes at which the grains interact only by impacts."""
SHOWN: Mapping[str, float] = {
    "surface_charge": 3e-3, "charge_ratio": -0.8,
    "electric_field": 5e6, "electric_amplitude": 5e6, "electric_frequency": 100.0,
    "magnetic_field": 0.5, "magnetic_amplitude": 0.3, "magnetic_frequency": 100.0,
}  # fmt: skip
"""Charges and fields strong enough to change the flow; used for the scene that is shown with them."""

COULOMB = NearField(alpha2=1 / (4 * math.pi * epsilon_0), beta2=2, strength="charge")
PHASE = 0.1
"""Largest product of the step and the rate of an oscillation that the forces of the fields can cause."""


def has_fields(design: Mapping[str, float]) -> bool:
    """Return whether a design has genes of charges and fields, even if their values are zero."""
    return "surface_charge" in design


def charged_classes(design: Mapping[str, float], radius: float) -> tuple[GrainClass, ...]:
    """Return the two classes of grains of a radius (m), which differ in their charge."""
    charge = 4 * math.pi * radius**2 * design["surface_charge"]
    return tuple(
        GrainClass(sizes=EqualSizes(radius=radius), density=design["density"], quantities={"charge": q})
        for q in (charge, design["charge_ratio"] * charge)
    )


def forces(design: Mapping[str, float]) -> tuple[Effect, ...]:
    """Return the forces of charges and fields. All designs have the same effects, so that a whole search runs
    in one batch."""
    electric, magnetic = (2 * math.pi * design[f"{kind}_frequency"] for kind in ("electric", "magnetic"))
    return (
        COULOMB,
        ElectricField(
            constant=(0.0, design["electric_field"], 0.0),
            amplitude=(0.0, design["electric_amplitude"], 0.0),
            omega=(0.0, electric, 0.0),
        ),
        MagneticField(
            constant=(design["magnetic_field"], 0.0, 0.0),
            amplitude=(design["magnetic_amplitude"], 0.0, 0.0),
            omega=(magnetic, 0.0, 0.0),
        ),
        Lorentz(magnetic=False),
        FroehlichMoment(**CARBONYL_IRON.parameters()),
        DipoleDipole(),
    )


def rate(design: Mapping[str, float], radius: float) -> float:
    """Return the rate (1/s) of the fastest oscillation that charges and fields can cause.

    It is sqrt(a/b), with b the radius and a the acceleration of two touching grains by all forces of the
    fields together. With the surface charge sigma and the magnetisation M, the two grains attract each other
    by pi b^2 sigma^2 / epsilon_0 and pi mu_0 b^2 M^2 / 6, and a field E pulls by 4 pi b^2 sigma E. Charges
    and moments add up when grains merge, so larger grains have no higher rate.
    """
    charge = design["surface_charge"] * max(1.0, abs(design["charge_ratio"]))
    electric, magnetic = (
        design[f"{kind}_field"] + design[f"{kind}_amplitude"] for kind in ("electric", "magnetic")
    )
    magnetisation = min(3 * magnetic / mu_0, CARBONYL_IRON.parameters()["saturation"])
    pressure = charge**2 / epsilon_0 + mu_0 * magnetisation**2 / 6 + 4 * charge * electric
    return math.sqrt(0.75 * pressure / design["density"]) / radius


def stepper(design: Mapping[str, float], radius: float) -> Stepper:
    """Return the stepper for a design and a radius (m) in fields.

    Forces also act between impacts, so the step is limited by the rate of the oscillations that they can
    cause.
    """
    fastest, usual = rate(design, radius), ApproachTime()
    longest = min(PHASE / fastest, usual.longest) if fastest else usual.longest
    return Verlet(control=ApproachTime(shortest=min(usual.shortest, longest), longest=longest))
