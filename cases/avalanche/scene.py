"""An avalanche of iron grains: a column runs out over a floor when the wall beside it is removed (L21 4.4).

Grains have the properties of table 4.4 of L21 and the gravity of the asteroid Psyche; a field along gravity
magnetises them. The governing ratio is the magnetic attraction of two touching grains over their weight,
which is inversely proportional to the diameter: see ``scaling.py``. All other quantities, including the
stiffness, are given in units of the grain diameter d and the time sqrt(d/g) in which a grain falls by d/2.
Scenes with different grain sizes are therefore scaled copies of each other except for the field and a weak
cohesion.

Departures from L21: fewer grains, a cell of fewer diameters, and softer grains (STIFFNESS).
"""

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from tisim import Box, Cloud, GrainClass, Material, Particles, RandomInBox, Scene
from tisim.cases.case import Size, size_named
from tisim.cases.common.two_spheres import hertz_duration, reduced
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
"""Diameters of the grains, m; L21 table 4.4."""
DENSITY, POISSON, RESTITUTION = 7750.0, 0.278, 0.2
"""Density, kg/m^3, Poisson's ratio and restitution; L21 table 4.4."""
ROLLING_DAMPING = 0.4
"""gamma_r of L21 table 4.4, as a fraction of critical damping. L21 gives k_r = 10 without a unit; here
``rolling_epsd`` sets the rolling stiffness."""
IRON_DESIGN = {"friction": 0.6, "rolling_friction": 0.4, "cohesion": 10.0}
"""The design of the grains: friction, rolling friction, and cohesion in J/m^3; L21 table 4.4."""
YOUNG = 1e9
"""Young's modulus, Pa; L21 table 4.4."""
GRAVITY, FLUX = 0.144, 5e-3
"""Gravity, m/s^2, and flux density, T; L21 section 4.4.1.3."""
SUSCEPTIBILITY = 999.0
"""Susceptibility at a relative permeability of 1000, at which a single grain has L21's 11.9 kA/m at 5 mT
(section 4.5). L21 does not state it; beyond 400 it changes the moment by less than 1 %."""
CUTOFF = 5.0
"""Cut-off of the dipole interaction, in radii (2.5 diameters). L21 uses three diameters in section 4.2.1.2
and gives no value for avalanches. At 2.5 diameters the force of two dipoles in a row is a fortieth of the
force at contact."""
RELAXATION = 0.6
"""Relaxation factor of a sweep of the moments. L21 uses 1, which diverges here: in a settled bed the least
eigenvalue of mutual magnetisation is below -1, and the moments grow by that factor in each step."""
STIFFNESS = 2e5
"""Young's modulus of softened grains in units of rho g d, the weight of a grain over its cross-section. L21's
1e9 Pa is 1.8e8 in these units for grains of 5 mm, and 1.8e7 for grains of 5 cm."""
STEPS_OF_IMPACT = 16.0
"""Number of steps in the duration of an elastic impact of two grains at sqrt(g d)."""
LOOSE = 0.25
"""Fraction of the space that is filled by grains at the start, before they fall."""
AWAY = 100.0
"""Speed at which the dividing wall moves away, in sqrt(g d): too fast for grains to follow."""
OPENS, DURATION, LATEST = 20.0, 45.0, 25.0
"""Times at which the dividing wall opens and at which a single run ends, and latest end of a stage; in
sqrt(d/g)."""
REST = {"energy": 1e-3, "unbalanced": 5e-2}
"""Criteria for the end of a stage: kinetic energy over the energy of a fall by one radius, and unbalanced
force over weight."""

LAW = Granular(
    normal=HertzMaterial(),
    damping=RestitutionDamping(),
    tangential=MindlinForce(),
    rolling=RollingEPSD(damping_ratio=ROLLING_DAMPING),
    cohesion=SJKR(),
)


@dataclass(frozen=True)
class Cell:
    """A cell with grains beside a dividing wall; lengths are in grain diameters.

    number : of grains. column : distance from the end to the dividing wall. width : periodic. length : of the
    whole cell.
    height : of the drawn part.
    """

    number: int
    column: float
    width: float
    length: float
    height: float


DEFAULT = Cell(number=400, column=10.0, width=5.25, length=40.0, height=14.0)
"""The width is slightly more than twice the cut-off of the dipoles."""
SMALL = Cell(number=200, column=7.0, width=5.25, length=28.0, height=11.0)
"""Half the number of grains, in a column of the same ratio of width to height."""
LARGE_CELL = Cell(number=2500, column=25.0, width=5.25, length=90.0, height=30.0)
"""A column 18 diameters high, whose slope is longer than the chains of grains on it."""
L21_CELLS = {
    5e-3: Cell(number=500_000, column=150.0, width=80.0, length=300.0, height=400.0),
    1e-2: Cell(number=77_000, column=75.0, width=40.0, length=150.0, height=200.0),
    5e-2: Cell(number=70_000, column=75.0, width=40.0, length=150.0, height=200.0),
}
"""Cells of L21 by grain diameter, m: 1.5 m by 0.4 m by 2 m, and 7.5 m by 2 m by 10 m (L21 section 4.4.1.3).
L21 does not give the position of the dividing wall; here it is in the middle."""

