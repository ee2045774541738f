"""An avalanche of iron grains: a column beside a wall runs out over a floor when the wall goes (L21 4.4).

Grains are as in table 4.4 of L21, in the gravity of the asteroid Psyche, and a field along gravity makes
dipoles of them. What counts is the magnetic force between two that touch over their weight, which falls as
their size: ``scaling.py``. All else is made in units of a grain's diameter d and of the time sqrt(d/g) in
which it falls by half of one, the stiffness too, so that grains of all sizes are scaled copies of each other
but for the field and a weak cohesion.

Departures from L21: fewer grains, in a cell of fewer diameters, and softer ones (STIFFNESS).
"""

from __future__ import annotations

import math
from collections.abc import Mapping

import numpy as np
from tisim.cases.avalanche.sizes import SIZES, Cell
from tisim.cases.case import size_named
from tisim.cases.granular_bench.closed_forms import hertz_duration, reduced

from tisim import Box, Cloud, GrainClass, Material, Particles, RandomInBox, Scene
from tisim.components.accuracy_parameter import three_digits
from tisim.effects import (
    SJKR,
    Granular,
    Gravity,
    HertzMaterial,
    MindlinForce,
    MutualInducedMoment,
    RestitutionDamping,
    RollingEPSD,
    Translation,
    TruncatedDipoleDipole,
    Walls,
)
from tisim.effects.base import Effect
from tisim.geometry import Plane
from tisim.operators import AtRest
from tisim.packing import EqualSizes
from tisim.scene.initial_state import Arrays
from tisim.sources import MagneticField
from tisim.steppers import FixedStep, Verlet

TITLE = "Avalanches of iron grains with and without a magnetic field"

DIAMETERS = (5e-3, 1e-2, 5e-2)
"""m; L21 table 4.4."""
DENSITY, POISSON, RESTITUTION = 7750.0, 0.278, 0.2
"""kg/m^3 and ratios; L21 table 4.4."""
ROLLING_DAMPING = 0.4
"""gamma_r of L21 table 4.4, as the damping over the critical one. Its k_r = 10 has no unit there; the
stiffness against rolling is that which goes with the model, of ``rolling_epsd``."""
IRON_DESIGN = {"friction": 0.6, "rolling_friction": 0.4, "cohesion": 10.0}
"""The design of the grains: friction, rolling friction, and cohesion in J/m^3; L21 table 4.4."""
YOUNG = 1e9
"""Pa; L21 table 4.4."""
GRAVITY, FLUX = 0.144, 5e-3
"""m/s^2 and T; L21 section 4.4.1.3."""
SUSCEPTIBILITY = 999.0
"""That of a relative permeability of 1000, with which a single grain has L21's 11.9 kA/m at 5 mT (section
4.5); L21 does not state it, and beyond 400 it changes the moment by less than 1 %."""
CUTOFF = 5.0
"""Dipoles act within so many radii, 2.5 diameters. L21 has three in section 4.2.1.2, and does not state it of
avalanches: at 2.5 the force of two in a row is a fortieth of that in contact."""
RELAXATION = 0.6
"""A sweep of the moments goes so much of its way. L21 goes all of it. Here that diverges: in a settled bed
the least eigenvalue of what moments do to each other is below -1, and moments grow by as much in each
step."""
STIFFNESS = 2e5
"""Young's modulus over the weight of a grain by its section, rho g d, of softened grains. L21's 1e9 Pa is
1.8e8 of it for grains of 5 mm, and 1.8e7 for those of 5 cm."""
STEPS_OF_IMPACT = 16.0
"""A step is one of so many parts of the time of an elastic impact of two grains at sqrt(g d)."""
LOOSE = 0.25
"""The part of the space that grains fill at the start, before they fall."""
AWAY = 100.0
"""The dividing wall goes away at so many sqrt(g d): grains cannot follow."""
OPENS, DURATION, LATEST = 20.0, 45.0, 25.0
"""When the dividing wall of a run in one go opens, and when it ends; and when a stage ends at the latest; in
sqrt(d/g)."""
REST = {"energy": 1e-3, "unbalanced": 5e-2}
"""Where a stage ends: the kinetic energy over that of a fall by a radius, and the unbalanced force over the
weight."""

LAW = Granular(
    normal=HertzMaterial(),
    damping=RestitutionDamping(),
    tangential=MindlinForce(),
    rolling=RollingEPSD(damping_ratio=ROLLING_DAMPING),
    cohesion=SJKR(),
)


def time_unit(diameter: float) -> float:
    """Return the time sqrt(d/g), s, in which a grain falls by half of its diameter (m)."""
    return math.sqrt(diameter / GRAVITY)


def young(diameter: float, stiffness: float | None = STIFFNESS) -> float:
    """Return Young's modulus (Pa) of grains of a diameter (m): ``stiffness`` times rho g d, or that of L21
    for None."""
    return YOUNG if stiffness is None else stiffness * DENSITY * GRAVITY * diameter


