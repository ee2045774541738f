"""A shear cell: grains between two rough walls, one of which moves along the flow, without gravity; its
mu(I).

Walls consist of fixed grains at different heights; the cell is periodic along and across the flow. After
closing, the gap is fixed, so each cell has its solid fraction. Pressure and shear stress are time averages of
the forces on the walls. The flow depends on one number, the inertial number I = gamma d sqrt(rho / P); the
stress ratio mu = tau / P and the solid fraction are functions of it: GDR MiDi, Eur. Phys. J. E 14 (2004) 341;
F. da Cruz, S. Emam, M. Prochnow, J.-N. Roux and F. Chevoir, Phys. Rev. E 72 (2005) 021309. The shear rate is
measured in the middle of the gap, so slip at the walls has no effect on it.
"""

from collections.abc import Callable, Sequence
from contextlib import closing
from dataclasses import dataclass

import numpy as np

from tisim import Box, Cloud, GrainClass, Material, Particles, Result, Scene, Simulation
from tisim.analysis import solid_fraction
from tisim.cases.common.runs import sound
from tisim.cases.granular_bench.scene import DENSITY, DIAMETER, POISSON, SPREAD
from tisim.effects import (
    Granular,
    HertzMaterial,
    MindlinForce,
    PrescribedMotion,
    RestitutionDamping,
    Translation,
)
from tisim.packing import UniformSizes
from tisim.scene.initial_state import Arrays
from tisim.steppers import FixedStep, Verlet

SHEARED_LAW = Granular(normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce())
SHEARED = Material(young=1e7, poisson=POISSON, restitution=0.5, friction=0.5)
"""The material of grains and walls; pressures are below a thousandth of Young's modulus."""
CELL_LENGTH, CELL_WIDTH = 8, 5
"""Sides of the cell along and across the flow, in diameters."""
CELL_SIDES = (CELL_LENGTH * DIAMETER, CELL_WIDTH * DIAMETER)
CELL_AREA = CELL_SIDES[0] * CELL_SIDES[1]
"""Sides of the cell, m, and its area, m^2."""
LOOSE_FRACTION = 0.26
"""Fraction of the space between the walls that is filled by grains before the gap is closed."""
SHEAR_RATE = 10.0
"""The speed of the upper wall divided by the gap, 1/s."""
CLOSING, STRAIN_BEFORE, STRAIN = 1.0, 2.0, 4.0
"""Strains during closing, before the measurement, and during the measurement."""
SAMPLES = 80
"""Number of samples in the mean."""
SHEAR_DT = 2.4e-5
"""Step of the sheared cells, s."""
MIDDLE = (0.25, 0.75)
"""Range of the gap in which the shear rate and the solid fraction are measured, as fractions of it."""
BINS = 12
"""Number of bins of the profile across the gap."""
FRICTION_LIMITS, CROSSOVER = (0.38, 0.64), 0.279
"""mu_s, mu_2 and I_0 of glass beads."""


def expected_ratio(inertial: np.ndarray | float) -> np.ndarray:
    """Return mu(I) = mu_s + (mu_2 - mu_s) / (I_0 / I + 1) of glass beads.

    Source: P. Jop, Y. Forterre and O. Pouliquen, Nature 441 (2006) 727.
    """
    low, high = FRICTION_LIMITS
    return np.asarray(low + (high - low) / (CROSSOVER / np.asarray(inertial) + 1))


