"""A blast of charged particles in air and a magnetic field (Z16).

Z16 is T. I. Zohdi, Comput. Methods Appl. Mech. Engrg. 308 (2016) 47-72. Spheres packed at random in a ball
start with the same speed away from its centre. Without a field the cloud stays a sphere. With a field along x
the particles circle about it, at a distance of at most 3 cm, and the cloud becomes an ellipsoid along the
field.

Z16 (6.3) gives 56504.7 for the ratio of magnetic force to drag at the start. With the air density stated in
the paper, 1.225 kg/m^3, the ratio is 46126.3 (1 kg/m^3 gives 56504.8).
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tisim import Blast, Cloud, RandomInBall, Scene
from tisim.cases.case import Size, size_named
from tisim.effects import (
    ChowDrag,
    Contact,
    ContactDissipation,
    ContactFriction,
    ContactSoftening,
    Effect,
    Lorentz,
    NearField,
    TruncatedNearField,
)
from tisim.sources import MagneticField
from tisim.steppers import IterationControl, Trapezoid

TITLE = "A blast of charged particles in a magnetic field"

NUMBER, RADIUS, DENSITY, BALL = 2000, 0.05, 7000.0, 1.0
"""Number of particles, their radius (m) and density (kg/m^3), radius of the ball at the start (m) (Z16
section 6.1)."""
ENERGY, FLUX, SPECIFIC_CHARGE = 1e4, 10.0, 10.0
"""Energy W of the blast (J), field B along x (T), charge per mass (C/kg) (Z16 section 6.1)."""
AIR, VISCOSITY = 1.225, 1.8e-5
"""Density of air, kg/m^3, and its viscosity, Pa s (Z16 sections 4.2 and 6.1)."""
MASS = DENSITY * 4 / 3 * np.pi * RADIUS**3
SPEED = float(np.sqrt(2 * ENERGY / (NUMBER * MASS)))
"""The initial speed of every particle, m/s (Z16 3.4)."""

NEIGHBOURS = 3 * RADIUS
"""Cut-off distance of the near field in the size "clumps", m: half a diameter between surfaces."""

SEARCH_SETTINGS = {
    "generations": 24, "ensemble": {"confirm": 8},
}  # fmt: skip

SIZES = {
    "small": Size("500 particles without interaction, 1 s", {"number": 500}, SEARCH_SETTINGS),
    "default": Size("2000 particles without interaction, 1 s, in the field", {}, SEARCH_SETTINGS),
    "no_field": Size("the same without the field", {"flux": 0.0}),
    "contact": Size("2000 particles with contact, 1 s", {"contact": True}),
    "contact_no_field": Size("the same without the field", {"contact": True, "flux": 0.0}),
    "near_field": Size(
        "2000 particles with contact and the printed near field of all pairs; some minutes",
        {"contact": True, "near": True},
    ),
    "clumps": Size(
        "2000 particles with contact and the near field of neighbours only",
        {"contact": True, "near": True, "cutoff": NEIGHBOURS},
    ),
    "clumps_no_field": Size(
        "the same without the field",
        {"contact": True, "near": True, "cutoff": NEIGHBOURS, "flux": 0.0},
    ),
}


def interaction(contact: bool, near: bool, cutoff: float | None = None) -> tuple[Effect, ...]:
    """Return the effects of contact and of the near field of Z16 section 9.

    The near field acts only on pairs within ``cutoff`` (m), if given. Bonds (7.16) are left out because the
    paper gives no strain at which they form; ``contact_bond`` adds them.
    """
    touching = (
        Contact(stiffness=1e7, exponent=2),
        ContactSoftening(sensitivity=1.0, reference_temperature=500.0, floor=1e6),
        ContactDissipation(damping=1e5),
        ContactFriction(stiffness=1e7, static=0.4, dynamic=0.3),
    )
    law: dict[str, Any] = {"alpha1": 0.5, "beta1": 1, "alpha2": 0.01, "beta2": 2, "strength": "mass"}
    field = NearField(**law) if cutoff is None else TruncatedNearField(**law, cutoff=cutoff)
    return (*(touching if contact else ()), *((field,) if near else ()))


def scene(
    flux: float | ArrayLike = FLUX,
    contact: bool = False,
    near: bool = False,
    cutoff: float | None = None,
    number: int = NUMBER,
    duration: float = 1.0,
    seed: int = 0,
    **control: Any,
) -> Scene:
    """Return the blast. flux : along x, or of shape (3,), T.

    A smaller ``number`` keeps the speed and the density. ``control`` is passed to the step control of the
    papers.
    """
    b = np.asarray(flux, float)
    return Scene(
        name="blast",
        particles=Cloud(
            number=number,
            radius=RADIUS,
            density=DENSITY,
            placement=RandomInBall(radius=BALL * (number / NUMBER) ** (1 / 3)),
            pulse=Blast(energy=ENERGY * number / NUMBER),
            specific_charge=SPECIFIC_CHARGE,
        ),
        effects=(
            Lorentz(),
            MagneticField(constant=tuple(b.tolist()) if b.ndim else (float(b), 0.0, 0.0)),
            ChowDrag(density=AIR, viscosity=VISCOSITY),
            *interaction(contact, near, cutoff),
        ),
        stepper=Trapezoid(control=IterationControl(**control)),
        duration=duration,
        seed=seed,
    )


def scene_for(size: str, seed: int) -> Scene:
    """Return the blast of a size, from the random start of a seed."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
