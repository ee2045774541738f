"""The inverse problems of blast: the field, or the field and the fluid, that give a target ellipsoid.

A uniform field makes the cloud an ellipsoid of revolution about the field. The direction of the field is
therefore the long axis of the target, up to sign, and its strength follows from the half axes.

- "ellipsoid": the cloud without drag after DURATION. Genes are the components of the field.
- "rest": the cloud at rest, stopped by Stokes drag. Genes are the components of the field and the viscosity
  of the fluid, which both follow from the half axes in closed form (``shape.strength_and_tau``).

By default, the target is the ellipsoid that TARGET_FLUX, or REST_TARGET, gives in closed form, and the search
must find that design.
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass

import numpy as np

from tisim import Result, Scene
from tisim.cases.blast import scene as blast
from tisim.cases.blast.closed_forms import relaxation_time, viscosity_for
from tisim.cases.blast.shape import at_rest, ball, ellipsoid, moments, principal_half_axes, strength_and_tau
from tisim.cases.case import size_named
from tisim.errors import must
from tisim.optimize import Gene, Genome, Problem
from tisim.plotting.cloud import cloud

TARGET_FLUX = np.array([0.6, 0.3, -0.2])
"""The field that the search must find, T. Within DURATION, particles complete a third of a circle in it."""
DURATION = 0.3
"""The simulated time after which the cloud has the target shape, s."""
GENES = tuple(Gene(f"flux_{axis}", "T", -1.0, 1.0) for axis in "xyz")

REST_TARGET = {"flux_x": 0.15, "flux_y": 0.1, "flux_z": -0.05, "viscosity": blast.REST_VISCOSITY}
"""The design that the search for an ellipsoid at rest must find: w tau = 1.87."""
REST_GENES = (
    *(Gene(f"flux_{axis}", "T", -0.3, 0.3) for axis in "xyz"),
    # Relaxation times from 0.2 to 3.9 s.
    Gene("viscosity", "Pa s", 1.0, 20.0, "log"),
)
REST_DURATION = 40.0
"""The simulated time of a search for an ellipsoid at rest, s: ten relaxation times of the thinnest fluid."""


def field(design: Mapping[str, float]) -> np.ndarray:
    """Return the magnetic flux density of a design, T, shape (3,)."""
    return np.array([design[gene.name] for gene in GENES])


def scene(design: Mapping[str, float], seed: int, number: int = blast.NUMBER) -> Scene:
    """Return the blast without interaction in the field of a design, until DURATION.

    Steps of 5 ms deviate from the exact circle by at most 1 part in 1000, (w dt)^2/12.
    """
    return blast.scene(field(design), number=number, duration=DURATION, seed=seed, first=5e-3, longest=5e-3)


def rest_scene(design: Mapping[str, float], seed: int, number: int = blast.NUMBER) -> Scene:
    """Return the blast in the field and the fluid of a design, until it is at rest.

    Steps of 0.4 s are coarse, but the trapezoidal rule finds the place of rest exactly: both forces are
    linear in v, m dv/dt = -A v, so its displacement is A^-1 m (v_0 - v) for steps of any length.
    """
    return blast.scene(
        field(design), number=number, duration=REST_DURATION, seed=seed, viscosity=design["viscosity"],
        first=0.4, longest=0.4,
    )  # fmt: skip


def misfit(tensor: np.ndarray, target: np.ndarray) -> float:
    """Return |S - S_target|/|S_target| of second moments (Frobenius norm)."""
    return float(np.linalg.norm(tensor - target) / np.linalg.norm(target))


def start(number: int, starts: int = 8) -> float:
    """Return the half axis (m) of the ball filled by ``number`` particles at the start, a mean over random
    starts.

    Centres are at least one radius inside the ball that contains the spheres; random addition makes the
    density slightly higher near its surface.
    """
    scenes = [blast.scene(number=number, seed=seed) for seed in range(starts)]
    return float(np.mean([ball(moments(s.particles.arrays(s.domain, s.seed))) for s in scenes]))


@dataclass(frozen=True)
class Variant:
    """An inverse problem of the case.

    name : of the problem, with {} for the size. when : the time at which the cloud has the target shape.
    wanted : description of the design that is searched. target : second moments (m^2, (3, 3)) of the default
    target, from the half axis (m) of the ball at the start. more : further details of a design, from the
    design, the second moments of the target, and that half axis.
    """

    name: str
    when: str
    wanted: str
    genes: tuple[Gene, ...]
    scene: Callable[[Mapping[str, float], int, int], Scene]
    target: Callable[[float], np.ndarray]
    more: Callable[[Mapping[str, float], np.ndarray, float], dict[str, float]] = lambda *_: {}


def fluid(design: Mapping[str, float], target: np.ndarray, ball: float) -> dict[str, float]:
    """Return the viscosity of a design, and field and viscosity of the target in closed form."""
    longest, second, _ = principal_half_axes(target)
    strength, tau = strength_and_tau(longest, second, ball)
    return {
        "strength of the field wanted, T": strength,
        "viscosity, Pa s": design["viscosity"],
        "viscosity wanted, Pa s": float(viscosity_for(tau, blast.DENSITY, blast.RADIUS)),
    }


def rest_target(ball: float) -> np.ndarray:
    """Return the second moments of REST_TARGET at rest, m^2, shape (3, 3). ball : its half axis, m."""
    tau = float(relaxation_time(REST_TARGET["viscosity"], blast.DENSITY, blast.RADIUS))
    return at_rest(field(REST_TARGET), tau, ball)


VARIANTS = {
    "ellipsoid": Variant(
        "blast-{}", f"after {DURATION} s", "the field", GENES, scene,
        lambda ball: ellipsoid(TARGET_FLUX, DURATION, ball),
    ),
    "rest": Variant(
        "blast-rest-{}", "at rest", "the field and the viscosity", REST_GENES, rest_scene, rest_target, fluid
    ),
}  # fmt: skip
"""The inverse problems: a target shape of the cloud after some time, or at rest."""


def problem(size: str = "default", variant: str = "ellipsoid", goal: np.ndarray | None = None) -> Problem:
    """Return the problem of finding the design that gives an ellipsoid of second moments ``goal`` (m^2, (3,
    3)).

    Without ``goal``, the target is the ellipsoid of TARGET_FLUX or of REST_TARGET.
    """
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    one = VARIANTS[variant]
    number = int(size_named(size, blast.SIZES).scene.get("number", blast.NUMBER))
    radius = start(number)
    target = one.target(radius) if goal is None else goal
    axes = ", ".join(f"{a:.3f}" for a in principal_half_axes(target))
    return Problem(
        name=one.name.format(size),
        title=f"{blast.TITLE}: half axes of {axes} m {one.when}",
        description=f"{one.wanted} that gives an ellipsoid with half axes of {axes} m {one.when}",
        genome=Genome(one.genes),
        scene=lambda design, seed: one.scene(design, seed, number),
        objective=lambda result: misfit(moments(result.state), target),
        symbol="misfit",
        meanings={"misfit": "|S - S*|/|S*| of second moments S of the cloud, S* the target"},
        picture=lambda scene, result: cloud(result),
        details=lambda design, result: {
            **details(design, result, target), **one.more(design, target, radius)
        },
    )  # fmt: skip


def details(design: Mapping[str, float], result: Result, target: np.ndarray) -> dict[str, float]:
    """Return the target and simulated half axes, and the angle between the field and the target's long
    axis."""
    result_moments = moments(result.state)
    axis = np.linalg.eigh(target)[1][:, -1]
    flux = field(design)
    values: dict[str, float] = {}
    for k, (a, b) in enumerate(
        zip(principal_half_axes(target), principal_half_axes(result_moments), strict=True), start=1
    ):
        values[f"half axis {k} wanted, m"], values[f"half axis {k} reached, m"] = float(a), float(b)
    cosine = abs(flux @ axis) / np.linalg.norm(flux)
    values["field to the long axis wanted, degrees"] = float(np.degrees(np.arccos(min(1.0, cosine))))
    values["strength of the field, T"] = float(np.linalg.norm(flux))
    return values
