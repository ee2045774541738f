"""A blast of charged particles in air and a magnetic field (Z16).

Z16 is T. I. Zohdi, Comput. Methods Appl. Mech. Engrg. 308 (2016) 47-72. Spheres packed at random in a ball
start with the same speed away from its centre. Without a field the cloud stays a sphere. With a field along x
the particles circle about it, at a distance of at most 3 cm, and the cloud becomes an ellipsoid along the
field.

The stages of Z16 section 3.2 end with particles at rest, in a stationary ellipsoid. In air this takes days,
and kilometres without a field. The size "rest" has Stokes drag (appendix A) in a viscous fluid, in which the
speed falls to 1/e in 1 s, and a field in which w = q B/m is 2 1/s.

Z16 (6.3) gives 56504.7 for the ratio of magnetic force to drag at the start. With the air density stated in
the paper, 1.225 kg/m^3, the ratio is 46126.3 (1 kg/m^3 gives 56504.8).
"""

from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from tisim import Blast, Cloud, Particles, RandomInBall, Result, Scene
from tisim.cases.blast.closed_forms import viscosity_for
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
    StokesDrag,
    TruncatedNearField,
)
from tisim.operators import AtRest
from tisim.packing import EqualSizes, GrainClass
from tisim.sources import MagneticField
from tisim.steppers import Collocation, IterationControl, StageControl, Stepper, Trapezoid

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

TAU, REST_FLUX = 1.0, 0.2
"""The size "rest": relaxation time of the particles (s), and the field along x (T); w tau = q B tau/m = 2."""
REST_VISCOSITY = float(viscosity_for(TAU, DENSITY, RADIUS))
"""The viscosity that gives this relaxation time, Pa s: about three times as viscous as glycerol (Z16 A.4)."""
REST: dict[str, Any] = {"viscosity": REST_VISCOSITY, "duration": 10.0 * TAU, "first": 0.02, "longest": 0.02}
"""Settings of the size "rest" in any field: Stokes drag until 5e-5 of the speed are left, and its steps (s).
"""

MIXED_FLUX = 0.5
"""The field of the size "mixed", T: particles turn by 1.5 radians in its 0.3 s."""

NEIGHBOURS = 3 * RADIUS
"""Cut-off distance of the near field in the size "clumps", m: half a diameter between surfaces."""

NEAR_FIELD: dict[str, Any] = {"alpha1": 0.5, "beta1": 1, "alpha2": 0.01, "beta2": 2, "strength": "mass"}
"""The near field of Z16 section 9, with (7.23)."""
PAIR_ATTRACTION = MASS**2 * (
    NEAR_FIELD["alpha1"] / (2 * RADIUS) ** NEAR_FIELD["beta1"] - NEAR_FIELD["alpha2"] / (2 * RADIUS) ** NEAR_FIELD["beta2"]
)
"""The near field of two touching particles, N."""
RELAXATION: dict[str, Any] = {"contact": True, "near": True, "relaxes": True, "duration": 30.0}
"""Settings of a ball that relaxes before the blast; contact dissipates its energy."""

SEARCH_SETTINGS = {
    "generations": 24, "ensemble": {"confirm": 8},
}  # fmt: skip

SIZES = {
    "small": Size("500 particles without interaction, 1 s", {"number": 500}, SEARCH_SETTINGS),
    "default": Size("2000 particles without interaction, 1 s, in the field", {}, SEARCH_SETTINGS),
    "no_field": Size("the same without the field", {"flux": 0.0}),
    "rest": Size(
        "2000 particles with Stokes drag in a weak field, 10 s, until they are at rest",
        {**REST, "flux": REST_FLUX},
    ),
    "mixed": Size(
        "2000 particles of either sign of charge without interaction, 0.3 s, in a weak field",
        {"mixed": True, "flux": MIXED_FLUX, "duration": 0.3, "first": 5e-3, "longest": 5e-3},
    ),
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
    "relaxation": Size(
        "2000 particles before the blast, that relax by contact and the near field of neighbours to rest",
        {**RELAXATION, "cutoff": NEIGHBOURS},
    ),
}


OF_ONE_SIGN: dict[str, Any] = {"radius": RADIUS, "density": DENSITY, "specific_charge": SPECIFIC_CHARGE}
OF_EITHER_SIGN: dict[str, Any] = {
    "grains": tuple(
        GrainClass(sizes=EqualSizes(radius=RADIUS), density=DENSITY, quantities={"charge": charge})
        for charge in (MASS * SPECIFIC_CHARGE, -MASS * SPECIFIC_CHARGE)
    )
}
"""The particles of Z16 section 6.1, and of its remark 1 of section 3.2: half of them with the opposite
charge."""


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
    field = NearField(**NEAR_FIELD) if cutoff is None else TruncatedNearField(**NEAR_FIELD, cutoff=cutoff)
    return (*(touching if contact else ()), *((field,) if near else ()))


