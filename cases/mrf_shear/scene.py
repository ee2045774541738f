"""A magnetorheological fluid in a shear cell: iron grains in oil form chains along a field, and resist shear.

The cell is periodic along x and y. Grains start at random positions, and a field along z makes them form
chains. Then the grains at the bottom and at the top are frozen into rafts, which shear the oil and the chains
along x. The shear stress is the mean force on the rafts divided by their area.

It is the simulation of L21 chapter 2. SIZES and the page of the case list the differences at the sizes for a
laptop.
"""

from collections.abc import Sequence
from typing import Any

import numpy as np

from tisim import Box, Cloud, GrainClass, Material, RandomInDomain, Scene
from tisim.cases.case import Size, size_named
from tisim.cases.common import magnetorheological_fluid as fluid
from tisim.cases.common.magnetorheological_fluid import MICRO, SWEPT, magnetorheological
from tisim.cases.mrf_shear import published
from tisim.components.accuracy_parameter import three_digits
from tisim.components.component import Vector
from tisim.effects import (
    CARBONYL_IRON,
    SJKR,
    Effect,
    MutualFroehlichMoment,
    MutualInducedMoment,
    PrescribedMotion,
    StokesDrag,
    Translation,
    TruncatedDipoleDipole,
    Walls,
)
from tisim.geometry import Plane
from tisim.operators import JoinGroup, MeanForce
from tisim.sources import CouetteFlow, MagneticField
from tisim.steppers import FixedStep, Verlet

TITLE = "A magnetorheological fluid in a shear cell: flow curve and yield stress"

SUSCEPTIBILITY = CARBONYL_IRON.parameters()["susceptibility"]
"""Susceptibility of carbonyl iron; the magnetisation of a sphere is within 0.3 % of the limit of infinite
susceptibility."""
DENSITY = CARBONYL_IRON.density
"""Density of the grains, kg/m^3."""
LARGE_RADIUS, SMALL_RADIUS = published.MEAN_LARGE / 2, published.MEAN_LARGE / 4
"""The radius of the large grains, and of the small grains of a mixture at sizes for a laptop, m. The small
ones are half as large; L21's are a quarter, which would be 25 small grains for each large one in a mixture of
33:67."""
SIDES: Vector = (40 * MICRO, 40 * MICRO, 60 * MICRO)
RAFT = 8 * MICRO
"""The sides of the cell, and the thickness of its bottom and top layers that become rafts, m."""
RATES = (2000.0, 5000.0, 10000.0)
"""The shear rates of a flow curve, 1/s."""
BEFORE, STRAIN = 0.5, 1.0
"""The strains between which the stress is averaged."""
MAGNETISING_TIME = 2 * published.CHAINS_FORM
"""Time after which the rafts are frozen, s."""
CUT = {"cutoff": 2.0, "gap": published.NEIGHBOUR_GAP}
"""Range of mutual magnetisation and attraction: a cut-off and a gap between surfaces."""
REST: Vector = (0.0, 0.0, 0.0)
"""The oil at rest, m/s."""
LOWER, UPPER = 1, 2
"""The groups of the rafts."""
LARGEST_CHANGE = SWEPT["effects.mutual_induced_moment.largest_change"]
"""In the mixture of sizes, sweeps in a step continue as in a search. With 1 % there were some hundred in each
step after chains had formed."""
STEPS_OF_IMPACT = 40.0
"""Number of steps in the duration of an impact of the smallest grains at IMPACT."""
IMPACT = 1.0
"""Speed of that impact, m/s: about the speed at which grains of 6.7 um collide in fields of 0.6 T."""


def mixture(share: float) -> tuple[GrainClass, ...]:
    """Return a mixture of large and small grains of one size each; share : of the small grains, 0 to 1."""
    return (*fluid.equal(LARGE_RADIUS, 1 - share), *fluid.equal(SMALL_RADIUS, share))


MONODISPERSE = mixture(0.0)
"""Grains of one size, the mean of L21's large grains."""

