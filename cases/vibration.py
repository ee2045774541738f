"""Electromagnetically induced vibration of particles in a binder (Z13 section 4).

Z13 is T. I. Zohdi, Electromagnetically-induced vibration in particulate-functionalized materials, J. Vib.
Acoust. (2013), doi 10.1115/1.4023251. A cubic array of charged particles, each tethered to its place, in a
constant magnetic field along z and an electric one that oscillates along x.

The near field that is printed is far from equilibrium: attraction and repulsion balance at alpha_2/alpha_1 =
0.5 m, and neighbours are 1/30 m apart. It throws the array apart, and single paths are chaotic after some
0.01 s. The centre of gravity does not care: forces between particles cancel, tether and Lorentz force are
linear, so it follows ``charged_closed_forms.response`` exactly. The size "equilibrium" has a near field in
balance between neighbours. Particles that are alike in uniform fields move as one, so that it does nothing
unless the start disturbs it: the frequencies of the near field, of which the paper speaks, are none of those
of the centre of gravity.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from typing import TYPE_CHECKING

import numpy as np

from cases.case import Case, Check, Size
from cases.charged_closed_forms import resonances
from cases.vibration_accuracy import centre, exact, quantities
from optimize.problem.problem import Problem
from tisim import Cloud, Lattice, Result, Scene, run
from tisim.effects import Lorentz, NearField, Tether, TruncatedNearField
from tisim.engine.batches import Progress
from tisim.io.reader import Frames
from tisim.operators import PeakDisplacement
from tisim.sources import ElectricField, MagneticField
from tisim.steppers import Collocation, ErrorControl, StageControl, Trapezoid

if TYPE_CHECKING:
    from matplotlib.figure import Figure

CUBE, SITES = 0.2, 7
"""Side of the array, m, and particles along it (Z13 section 4)."""
DENSITY, RADIUS, CHARGE = 2000.0, 0.005, 1.0
"""kg/m^3, m, C (Z13 section 4)."""
FLUX, FIELD, STIFFNESS = 1.0, 0.1, 0.5
"""B_3 (T), E_0 (N/C), k (N/m) (Z13 section 4)."""
ATTRACTION, REPULSION = 2.0, 1.0
"""alpha_1 (N m) and alpha_2 (N m^2) with exponents 1 and 2 (Z13 section 4)."""
RATIOS = (0.1, 0.2, 0.4, 0.8, 1.0, 1.2, 1.4, 1.8)
"""Omega/w of Z13 Fig. 3."""

MASS = DENSITY * 4 / 3 * np.pi * RADIUS**3
CYCLOTRON = CHARGE * FLUX / MASS
"""w = q B/m: 954.930 1/s. Z13 prints 1819.385 1/s for the same data, which is wrong."""
SPACING = CUBE / (SITES - 1)

VARIANTS = ("resonate", "avoid")
"""The inverse problems: the largest response to a given drive, and the smallest."""
SEARCH = {
    "generations": 16, "options": {"population": 24, "parents": 8},
    # Nothing is random: a second start is the first.
    "ensemble": {"min_starts": 2, "block": 2, "max_starts": 2},
}  # fmt: skip

SIZES = {
    "alone": Size(
        "343 particles that do not feel each other, 0.05 s", {"near_field": "none", "duration": 0.05}
    ),
    "default": Size("343 particles, the near field as printed, 0.005 s", {}, SEARCH),
    "equilibrium": Size(
        "343 particles, near field in balance with the six neighbours, 0.05 s",
        {"near_field": "equilibrium", "duration": 0.05},
    ),
}


def near_fields(name: str) -> tuple[NearField, ...]:
    """None, the one printed, or one in equilibrium at the distance of neighbours and for them only."""
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
    """The array, driven at Omega = ratio w, w that of the paper's B. ``error`` is asked of a step, over the
    displacement in it. observed : keep the largest displacement of the centre of gravity."""
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
    """The array of a size; nothing in it is random."""
    return scene(seed=seed, **CASE.size(size).scene)


def deviation(results: list[Result]) -> float:
    """Largest distance of the centre of gravity from its closed form, over the largest displacement."""
    found, true = (np.array([f(result) for result in results]) for f in (centre, exact))
    return float(np.linalg.norm(found - true, axis=1).max() / np.linalg.norm(true, axis=1).max())


def check() -> Iterator[Check]:
    """Z13's numbers and slip; the centre of gravity, resonances and beats against their closed forms."""
    slow, fast = resonances(CYCLOTRON, STIFFNESS / MASS)
    yield Check("w = q B/m, 1/s (printed: 1819.385)", CYCLOTRON, 954.930, 1e-3)
    yield Check("sqrt(k/m), 1/s", float(np.sqrt(STIFFNESS / MASS)), 21.851, 1e-3)
    pair = float(np.sqrt(ATTRACTION * (ATTRACTION / REPULSION) ** 2 / MASS))
    yield Check("sqrt(alpha_1 (alpha_1/alpha_2)^2/m), 1/s", pair, 87.404, 1e-3)
    yield Check("product of the two resonances, k/m, 1/s^2", slow * fast, STIFFNESS / MASS, 1e-9)
    alone = run([scene(r, "none", duration=0.05, sites=1, observed=True) for r in RATIOS])
    yield Check("one particle, 0.05 s, all of Fig. 3: off by", deviation(alone), 0.0, 1e-3)
    some = (0.1, 0.8, 1.8)
    fine = {"stepper": Collocation(control=StageControl(error=1e-6))}
    cloud = run([scene(r, duration=0.05).model_copy(update=fine) for r in some])
    off = deviation(cloud)
    yield Check("centre of gravity, 343 particles as printed, 0.05 s: off by", off, 0.0, 1e-6)
    drift = max(float(np.abs(np.average(r.state["position"], axis=0)[2])) for r in cloud)
    yield Check("the same along z, m", drift, 0.0, 1e-12)
    from cases import vibration_response as of

    around = of.Sweep.of(of.fast_scenes(np.linspace(0.9, 1.1, 21)))
    yield Check("largest displacement within 0.1 s, 0.9 to 1.1 w: off by", around.deviation, 0.0, 1e-3)
    yield Check("Omega of the largest over the fast resonance", around.top() / of.FAST, 1.0, 5e-3)
    slowly = of.Sweep.of(of.slow_scenes(np.linspace(0.3, 0.7, 21)))
    yield Check("largest displacement within 60 s, 0.3 to 0.7 1/s: off by", slowly.deviation, 0.0, 1e-4)
    yield Check("Omega of the largest over the slow resonance", slowly.top() / of.SLOW, 1.0, 2e-2)
    beat = of.FAST * (1 - of.DRIVE)
    yield Check(
        "beat period at 0.9 of the fast resonance, s", of.beats().beat_period(), 2 * np.pi / beat, 3e-4
    )


def pictures(found: Frames) -> Mapping[str, Figure]:
    """What is drawn of a trajectory."""
    # Imported late, as the others: these run scenes of this module.
    from cases import vibration_pictures

    return vibration_pictures.pictures(found)


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """The resonance curve and beats."""
    from cases import vibration_pictures

    return vibration_pictures.figures(size, progress)


def problem(size: str, variant: str) -> Problem:
    """The field and the binder that answer a drive the most, or the least."""
    from cases import vibration_design

    return vibration_design.problem(size, variant)


CASE = Case(
    name="vibration",
    title="Electromagnetically induced vibration of particles in a binder",
    source="T. I. Zohdi, J. Vib. Acoust. (2013), doi 10.1115/1.4023251",
    sizes=SIZES,
    scene=scene_for,
    check=check,
    quantities=quantities,
    pictures=pictures,
    figures=figures,
    problem=problem,
    variants=VARIANTS,
)
