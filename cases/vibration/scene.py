"""Electromagnetically induced vibration of particles in a binder (Z13 section 4).

Z13 is T. I. Zohdi, Electromagnetically-induced vibration in particulate-functionalized materials, J. Vib.
Acoust. (2013), doi 10.1115/1.4023251. The scene is a cubic array of charged particles, each tethered to its
initial position, in a constant magnetic field along z and an oscillating electric field along x.

The printed near field is far from equilibrium: attraction and repulsion balance at alpha_2/alpha_1 = 0.5 m,
but neighbours are 1/30 m apart. It throws the array apart, and single paths are chaotic after some 0.01 s.
The centre of gravity is not affected: forces between particles cancel, and tether and Lorentz force are
linear, so it follows ``closed_forms.response`` exactly.

In the size "equilibrium" the near field between neighbours is balanced. Equal particles in uniform fields
move together, so this near field has no effect unless the start is disturbed: the frequencies of the near
field that the paper discusses do not occur in the centre of gravity.
"""

import numpy as np

from tisim import Cloud, Lattice, Scene
from tisim.cases.case import Size, size_named
from tisim.effects import Lorentz, NearField, Tether, TruncatedNearField
from tisim.operators import PeakDisplacement
from tisim.sources import ElectricField, MagneticField
from tisim.steppers import ErrorControl, Trapezoid

TITLE = "Electromagnetically induced vibration of particles in a binder"

CUBE, SITES = 0.2, 7
"""Side of the array, m, and particles along it (Z13 section 4)."""
DENSITY, RADIUS, CHARGE = 2000.0, 0.005, 1.0
"""The particles' density, kg/m^3, radius, m, and charge, C (Z13 section 4)."""
FLUX, FIELD, STIFFNESS = 1.0, 0.1, 0.5
"""The fields B_3, T, and E_0, N/C, and the stiffness k of the tethers, N/m (Z13 section 4)."""
ATTRACTION, REPULSION = 2.0, 1.0
"""The near field: alpha_1, N m, and alpha_2, N m^2, with exponents 1 and 2 (Z13 section 4)."""
RATIOS = (0.1, 0.2, 0.4, 0.8, 1.0, 1.2, 1.4, 1.8)
"""The drive frequencies of Z13 Fig. 3 over the cyclotron frequency, Omega/w."""

MASS = DENSITY * 4 / 3 * np.pi * RADIUS**3
CYCLOTRON = CHARGE * FLUX / MASS
"""w = q B/m: 954.930 1/s. Z13 prints 1819.385 1/s for the same data, which is wrong."""
SPACING = CUBE / (SITES - 1)

SEARCH_SETTINGS = {
    "generations": 20, "options": {"population": 8},
}  # fmt: skip

SIZES = {
    "alone": Size("343 particles without interaction, 0.05 s", {"near_field": "none", "duration": 0.05}),
    "default": Size("343 particles, near field as printed, 0.005 s", {}, SEARCH_SETTINGS),
    "equilibrium": Size(
        "343 particles, near field in equilibrium with the six neighbours, 0.05 s",
        {"near_field": "equilibrium", "duration": 0.05},
    ),
}


def near_fields(name: str) -> tuple[NearField, ...]:
    """Return no near field, the printed one, or one between neighbours only that is in equilibrium at their
    distance."""
    if name == "none":
        return ()
    if name == "printed":
        return (NearField(alpha1=ATTRACTION, beta1=1, alpha2=REPULSION, beta2=2),)
    balanced = ATTRACTION * SPACING
    return (TruncatedNearField(alpha1=ATTRACTION, beta1=1, alpha2=balanced, beta2=2, cutoff=1.3 * SPACING),)


def scene(
    ratio: float = 0.8,
    near_field: str = "printed",
    duration: float = 0.005,
    sites: int = SITES,
    error: float = 1e-6,
    seed: int = 0,
    flux: float = FLUX,
    stiffness: float = STIFFNESS,
    longest: float = 1e-4,
    observed: bool = False,
) -> Scene:
    """Return the array, driven at Omega = ratio w, with w of the paper's B.

    error : largest error of a step, relative to the displacement in it.
    observed : whether the largest displacement of the centre of gravity is recorded.
    """
    return Scene(
        name="vibration",
        particles=Cloud(
            radius=RADIUS,
            density=DENSITY,
            placement=Lattice(shape=(sites,) * 3, spacing=SPACING),
            quantities={"charge": CHARGE},
        ),
        effects=(
            Lorentz(),
            ElectricField(amplitude=(FIELD, 0.0, 0.0), omega=(ratio * CYCLOTRON, 0.0, 0.0)),
            MagneticField(constant=(0.0, 0.0, flux)),
            Tether(stiffness=(stiffness,) * 3),
            *near_fields(near_field),
            *((PeakDisplacement(),) if observed else ()),
        ),
        stepper=Trapezoid(
            control=ErrorControl(error=error, tolerance=error / 10, first=1e-7, longest=longest)
        ),
        duration=duration,
        seed=seed,
    )


def scene_for(size: str, seed: int) -> Scene:
    """Return the array of a size; nothing in it is random."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