def step(diameter: float, stiffness: float | None, parts: float = STEPS_OF_IMPACT) -> float:
    """Return a step (s): one of so many parts of the time of an impact at sqrt(g d)."""
    mass = DENSITY * math.pi / 6 * diameter**3
    modulus = young(diameter, stiffness) / (2 * (1 - POISSON**2))
    speed = math.sqrt(GRAVITY * diameter)
    lasts = float(hertz_duration(speed, diameter / 4, reduced(mass, mass), modulus))
    return three_digits(lasts / parts)


def iron(design: Mapping[str, float], diameter: float, stiffness: float | None) -> Material:
    """Return the material of grains and walls of a design, as IRON_DESIGN has one."""
    return Material(
        young=young(diameter, stiffness), poisson=POISSON, restitution=RESTITUTION,
        friction=design["friction"], rolling_friction=design["rolling_friction"],
        cohesion_energy_density=design["cohesion"],
    )  # fmt: skip


def loose(cell: Cell, diameter: float) -> Cloud:
    """Return so many grains as the cell holds at random places beside its dividing wall."""
    d = diameter
    height = cell.number * math.pi / 6 / (LOOSE * cell.column * cell.width)
    return Cloud(
        number=cell.number,
        grains=[GrainClass(sizes=EqualSizes(by="number", radius=d / 2), density=DENSITY)],
        placement=RandomInBox(low=(0.0, 0.0, 0.0), high=(cell.column * d, cell.width * d, height * d)),
    )


def handed_on(state: Arrays) -> Particles:
    """Return the grains of a state, in the order of their ids. What contacts remember is not handed on: the
    elastic part of friction begins anew, and a bed sinks by less than a hundredth of an overlap for it."""
    order = np.argsort(state["id"])
    core = {name: state[name][order] for name in ("position", "velocity", "radius", "mass")}
    return Particles(**core, quantities={"spin": state["spin"][order]})


def walls(cell: Cell, diameter: float, opens: float | None) -> tuple[Walls, Walls]:
    """Return the floor and the ends of a cell, and the dividing wall, which goes away at a time (s), or stays
    where there is none."""
    d = diameter
    ends = [((0.0, 0.0, 0.0), 1.0), ((cell.length * d, 0.0, 0.0), -1.0)]
    planes = [Plane(point=point, normal=(inwards, 0.0, 0.0)) for point, inwards in ends]
    speed = 0.0 if opens is None else AWAY * d / time_unit(d)
    return (
        Walls(name="box", planes=[Plane(), *planes]),
        Walls(
            name="gate",
            planes=[Plane(point=(cell.column * d, 0.0, 0.0), normal=(-1.0, 0.0, 0.0))],
            motion=Translation(velocity=(speed, 0.0, 0.0), begin=opens or 0.0),
        ),
    )


def magnetism(field: float) -> tuple[Effect, ...]:
    """Return what a flux density (T) along gravity makes of the grains, which magnetise each other, in one
    sweep a step as in L21 section 4.4.1.2; nothing where there is none."""
    if field == 0:
        return ()
    return (
        MagneticField(constant=(0.0, 0.0, -field)),
        MutualInducedMoment(susceptibility=SUSCEPTIBILITY, cutoff=CUTOFF, sweeps=0, relaxation=RELAXATION),
        TruncatedDipoleDipole(cutoff=CUTOFF),
    )


def scene(
    cell: Cell,
    design: Mapping[str, float] = IRON_DESIGN,
    diameter: float = DIAMETERS[0],
    field: float = FLUX,
    seed: int = 0,
    state: Arrays | None = None,
    opens: float | None = OPENS,
    duration: float = DURATION,
    rests: bool = False,
    stiffness: float | None = STIFFNESS,
    parts: float = STEPS_OF_IMPACT,
) -> Scene:
    """Return an avalanche, or a stage of one.

    design : friction, rolling_friction and cohesion (J/m^3) of all contacts. diameter : m. field : flux
    density along gravity, T; without one nothing magnetic is compiled. state : that in which grains begin;
    loose above the floor without it. opens : when the dividing wall goes, in sqrt(d/g); None where it stays.
    duration : the latest end, in the same unit. rests : whether it ends when grains are at rest. stiffness :
    Young's modulus over rho g d; None for that of L21.
    parts : of the time of an impact that a step is one of.
    """
    d, unit = diameter, time_unit(diameter)
    return Scene(
        name="avalanche",
        particles=loose(cell, d) if state is None else handed_on(state),
        materials={"iron": iron(design, d, stiffness)},
        domain=Box(
            low=(0.0, 0.0, 0.0),
            high=(cell.length * d, cell.width * d, cell.height * d),
            periodic=(False, True, False),
        ),
        effects=(
            LAW,
            *walls(cell, d, None if opens is None else opens * unit),
            Gravity(acceleration=(0.0, 0.0, -GRAVITY)),
            *magnetism(field),
            *((AtRest(time=unit, **REST),) if rests else ()),
        ),
        stepper=Verlet(control=FixedStep(dt=step(d, stiffness, parts))),
        duration=duration * unit,
        seed=seed,
    )


def scene_for(size: str, seed: int) -> Scene:
    """Return the avalanche of a size in one go: grains settle in the field, and then the wall goes."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
