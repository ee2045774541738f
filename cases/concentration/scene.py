"""Magnetic colloids in a concentration at which they form chains, attracted to a fibre (B16 section 6.4.6).

Particles of B16 table 6.1 start in a cube 100 um beyond the end of a cylinder of L/D = 20, above its rim. The
forces on a particle are the pull of the cylinder, dipole-dipole forces within 30 radii, and Mie(30, 15)
repulsion for hard spheres with eps = 100 k T. Some sizes include hydrodynamic interaction. The size ``paper``
has dipole forces between all pairs: most of its particles start within 30 radii of each other, and a sum over
all pairs takes a fifth of the time of one over a list.

The paper's side of the cube, cbrt(rho V_p / c), leaves out N; here it is cbrt(N rho V_p / c), so that N
particles have the concentration c. The paper gives c in g/mL, and in the caption of Fig. 6.13 in mg/L; here
it is g/mL. 2 g/mL is a volume fraction of 0.4. The centres of the spheres are inside the cube; the spheres
may extend beyond it.

Contacts limit the step, not the cylinder: in one step noise moves a particle by DIFFUSION radii, and forces
by DRIFT radii. The distance of two bound particles of 75 nm then fluctuates by 0.03 of a diameter. With steps
of a third it fluctuates by 0.008. With three times the step it is 0.09; the chains still hold together and
are captured no later (``coarse``).
"""

from typing import Any

import numpy as np
from scipy.constants import Boltzmann, mu_0

from tisim import Cloud, RandomInBox, Scene
from tisim.cases.case import Size, size_named
from tisim.cases.common import magnetic_fibre as b16
from tisim.effects import DipoleDipole, FixedMoment, Magnetophoresis, Mie, TruncatedDipoleDipole
from tisim.operators import Capture
from tisim.sources import MagneticCylinders, MagneticField
from tisim.steppers import Brownian, DriftLimit

DENSITY = 5000.0
"""The density of particles, kg/m^3 (B16 section 6.4.6)."""
ASPECT, DISTANCE, CUTOFF = 20.0, 100e-6, 30.0
"""The cylinder's L/D; the distance from its end to the cube, m; the cut-off of dipole forces, radii."""
WELL = 100 * Boltzmann * b16.WATER_TEMPERATURE
"""The depth eps of the Mie potential, J."""
DRIFT, DIFFUSION = 0.05, 0.03
"""Largest displacement of a particle in a step, in radii: by forces, and by noise (standard deviation)."""
FIELD_DIGITS = 5
"""Number of digits in the table of the cylinder's field."""

PAPER: dict[str, Any] = {
    "number": 500, "hydrodynamics": "rotne-prager", "duration": 0.5, "coarse": 3.0, "cutoff": np.inf,
}  # fmt: skip
SIZES = {
    "default": Size("64 particles of 75 nm at 0.5 g/mL above a transverse cylinder, 10 ms", {}),
    "25nm": Size("the same with 25 nm, which form no chains, 2 ms", {"nanometres": 25, "duration": 2e-3}),
    "flow": Size(
        "24 particles of 75 nm with hydrodynamic interaction, until some are captured",
        {"number": 24, "hydrodynamics": "rotne-prager", "duration": 0.3, "coarse": 3.0},
    ),
    "paper": Size("500 of these, 0.5 s, as in B16; takes an hour", PAPER),
    "paper-longitudinal": Size("the same beyond a longitudinal cylinder", {**PAPER, "angle": 0.0}),
}


def side(number: int, radius: float, concentration: float) -> float:
    """Return the side of the cube (m), d = cbrt(N rho V_p / c), for spheres of a radius (m) at c g/mL, 1000
    kg/m^3."""
    volume = 4 / 3 * np.pi * radius**3
    return float(np.cbrt(number * DENSITY * volume / (1e3 * concentration)))


def coupling(nanometres: int) -> float:
    """Return Gamma = mu_0 mu^2 / (2 pi d^3 k T), d the diameter (B16 Eq. 6.25)."""
    moment, diameter = b16.SATURATION_MOMENTS[nanometres], 2e-9 * nanometres
    return float(mu_0 * moment**2 / (2 * np.pi * diameter**3 * Boltzmann * b16.WATER_TEMPERATURE))


def chain_length(nanometres: int, concentration: float) -> float:
    """Return n = sqrt(phi e^(Gamma - 1)), phi = c / rho: particles of a chain in equilibrium (B16 Eq.
    6.26)."""
    return float(np.sqrt(1e3 * concentration / DENSITY) * np.exp((coupling(nanometres) - 1) / 2))


def longest(radius: float, coarse: float = 1.0) -> float:
    """Return the step (s) in which a sphere of a radius (m) diffuses by ``coarse`` DIFFUSION radii.

    A longer step can push particles far into each other before the repulsion acts. With ``coarse`` of 5,
    particles of 25 nm at 2 g/mL soon overlap so deeply that no step is short enough; with 3 they do not.
    """
    drag = 6 * np.pi * b16.WATER_VISCOSITY * radius
    return float((coarse * DIFFUSION * radius) ** 2 * drag / (2 * Boltzmann * b16.WATER_TEMPERATURE))


def scene(
    nanometres: int = 75,
    concentration: float = 0.5,
    angle: float = 90.0,
    number: int = 64,
    duration: float = 0.01,
    hydrodynamics: str = "none",
    distance: float = DISTANCE,
    coarse: float = 1.0,
    cutoff: float = CUTOFF,
    seed: int = 0,
) -> Scene:
    """Return a cube of particles at c g/mL beyond the end of a cylinder at an angle (degrees) to the field.

    distance : between the cube and the end, m. coarse : factor on the displacements in a step by noise and
    forces. cutoff : of dipole forces, in radii; infinity for all pairs.
    """
    dipoles = TruncatedDipoleDipole(cutoff=cutoff) if np.isfinite(cutoff) else DipoleDipole()
    body = b16.fibre(angle, ASPECT)
    radius = nanometres * 1e-9
    half = side(number, radius, concentration) / 2
    axis = np.asarray(body.direction)
    # Above the point of the rim that is nearest to the direction of the field.
    outward = np.array([axis[2], 0.0, -axis[0]])
    centre = (body.length / 2 + distance + half) * axis + body.radius * outward
    low, high = centre - half - radius, centre + half + radius
    return Scene(
        name="concentration",
        particles=Cloud(
            number=number,
            radius=radius,
            density=DENSITY,
            placement=RandomInBox(low=tuple(low.tolist()), high=tuple(high.tolist())),
            quantities={"saturation_moment": b16.SATURATION_MOMENTS[nanometres]},
        ),
        effects=(
            MagneticField(constant=(b16.APPLIED_FLUX, 0.0, 0.0)),
            MagneticCylinders(cylinders=(body,), table_digits=FIELD_DIGITS),
            FixedMoment(),
            Magnetophoresis(),
            dipoles,
            Mie(epsilon=WELL),
            Capture(),
        ),
        stepper=Brownian(
            temperature=b16.WATER_TEMPERATURE,
            viscosity=b16.WATER_VISCOSITY,
            hydrodynamics=hydrodynamics,
            noise="exact" if hydrodynamics == "none" else "fast",
            control=DriftLimit(longest=longest(radius, coarse), shortest=1e-12, drift=coarse * DRIFT),
        ),
        duration=duration,
        seed=seed,
    )


def scene_for(size: str, seed: int) -> Scene:
    """Return a sample of a size, from the random start of a seed."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