SEARCHED: dict[str, Any] = {
    "rate": RATES[-1], "sides": (32 * MICRO, 32 * MICRO, 48 * MICRO), "raft": 7 * MICRO, "strain": 0.7,
    "before": 0.35,
}  # fmt: skip
"""Settings of the runs in a search: a smaller cell, for a shorter time."""
SEARCH_SETTINGS = {
    "generations": 9, "options": {"population": 8, "first": 12}, "ensemble": {"min_starts": 1, "confirm": 4},
}  # fmt: skip
"""Each design has one start, and the best designs are run again from four held-out starts."""
LEPS: dict[str, Any] = {
    "sides": (published.CELL_SIDE,) * 3, "raft": published.RAFT_DEPTH, "rate": published.SHEAR_RATES[0],
    "magnetising": published.CHAINS_FORM, "dt": published.STEP, "strain": 0.93, "before": 0.7,
    "plates": False,
}  # fmt: skip
"""L21's own cell, open along the field, sheared at its highest rate."""
SIZES = {
    "default": Size(
        "183 grains of 6.7 um in a cell of 40 x 40 x 60 um, at 2000 1/s; a search uses 32 x 32 x 48 um", {},
        SEARCH_SETTINGS,
    ),
    "small": Size("94 grains in a cell of 32 x 32 x 48 um, at 10 000 1/s, for shorter strains", SEARCHED),
    "polydisperse": Size(
        "some 260 grains of L21's mixture 00:100 in a cell of 66 x 66 x 80 um, at 10 000 1/s",
        {
            "grains": magnetorheological(0.0), "sides": (66 * MICRO, 66 * MICRO, 80 * MICRO),
            "raft": 10 * MICRO, "rate": RATES[-1], "largest_change": LARGEST_CHANGE,
        },
    ),
    "l21": Size(
        "L21's own cell: a cube of 250 um, its mixture 00:100 by number, steps of 0.2 ns",
        {**LEPS, "grains": magnetorheological(0.0)},
    ),
    "l21_volume": Size("the same, 00:100 by volume", {**LEPS, "grains": magnetorheological(0.0, "mass")}),
    "l21_bidisperse": Size("the same, 33:67 by number", {**LEPS, "grains": magnetorheological(0.33)}),
    "l21_monodisperse": Size("the same, grains of 6.7 um", {**LEPS, "grains": MONODISPERSE}),
}  # fmt: skip


def impact_step(radius: float, young: float) -> float:
    """Return a step (s) for grains of a radius (m) and a Young's modulus (Pa): a fraction of their impact at
    IMPACT, by Hertz."""
    modulus = young / (2 * (1 - fluid.TABLE_2_1["poisson"] ** 2))
    mass = DENSITY * 2 / 3 * np.pi * radius**3
    lasts = 2.94 * (15 * mass / (16 * modulus * np.sqrt(radius / 2 * IMPACT))) ** 0.4
    return float(three_digits(lasts / STEPS_OF_IMPACT))


def smooth(young: float) -> Material:
    """Return the material of the plates below and above, on which grains slide without friction; young :
    Pa."""
    return fluid.iron(young, 0.0, friction=0.0, rolling_friction=0.0)


