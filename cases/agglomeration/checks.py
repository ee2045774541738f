"""Checks of Z04: closed forms for two equal grains, and conservation laws for a whole flow.

Two grains of radius b_0 meet head-on, each at speed v. With a_0 = 0, a_f = 1 (Z04 4.13-4.15, 5.4, 5.5):
e = 1 - v / v*, v* = sqrt(3 H beta / (2 rho)), and the grains bond above v*. A grain breaks into eight grains
of half its radius at v = sqrt(6 gamma / (rho b_0 (1 - e^2))). At v*, grains larger than 4 gamma / (a_f H
beta) break. The size at which gravity bonds grains is in self_gravity.py.
"""

from collections.abc import Callable, Iterator, Sequence

import numpy as np

import tisim
from tisim import Particles, Result, Scene
from tisim.accuracy import Quantity
from tisim.cases.agglomeration import field_checks
from tisim.cases.agglomeration import scene as agglomeration
from tisim.cases.agglomeration.self_gravity import self_gravity_checks
from tisim.cases.case import Check
from tisim.effects import Agglomeration, Effect, Heating, Impact
from tisim.operators import Fragmentation
from tisim.scene.initial_state import Arrays
from tisim.steppers import FixedStep, Verlet

HARDNESS, DENSITY, RADIUS, LENGTH = 3e5, 2000.0, 1e-3, 0.8
"""Properties of the grains in the checks: hardness H (Pa), density rho (kg/m^3), radius b_0 (m), length
beta."""
CLOSED_FORM_BOUND = 1e-10
"""Largest relative difference between a run and a closed form."""
CONSERVATION_BOUND = 1e-12
"""Largest relative change of a conserved sum of about a thousand terms, from rounding."""


def pair(speed: float, *effects: Effect, radius: float = RADIUS) -> Scene:
    """Return a scene with two equal grains that meet head-on along x, each at ``speed`` (m/s), and then
    separate."""
    gap = 0.1 * radius
    return Scene(
        name="pair",
        particles=Particles(
            position=((-radius - gap, 0, 0), (radius + gap, 0, 0)),
            velocity=((speed, 0, 0), (-speed, 0, 0)),
            radius=radius,
            density=DENSITY,
        ),
        effects=effects,
        stepper=Verlet(control=FixedStep(dt=gap / speed / 4)),
        duration=2 * gap / speed,
    )


def impact(initial: float = 0.0, final: float = 1.0) -> Impact:
    return Impact(
        hardness=HARDNESS, deformation_length=LENGTH, initial_area=initial, final_area=final
    )  # fmt: skip


def breaking(surface_energy: float, radius: float = RADIUS) -> Fragmentation:
    """Return fragmentation into pieces of half the radius, which do not break again."""
    mass = DENSITY * 4 / 3 * np.pi * radius**3
    return Fragmentation(surface_energy=surface_energy, grain_mass=mass / 8, threshold=0.5)


def adhesion_speed(final: float = 1.0) -> float:
    """Return the speed (m/s) of each grain above which equal grains bond (Z04 4.14)."""
    return float(np.sqrt(3 * final * HARDNESS * LENGTH / (2 * DENSITY)))


def restitution(speed: np.ndarray, initial: float, final: float) -> np.ndarray:
    """Return e of equal grains at each speed (m/s): the root of D e^2 - (a_f + D) e + a_f - A = 0 in 0..1."""
    d, a = final - initial, 2 * DENSITY * speed**2 / (3 * LENGTH * HARDNESS)
    half = (final + d) / 2
    return (final - a) / (half + np.sqrt(half**2 - d * (final - a)))


def onset(happened: Callable[[np.ndarray], np.ndarray], low: float, high: float) -> float:
    """Return the smallest value in low..high at which ``happened`` becomes true, to rounding error.

    Each batch of 32 runs narrows the interval by a factor of about thirty.
    """
    while True:
        points = np.linspace(low, high, 32)
        first = int(np.argmax(happened(points)))
        low, high = points[max(first - 1, 0)], points[first]
        if high - low <= 1e-13 * high:
            return float(0.5 * (low + high))


def _run(scenes: Sequence[Scene]) -> list[Result]:
    return tisim.run(list(scenes))