@dataclass(frozen=True)
class ShearedBed:
    """The measures of a sheared bed.

    gap : m. pressure, shear_stress : time averages, Pa. fraction : solid fraction in the middle.
    height, velocity : profile of the time-averaged velocity (m/s) over the height (m). state : of its grains
    at the end.
    """

    gap: float
    pressure: float
    shear_stress: float
    fraction: float
    height: np.ndarray
    velocity: np.ndarray
    state: Arrays

    @property
    def wall_speed(self) -> float:
        """Return the speed of the upper wall, m/s."""
        return SHEAR_RATE * self.gap

    @property
    def filled(self) -> np.ndarray:
        """Return a mask of the profile bins that contain grains."""
        return np.isfinite(self.velocity)

    @property
    def ratio(self) -> float:
        """Return mu, shear stress over pressure."""
        return self.shear_stress / self.pressure

    @property
    def shear_rate(self) -> float:
        """Return the slope of the velocity in the middle of the gap, 1/s."""
        part = self.height / self.gap
        middle = (part > MIDDLE[0]) & (part < MIDDLE[1])
        return float(np.polyfit(self.height[middle], self.velocity[middle], 1)[0])

    @property
    def inertial_number(self) -> float:
        """Return I = gamma d sqrt(rho / P)."""
        return self.shear_rate * DIAMETER * float(np.sqrt(DENSITY / self.pressure))


def gap_of(number: int, fraction: float) -> float:
    """Return the distance (m) between the centres of the walls at which grains fill a fraction of the space.

    The space excludes the halves of the wall grains.
    """
    volume = number * np.pi / 6 * DIAMETER**3 * (1 + SPREAD**2)
    return float(volume / (fraction * CELL_AREA) + DIAMETER)


def rough_wall(height: float) -> np.ndarray:
    """Return centres (m) of the grains of a wall at a height, in rows, displaced by up to a quarter of a
    diameter."""
    x, y = np.meshgrid(np.arange(CELL_LENGTH) + 0.5, np.arange(CELL_WIDTH) + 0.5, indexing="ij")
    # Multiples of the golden ratio: no two neighbours have the same height, and no two rows are equal.
    up = (np.arange(CELL_LENGTH * CELL_WIDTH) * (np.sqrt(5) - 1) / 2) % 1 - 0.5
    return np.column_stack([x.ravel() * DIAMETER, y.ravel() * DIAMETER, height + 0.5 * DIAMETER * up])