def scene(
    rate: float = 2000.0,
    flux: float = published.FLUX,
    grains: Sequence[GrainClass] = MONODISPERSE,
    fraction: float = published.FRACTION,
    seed: int = 0,
    sides: Vector = SIDES,
    raft: float = RAFT,
    magnetising: float = MAGNETISING_TIME,
    strain: float = STRAIN,
    before: float = BEFORE,
    young: float = published.YOUNG,
    dt: float | None = None,
    rolling: float = fluid.TABLE_2_1["rolling_friction"],
    cohesion: float = published.COHESION,
    saturation: float | None = None,
    still: bool = False,
    plates: bool = True,
    largest_change: float = 0.01,
) -> Scene:
    """Return the scene of a cell.

    rate : of shear between the rafts, 1/s. flux : density of the field along z, T. fraction : of the volume
    that is filled by grains.
    sides : of the cell, m. raft : thickness of the frozen layers below and above, m.
    magnetising : time after which rafts are frozen, s.
    strain : at the end. before : strain at which averaging of the stress begins. young : Pa.
    dt : s; by default a fraction of the duration of an impact of the smallest grains.
    rolling : coefficient of rolling friction. cohesion : energy density, J/m^3.
    saturation : magnetisation at which grains saturate, A/m; None for no saturation, as in L21.
    still : whether the oil stays at rest. plates : whether there are smooth plates below and above.
    largest_change : of a moment, relative to the largest one, above which sweeps in a step continue.

    All of these except ``plates``, and whether grains saturate, are values of one structure: cells that
    differ in them run as one batch.
    """
    ends = (Plane(point=(0.0, 0.0, 0.0)), Plane(point=(0.0, 0.0, sides[2]), normal=(0.0, 0.0, -1.0)))
    plate = {"plate": smooth(young)} if plates else {}
    return Scene(
        name="mrf_shear",
        particles=Cloud(
            number=fluid.number_of(grains, fraction, float(np.prod(sides))),
            grains=tuple(grains),
            placement=RandomInDomain(),
        ),
        materials={"iron": fluid.iron(young, cohesion, rolling_friction=rolling), **plate},
        domain=Box(low=(0.0, 0.0, 0.0), high=sides, periodic=(True, True, False)),
        effects=(
            MagneticField(constant=(0.0, 0.0, flux)),
            induced(saturation, largest_change),
            TruncatedDipoleDipole(**CUT),
            fluid.contact_law(cohesion=SJKR()),
            *((Walls(name="plates", planes=ends, material="plate"),) if plates else ()),
            StokesDrag(viscosity=published.OIL_VISCOSITY),
            *sheared(rate, sides[2], raft, magnetising, before, still),
        ),
        stepper=Verlet(
            control=FixedStep(dt=impact_step(fluid.smallest(grains), young) if dt is None else dt)
        ),
        duration=magnetising + strain / rate,
        seed=seed,
    )


def induced(saturation: float | None, largest_change: float) -> Effect:
    """Return the mutual magnetisation of grains, up to a saturation (A/m) if given.

    The moments are updated by one sweep in each step, as in L21 section 2.2.3, and by further ones while a
    moment changes by more than ``largest_change`` of the largest.
    """
    sweeps: dict[str, Any] = {"sweeps": 0, "largest_change": largest_change, **CUT}
    if saturation is None:
        return MutualInducedMoment(susceptibility=SUSCEPTIBILITY, **sweeps)
    return MutualFroehlichMoment(susceptibility=SUSCEPTIBILITY, saturation=saturation, **sweeps)


def sheared(
    rate: float, height: float, raft: float, begin: float, before: float, still: bool
) -> tuple[Effect, ...]:
    """Return the effects that shear a cell from a time ``begin`` (s) and average the forces from the strain
    ``before``.

    The other arguments are the same as for ``scene``.
    """
    bottom, top = raft, height - raft
    speed = rate * (top - bottom) / 2
    back, on = (-speed, 0.0, 0.0), (speed, 0.0, 0.0)
    flow = (REST, REST) if still else (back, on)
    oil = CouetteFlow(first=bottom, second=top, first_velocity=flow[0], second_velocity=flow[1], begin=begin)
    below, above = Plane(point=(0.0, 0.0, bottom)), Plane(point=(0.0, 0.0, top), normal=(0.0, 0.0, -1.0))
    return (
        oil,
        PrescribedMotion(name="lower", group=LOWER, motion=Translation(velocity=back)),
        PrescribedMotion(name="upper", group=UPPER, motion=Translation(velocity=on)),
        JoinGroup(name="lower_raft", group=LOWER, planes=[below], time=begin),
        JoinGroup(name="upper_raft", group=UPPER, planes=[above], time=begin),
        MeanForce(begin=begin + before / rate),
    )


def scene_for(size: str, seed: int) -> Scene:
    """Return the scene of a size."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