def scene(
    flux: float | ArrayLike = FLUX,
    contact: bool = False,
    near: bool = False,
    cutoff: float | None = None,
    number: int = NUMBER,
    duration: float = 1.0,
    seed: int = 0,
    viscosity: float | None = None,
    mixed: bool = False,
    relaxes: bool = False,
    start: Result | None = None,
    energy: float = ENERGY,
    **control: Any,
) -> Scene:
    """Return the blast. flux : along x, or of shape (3,), T.

    A smaller ``number`` keeps the speed and the density. With a ``viscosity`` (Pa s) the drag is Stokes drag,
    otherwise Chow's in air. If ``mixed``, each particle has one sign of charge or the other, at random (Z16
    3.2). If it ``relaxes``, there is no blast and no field: particles start at rest, and the run ends when
    they are at rest again (Z16 9). start : a ball that has relaxed, which is blasted in place of a random
    one. energy : of the blast of 2000 particles, J. ``control`` is passed to the step control of the papers.
    """
    b = np.asarray(flux, float)
    blast = Blast(energy=energy * number / NUMBER)
    cloud = Cloud(
        number=number,
        **(OF_EITHER_SIGN if mixed else OF_ONE_SIGN),
        placement=RandomInBall(radius=BALL * (number / NUMBER) ** (1 / 3)),
        pulse=None if relaxes else blast,
    )
    field = MagneticField(constant=tuple(b.tolist()) if b.ndim else (float(b), 0.0, 0.0))
    return Scene(
        name="relaxation" if relaxes else "blast",
        particles=cloud if start is None else blasted(start, blast),
        effects=(
            *(() if relaxes else (Lorentz(), field)),
            ChowDrag(density=AIR, viscosity=VISCOSITY)
            if viscosity is None
            else StokesDrag(viscosity=viscosity),
            *interaction(contact, near, cutoff),
            *((AtRest(time=0.1, reference_acceleration=PAIR_ATTRACTION / MASS),) if relaxes else ()),
        ),
        stepper=Trapezoid(control=IterationControl(**control)),
        duration=duration,
        seed=seed,
    )


def blasted(relaxed: Result, blast: Blast) -> Particles:
    """Return the particles of a ball that has relaxed, with the pulse of a blast (Z16 3.3)."""
    state = relaxed.state
    pulse = blast.velocity(state["position"], state["mass"])
    return Particles(
        position=state["position"],
        velocity=state["velocity"] + pulse,
        radius=state["radius"],
        mass=state["mass"],
        quantities={
            "charge": SPECIFIC_CHARGE * state["mass"],
            **{name: state[name] for name in ("spin", "temperature") if name in state},
        },
    )


def rays(directions: ArrayLike, effects: tuple[Effect, ...], duration: float, stepper: Stepper) -> Scene:
    """Return particles that start from one point at the speed of the blast, along ``directions``, (n, 3).

    Without a cloud around it, each follows the closed forms of one particle.
    """
    n = np.asarray(directions, float)
    return Scene(
        name="rays",
        particles=Particles(
            position=np.zeros_like(n),
            velocity=SPEED * n / np.linalg.norm(n, axis=1)[:, None],
            radius=RADIUS,
            density=DENSITY,
            quantities={"charge": np.full(len(n), SPECIFIC_CHARGE * MASS)},
        ),
        effects=effects,
        stepper=stepper,
        duration=duration,
    )


def resting_rays(duration: float) -> Scene:
    """Return particles from one point along axes and diagonals, in the field and the fluid of the size
    "rest", with errors near rounding."""
    corners = np.array(np.meshgrid(*[(-1.0, 0.0, 1.0)] * 3)).reshape(3, -1).T
    effects = (
        Lorentz(),
        MagneticField(constant=(REST_FLUX, 0.0, 0.0)),
        StokesDrag(viscosity=REST_VISCOSITY),
    )
    accurate = Collocation(control=StageControl(error=1e-10, longest=0.5 * TAU))
    return rays(corners[corners.any(axis=1)], effects, duration, accurate)


def scene_for(size: str, seed: int) -> Scene:
    """Return the blast of a size, from the random start of a seed."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