def loose(number: int, gap: float, seed: int) -> Arrays:
    """Return the state of grains at random positions between two walls that are far apart."""
    d, clear = DIAMETER, 0.75 * DIAMETER
    sizes = UniformSizes(by="number", smallest=(1 - SPREAD) * d / 2, largest=(1 + SPREAD) * d / 2)
    cloud = Cloud(number=number, grains=[GrainClass(sizes=sizes, density=DENSITY)])
    domain = Box(
        low=(0.0, 0.0, clear),
        high=(*CELL_SIDES, gap - clear),
        periodic=(True, True, False),
    )
    free = cloud.arrays(domain, seed)
    walls = np.vstack([rough_wall(0.0), rough_wall(gap)])
    n, mass = len(walls), DENSITY * np.pi / 6 * d**3
    position = np.vstack([free["position"], walls])
    velocity = np.zeros_like(position)
    velocity[:, 0] = SHEAR_RATE * position[:, 2]
    return {
        "position": position,
        "velocity": velocity,
        "radius": np.append(free["radius"], np.full(n, d / 2)),
        "mass": np.append(free["mass"], np.full(n, mass)),
        "group": np.append(np.zeros(number), np.repeat([1.0, 2.0], n // 2)),
        "spin": np.zeros_like(position),
    }


def cell(
    state: Arrays, velocity: tuple[float, float, float], duration: float, law: Granular = SHEARED_LAW
) -> Scene:
    """Return the scene of a cell from a given state; the upper wall moves at a velocity (m/s)."""
    order = np.argsort(state["id"]) if "id" in state else slice(None)
    core = {name: state[name][order] for name in ("position", "velocity", "radius", "mass")}
    more = {name: state[name][order] for name in ("group", "spin")}
    top = float(core["position"][:, 2].max()) + DIAMETER
    return Scene(
        name="granular_bench",
        particles=Particles(**core, quantities=more),
        materials={"grain": SHEARED},
        domain=Box(
            low=(0.0, 0.0, -DIAMETER),
            high=(*CELL_SIDES, top),
            periodic=(True, True, False),
        ),
        effects=(
            PrescribedMotion(name="lower", group=1),
            PrescribedMotion(name="upper", group=2, motion=Translation(velocity=velocity)),
            law,
        ),
        stepper=Verlet(control=FixedStep(dt=SHEAR_DT)),
        duration=duration,
    )


def sheared_beds(
    fractions: Sequence[float],
    number: int = 400,
    seed: int = 0,
    law: Granular = SHEARED_LAW,
    progress: Callable[[float], object] = lambda part: None,
) -> list[ShearedBed]:
    """Shear a cell for each of several solid fractions, all as one batch, and return their measures.

    number : of grains that move freely. progress : receives the completed fraction, 0..1. RunError if a cell
    fails.
    """
    wide, gaps = gap_of(number, LOOSE_FRACTION), [gap_of(number, part) for part in fractions]
    start, closes = loose(number, wide, seed), CLOSING / SHEAR_RATE
    drives = [(SHEAR_RATE * gap, 0.0, (gap - wide) / closes) for gap in gaps]
    before, lasts = STRAIN_BEFORE / SHEAR_RATE, (STRAIN_BEFORE + STRAIN) / SHEAR_RATE
    samples: list[list[tuple[np.ndarray, ...]]] = [[] for _ in gaps]
    with closing(Simulation(cell(start, drives[0], closes, law), len(gaps))) as simulation:
        simulation.load([cell(start, drive, closes, law) for drive in drives])
        simulation.run()
        closed = [result.state for result in sound(simulation.results())]
        drawn = [(drive[0], 0.0, 0.0) for drive in drives]
        simulation.load([cell(state, drive, lasts, law) for state, drive in zip(closed, drawn, strict=True)])
        for time in np.linspace(before, lasts, SAMPLES):
            simulation.run(until=time)
            progress(float(time / lasts))
            for gap, sample, result in zip(gaps, samples, sound(simulation.results()), strict=True):
                sample.append(seen(result, gap))
        states = [result.state for result in simulation.results()]
    return [mean_of(*one) for one in zip(gaps, samples, states, strict=True)]


def seen(result: Result, gap: float) -> tuple[np.ndarray, ...]:
    """Return forces on the walls (N), the solid fraction in the middle, and sums and numbers of velocities in
    the bins."""
    state, measures = result.state, result.measures
    pressing = measures["upper_force_z"] - measures["lower_force_z"]
    dragging = measures["lower_force_x"] - measures["upper_force_x"]
    free = state["group"] == 0
    height, edges = state["position"][free, 2], np.linspace(0.0, gap, BINS + 1)
    (fraction,) = solid_fraction(state["position"], state["radius"], np.array(MIDDLE) * gap, CELL_AREA)
    sums = np.histogram(height, edges, weights=state["velocity"][free, 0])[0]
    numbers = np.histogram(height, edges)[0]
    return np.array([pressing, dragging, fraction]), sums, numbers


def mean_of(gap: float, samples: Sequence[tuple[np.ndarray, ...]], state: Arrays) -> ShearedBed:
    """Return the means over the samples of a cell with a gap (m), and its state at the end."""
    scalars, sums, numbers = (np.array(one) for one in zip(*samples, strict=True))
    pressing, dragging, fraction = scalars.mean(axis=0)
    edges = np.linspace(0.0, gap, BINS + 1)
    count = numbers.sum(axis=0)
    # Grains cannot reach the middle of a wall.
    velocity = np.where(count > 0, sums.sum(axis=0) / np.maximum(count, 1), np.nan)
    # Each stress is the mean over both walls.
    return ShearedBed(
        gap=gap,
        pressure=pressing / (2 * CELL_AREA),
        shear_stress=dragging / (2 * CELL_AREA),
        fraction=float(fraction),
        height=(edges[1:] + edges[:-1]) / 2,
        velocity=velocity,
        state=state,
    )