SEARCH_SETTINGS = {
    "generations": 6, "ensemble": {"min_starts": 1, "select": 0, "confirm": 3},
}  # fmt: skip

SIZES = {
    "default": Size(
        f"{DEFAULT.number} grains in a narrow cell, softened", {"cell": DEFAULT}, SEARCH_SETTINGS
    ),
    "small": Size(f"{SMALL.number} grains, softened", {"cell": SMALL}),
    "large": Size(f"{LARGE_CELL.number} grains, 18 diameters high, softened", {"cell": LARGE_CELL}),
    **{
        name: Size(
            f"{L21_CELLS[diameter].number} grains of {text} with L21's stiffness",
            {"cell": L21_CELLS[diameter], "diameter": diameter, "stiffness": None},
        )
        for name, diameter, text in (
            ("l21", 5e-3, "5 mm"), ("l21_1cm", 1e-2, "1 cm"), ("l21_5cm", 5e-2, "5 cm"),
        )
    },
}  # fmt: skip


def time_unit(diameter: float) -> float:
    """Return the time sqrt(d/g), s, in which a grain falls by half of its diameter (m)."""
    return math.sqrt(diameter / GRAVITY)


def young(diameter: float, stiffness: float | None = STIFFNESS) -> float:
    """Return Young's modulus (Pa) of grains of a diameter (m): ``stiffness`` times rho g d, or L21's value
    for None."""
    return YOUNG if stiffness is None else stiffness * DENSITY * GRAVITY * diameter


def step(diameter: float, stiffness: float | None, parts: float = STEPS_OF_IMPACT) -> float:
    """Return a step (s): the duration of an impact at sqrt(g d) divided by ``parts``."""
    mass = DENSITY * math.pi / 6 * diameter**3
    modulus = young(diameter, stiffness) / (2 * (1 - POISSON**2))
    speed = math.sqrt(GRAVITY * diameter)
    lasts = float(hertz_duration(speed, diameter / 4, reduced(mass, mass), modulus))
    return three_digits(lasts / parts)


def iron(design: Mapping[str, float], diameter: float, stiffness: float | None) -> Material:
    """Return the material of grains and walls of a design; see IRON_DESIGN."""
    return Material(
        young=young(diameter, stiffness), poisson=POISSON, restitution=RESTITUTION,
        friction=design["friction"], rolling_friction=design["rolling_friction"],
        cohesion_energy_density=design["cohesion"],
    )  # fmt: skip


def loose(cell: Cell, diameter: float) -> Cloud:
    """Return the grains of a cell at random positions beside its dividing wall."""
    d = diameter
    height = cell.number * math.pi / 6 / (LOOSE * cell.column * cell.width)
    return Cloud(
        number=cell.number,
        grains=[GrainClass(sizes=EqualSizes(by="number", radius=d / 2), density=DENSITY)],
        placement=RandomInBox(low=(0.0, 0.0, 0.0), high=(cell.column * d, cell.width * d, height * d)),
    )


def handed_on(state: Arrays) -> Particles:
    """Return the grains of a state, in the order of their ids, for the next stage.

    The contact history is not passed on: elastic friction displacements restart at zero, and a bed sinks by
    less than a hundredth of an overlap.
    """
    order = np.argsort(state["id"])
    core = {name: state[name][order] for name in ("position", "velocity", "radius", "mass")}
    return Particles(**core, quantities={"spin": state["spin"][order]})


def walls(cell: Cell, diameter: float, opens: float | None) -> tuple[Walls, Walls]:
    """Return the floor and the ends of a cell, and the dividing wall.

    opens : time at which the dividing wall moves away, s; it stays if None.
    """
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
    """Return the effects of a flux density (T) along gravity: the field, mutual magnetisation, and dipole
    forces.

    The moments are updated by one sweep in each step, as in L21 section 4.4.1.2. Without a field, nothing is
    returned.
    """
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

    design : friction, rolling_friction and cohesion (J/m^3) of all contacts. diameter : of the grains, m.
    field : flux density along gravity, T; at zero no magnetic effect is compiled.
    state : initial state of the grains; if None, they start loose above the floor.
    opens : time at which the dividing wall moves away, in sqrt(d/g); it stays if None.
    duration : latest end, in the same unit. rests : whether the run ends when grains are at rest.
    stiffness : Young's modulus over rho g d; None for L21's value.
    parts : number of steps in the duration of an impact.
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
    """Return the avalanche of a size as one run: grains settle in the field, then the wall is removed."""
    return scene(seed=seed, **size_named(size, SIZES).scene)
