"""The inverse problem of blast: the magnetic field that gives a target ellipsoid.

A uniform field makes the cloud an ellipsoid of revolution about the field. The direction of the field is
therefore the long axis of the target, up to sign, and its strength follows from the other half axes. By
default, the target is the ellipsoid that TARGET_FLUX gives in closed form, and the search must find that
field.
"""

from collections.abc import Mapping

import numpy as np

from tisim import Result, Scene
from tisim.cases.blast import scene as blast
from tisim.cases.blast.shape import ball, ellipsoid, moments, principal_half_axes
from tisim.cases.case import size_named
from tisim.errors import must
from tisim.optimize import Gene, Genome, Problem
from tisim.plotting.cloud import cloud

VARIANTS = ("ellipsoid",)
"""The inverse problems: a target shape of the cloud."""
TARGET_FLUX = np.array([0.6, 0.3, -0.2])
"""The field that the search must find, T. Within DURATION, particles complete a third of a circle in it."""
DURATION = 0.3
"""The simulated time after which the cloud has the target shape, s."""
GENES = tuple(Gene(f"flux_{axis}", "T", -1.0, 1.0) for axis in "xyz")


def field(design: Mapping[str, float]) -> np.ndarray:
    """Return the magnetic flux density of a design, T, shape (3,)."""
    return np.array([design[gene.name] for gene in GENES])


def scene(design: Mapping[str, float], seed: int, number: int = blast.NUMBER) -> Scene:
    """Return the blast without interaction in the field of a design, until DURATION.

    Steps of 5 ms deviate from the exact circle by at most 1 part in 1000, (w dt)^2/12.
    """
    return blast.scene(field(design), number=number, duration=DURATION, seed=seed, first=5e-3, longest=5e-3)


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


def problem(size: str = "default", variant: str = "ellipsoid", goal: np.ndarray | None = None) -> Problem:
    """Return the problem of finding the field that gives an ellipsoid of second moments ``goal`` (m^2, (3,
    3)).

    Without ``goal``, the target is the ellipsoid of TARGET_FLUX.
    """
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    number = int(size_named(size, blast.SIZES).scene.get("number", blast.NUMBER))
    target = ellipsoid(TARGET_FLUX, DURATION, start(number)) if goal is None else goal
    axes = ", ".join(f"{a:.3f}" for a in principal_half_axes(target))
    return Problem(
        name=f"blast-{size}",
        title=f"{blast.TITLE}: half axes of {axes} m after {DURATION} s",
        description=f"the field that gives an ellipsoid with half axes of {axes} m",
        genome=Genome(GENES),
        scene=lambda design, seed: scene(design, seed, number),
        objective=lambda result: misfit(moments(result.state), target),
        symbol="misfit",
        meanings={"misfit": "|S - S*|/|S*| of second moments S of the cloud, S* the target"},
        picture=lambda scene, result: cloud(result),
        details=lambda design, result: details(design, result, target),
    )


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