def closed_forms() -> Iterator[Check]:
    """Yield the checks of restitution, adhesion, fragmentation and the largest size that bonds."""
    for initial, final in ((0.0, 1.0), (0.3, 1.0), (0.1, 2.5)):
        speeds = np.linspace(0.02, 0.98, 32) * adhesion_speed(final)
        ends = _run([pair(v, impact(initial, final)) for v in speeds])
        measured = np.array([r.state["velocity"][1, 0] - r.state["velocity"][0, 0] for r in ends])
        error = np.abs(measured / (2 * speeds) - restitution(speeds, initial, final)).max()
        yield Check(
            f"restitution, a0 = {initial}, af = {final}: largest error", error, 0.0, CLOSED_FORM_BOUND
        )

    for final in (1.0, 2.5):
        expected = adhesion_speed(final)

        def bonded(speeds: np.ndarray, final: float = final) -> np.ndarray:
            ends = _run([pair(v, impact(0.0, final), Agglomeration()) for v in speeds])
            return np.array([r.work["merges"] > 0 for r in ends])

        speed = onset(bonded, 0.5 * expected, 1.5 * expected)
        yield Check(f"adhesion speed, af = {final} (m/s)", speed, expected, CLOSED_FORM_BOUND * expected)

    gamma = 20.0

    def broken(speeds: np.ndarray) -> np.ndarray:
        ends = _run([pair(v, impact(), breaking(gamma)) for v in speeds])
        return np.array([r.work["fractures"] > 0 for r in ends])

    def deficit(speeds: np.ndarray) -> np.ndarray:
        e = restitution(speeds, 0.0, 1.0)
        return speeds**2 * DENSITY * RADIUS * (1 - e**2) >= 6 * gamma

    top = 0.999 * adhesion_speed()
    expected = onset(deficit, 0.01 * top, top)
    speed = onset(broken, 0.01 * top, top)
    yield Check("fragmentation speed (m/s)", speed, expected, CLOSED_FORM_BOUND * expected)

    fastest = adhesion_speed() * (1 + 1e-13)

    def breaks(radii: np.ndarray) -> np.ndarray:
        ends = _run([
            pair(fastest, impact(), breaking(gamma, b), Agglomeration(), radius=b) for b in radii
        ])  # fmt: skip
        # At this speed a pair either bonds or breaks.
        return np.array([r.work["fractures"] > 0 and r.work["merges"] == 0 for r in ends])

    expected = 4 * gamma / (HARDNESS * LENGTH)
    size = onset(breaks, 0.3 * expected, 3 * expected)
    yield Check("largest radius of grains that bond (m)", size, expected, CLOSED_FORM_BOUND * expected)


def energy(result: Result) -> tuple[float, float]:
    """Return the energy of a flow at the start and at the end, J.

    It is the sum of kinetic, thermal, radiated and fracture energy, less the energy supplied by reaction and
    deformation work.
    """
    capacity = next(e for e in result.scene.effects if isinstance(e, Heating)).heat_capacity

    def energy_of_grains(s: Arrays) -> float:
        kinetic = 0.5 * (s["mass"] * (s["velocity"] ** 2).sum(axis=1)).sum()
        return float(kinetic + (s["mass"] * capacity * s["temperature"]).sum())

    books = {name: float(result.state[name].sum()) for name in
             ("cooling_loss", "fracture_energy", "reaction_heat", "deformation_work")}  # fmt: skip
    spent = books["cooling_loss"] + books["fracture_energy"]
    end = energy_of_grains(result.state) + spent - books["reaction_heat"] - books["deformation_work"]
    return energy_of_grains(result.start), end


def conservation() -> Iterator[Check]:
    """Yield the checks of mass, momentum and energy of a flow in which grains bond and break."""
    flow = agglomeration.scene({**agglomeration.BEST, "surface_energy": 5e4}, seed=1, grains=1000)
    result = tisim.run(flow)
    yield Check("the run completes (1 = yes)", float(result.status.ok), 1.0, 0.0)
    before, after = result.start, result.state
    mass = before["mass"].sum()
    yield Check("mass (kg)", after["mass"].sum(), mass, CONSERVATION_BOUND * mass)
    momentum = [(s["mass"][:, None] * s["velocity"]).sum(axis=0) for s in (before, after)]
    scale = float((before["mass"] * np.linalg.norm(before["velocity"], axis=1)).sum())
    for axis in range(3):
        bound = CONSERVATION_BOUND * scale
        yield Check(f"momentum along {'xyz'[axis]} (kg m/s)", momentum[1][axis], momentum[0][axis], bound)
    start, end = energy(result)
    turned_over = float(result.state["cooling_loss"].sum() + result.state["reaction_heat"].sum()) + start
    yield Check("total energy with losses and sources (J)", end, start, CONSERVATION_BOUND * turned_over)


def check() -> Iterator[Check]:
    """Yield the closed forms, then the conservation laws, first without charges and then with charges."""
    yield from closed_forms()
    yield from self_gravity_checks()
    yield from conservation()
    yield from field_checks.closed_forms()
    yield from field_checks.conservation()


def mean_radius(result: Result) -> float:
    """Return the mean radius of the grains at the end, m."""
    return float(result.state["radius"].mean())


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantity of ``tisim cost``: the mean radius over random starts.

    Impacts are chaotic, so a change in the last digit gives other agglomerates but the same mean.
    """
    return (Quantity("mean radius", mean_radius, random=True),)
