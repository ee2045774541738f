"""The inverse problem of mrf_shear: find the fluid with the highest stress in a field and a low viscosity
without it.

A design is the volume share of the small grains, the volume fraction of all grains, and the field. More
grains increase the stress, and also the viscosity when the field is off; small grains fill the holes among
large ones. The stress is simulated at one shear rate, at which drag is small compared with magnetic forces,
so it is close to the yield stress. The viscosity without field is computed, not simulated.
"""

from collections.abc import Mapping, Sequence

import numpy as np

from tisim import Cloud, Result, Scene
from tisim.cases.case import searched_size
from tisim.cases.common.magnetorheological_fluid import SWEPT, closest_packing, relative_viscosity
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.measures import extent, flux, shear_stress, volume_fraction
from tisim.cases.mrf_shear.scene import LARGE_RADIUS, SEARCHED, SIZES, SMALL_RADIUS, TITLE, mixture, scene
from tisim.errors import must
from tisim.optimize import Gene, Genome, Objective, Problem
from tisim.plotting.cloud import cloud

VARIANTS = ("front", "bounded", "field")
GENES = (
    Gene("small", "of grains", 0.0, 0.6),
    Gene("fraction", "of volume", 0.15, 0.34),
    Gene("flux", "T", 0.2, 0.8),
)
BOUND = 24e-3
"""Largest off-state viscosity in the variant "bounded", Pa s."""
WANTED = {
    "front": "the front of shear stress in the field and viscosity without it",
    "bounded": f"the highest shear stress of fluids of at most {1e3 * BOUND:g} mPa s without field",
    "field": "the front of shear stress, viscosity without field, and field",
}
"""The goal of each variant of the problem."""
MEANINGS = {
    "stress": "shear stress in the field, the mean over a strain",
    "viscosity": "viscosity without field, by Krieger and Dougherty",
    "small": "volume share of the small grains",
    "fraction": "volume fraction of the grains",
}


def design_viscosity(small: float, fraction: float) -> float:
    """Return the viscosity without field of a design, Pa s."""
    return off_state_viscosity(fraction, (2 * LARGE_RADIUS, 2 * SMALL_RADIUS), (1 - small, small))


def viscosity(result: Result) -> float:
    """Return the viscosity without field of the fluid of a run, Pa s, from the nominal sizes of its
    grains."""
    start = start_of(result)
    diameters = [2 * one.sizes.mean_radius() for one in start.grains]
    return off_state_viscosity(nominal_fraction(result), diameters, [one.share for one in start.grains])


def nominal_fraction(result: Result) -> float:
    """Return the nominal volume fraction of the grains of a run: the mean over all starts."""
    start, volume = start_of(result), float(extent(result.scene.domain).prod())
    each = sum(one.share / one.density for one in start.grains) / sum(one.number() for one in start.grains)
    return start.count() * each / volume


def start_of(result: Result) -> Cloud:
    """Return the initial particles of a cell."""
    particles = result.scene.particles
    assert isinstance(particles, Cloud)
    return particles


LARGE_STRESS = Objective("stress", shear_stress, "Pa", maximise=True)
LOW_VISCOSITY = Objective("viscosity", viscosity, "Pa s")
OBJECTIVES = {
    "front": (LARGE_STRESS, LOW_VISCOSITY),
    "bounded": (LARGE_STRESS,),
    "field": (LARGE_STRESS, LOW_VISCOSITY, Objective("field", flux, "T")),
}


def problem(size: str = "default", variant: str = "front") -> Problem:
    """Return the search for fluids of a variant.

    The variants are the front of stress and viscosity, the highest stress at a bounded viscosity, and the
    front of stress, viscosity and field.
    """
    must(variant in VARIANTS, "variant", f"one of {', '.join(VARIANTS)}", variant)
    settings = {**searched_size(size, SIZES).scene, **SEARCHED}

    def designed(design: Mapping[str, float], seed: int) -> Scene:
        small, fraction = design["small"], design["fraction"]
        thick = design_viscosity(small, fraction)
        allowed = BOUND if variant == "bounded" else np.inf
        must(thick <= allowed, "viscosity of the design", f"at most {BOUND:g} Pa s", thick)
        grains = mixture(small)
        made = scene(flux=design["flux"], grains=grains, fraction=fraction, seed=seed, **settings)
        return made.replace(SWEPT)

    return Problem(
        name=f"mrf_shear-{variant}" + ("" if size == "default" else f"-{size}"),
        title=TITLE,
        description=WANTED[variant],
        genome=Genome(GENES),
        scene=designed,
        objective=OBJECTIVES[variant],
        meanings=MEANINGS,
        picture=lambda scene, result: cloud(result),
        details=details,
    )


def details(design: Mapping[str, float], result: Result) -> Mapping[str, float]:
    """Return further properties of the fluid of a design."""
    return {
        "grains": float(len(result.state["radius"])),
        "volume fraction as drawn": volume_fraction(result),
        "shear stress, kPa": 1e-3 * shear_stress(result),
        "viscosity without field, mPa s": 1e3 * viscosity(result),
    }


def off_state_viscosity(fraction: float, diameters: Sequence[float], parts: Sequence[float]) -> float:
    """Return the viscosity of the fluid without a field, Pa s."""
    return published.OIL_VISCOSITY * relative_viscosity(fraction, closest_packing(diameters, parts))
