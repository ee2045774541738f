"""Checks of charged and magnetised grains: closed forms for two grains, and conservation laws for charged
grains that merge.

Two grains of mass m and charges q and -q start at rest with their centres d_0 apart. Their distance d changes
as the position of one particle of the reduced mass mu = m/2. With k = q^2 / (4 pi epsilon_0), mu d'' = -k/d^2
gives

    t(d) = sqrt(mu d_0^3 / (2 k)) (arccos sqrt(u) + sqrt(u (1 - u))),    u = d/d_0

as in the gravitational fall of two masses; they meet at d = 2 b. Two moments M in line attract each other
with 3 mu_0 M^2 / (2 pi d^4) (L21 Eqs 4.8, 4.9), so their closing speed is

    v(d) = sqrt(mu_0 M^2 / (pi mu) (1/d^3 - 1/d_0^3)).

One charge in E_0 + E_1 sin(omega t) moves by (q/m) (E_0 t^2/2 + E_1 (omega t - sin omega t) / omega^2) (Z13
Eq. 16).
"""

from collections.abc import Iterator, Mapping

import numpy as np
from scipy.constants import epsilon_0, mu_0

import tisim
from tisim import Particles, Scene
from tisim.cases.agglomeration import fields
from tisim.cases.agglomeration import scene as agglomeration
from tisim.cases.case import Check
from tisim.effects import CARBONYL_IRON, Agglomeration, Impact
from tisim.steppers import FixedStep, Stepper, Verlet

RADIUS, GRAIN_DENSITY, START_DISTANCE = 1e-3, 5e3, 8e-3
"""The two grains of the checks: radius b (m), density (kg/m^3), initial distance d_0 of their centres (m)."""
MASS = GRAIN_DENSITY * 4 / 3 * np.pi * RADIUS**3
CHARGED: Mapping[str, float] = {**fields.NO_FIELDS, "surface_charge": 2e-3}
CHARGE = 4 * np.pi * RADIUS**2 * CHARGED["surface_charge"]
OWN_STEPPER = fields.stepper({**CHARGED, "density": GRAIN_DENSITY}, RADIUS)
"""The stepper that the case uses for the two charges."""
STEPS = 4000
"""Number of steps until two grains meet; the error is proportional to the square of the step."""
FORM_BOUND = 1e-7
"""Largest relative difference between a run of ``STEPS`` steps and a closed form."""
OWN_STEPPER_BOUND = 1e-3
"""Largest relative difference for a fall with the steps of the case."""
CONSERVATION_BOUND = 1e-12
"""Largest relative change of a conserved sum of hundreds of terms, from rounding."""


def fall_time(mass: float, charge: float, apart: float, distance: float) -> float:
    """Return the time (s) in which two grains fall from rest ``apart`` (m) to ``distance`` (m).

    mass : of each grain, kg. charge : of the two grains, + and - this value, C.
    """
    u = distance / apart
    attraction = charge**2 / (4 * np.pi * epsilon_0)
    scale = np.sqrt(0.5 * mass * apart**3 / (2 * attraction))
    return float(scale * (np.arccos(np.sqrt(u)) + np.sqrt(u * (1 - u))))


def dipole_speed(mass: float, moment: float, apart: float, distance: float) -> float:
    """Return the closing speed (m/s) of two grains with moments in line at ``distance`` (m), from rest
    ``apart`` (m).

    mass : of each grain, kg. moment : of each grain, A m^2.
    """
    return float(np.sqrt(2 * mu_0 * moment**2 / (np.pi * mass) * (distance**-3 - apart**-3)))


def iron_moment(flux: float) -> float:
    """Return the moment (A m^2) of an iron sphere of RADIUS in a field (T).

    It is the root of Froehlich's law for the magnetisation M, with H = B/mu_0 - M/3 inside the sphere.
    """
    chi, saturation = CARBONYL_IRON.parameters().values()
    field = flux / mu_0
    # chi H (M_s - M) = M_s M, a quadratic in M.
    b = saturation + chi * (field + saturation / 3)
    c = chi * field * saturation
    magnetisation = (2 * c) / (b + np.sqrt(b * b - 4 * chi / 3 * c))
    return float(4 / 3 * np.pi * RADIUS**3 * magnetisation)


def pair(
    design: Mapping[str, float], duration: float, stepper: Stepper, charges: tuple[float, float]
) -> Scene:
    """Return two grains at rest along x, which bond when they meet."""
    return Scene(
        name="pair",
        particles=Particles(
            position=((-START_DISTANCE / 2, 0, 0), (START_DISTANCE / 2, 0, 0)),
            velocity=np.zeros((2, 3)),
            radius=RADIUS,
            density=GRAIN_DENSITY,
            quantities={"charge": np.array(charges)},
        ),
        effects=(Impact(hardness=1.0), Agglomeration(), *fields.forces(design)),
        stepper=stepper,
        duration=duration,
    )


def meeting(stepper: Stepper, expected: float) -> float:
    """Return the time (s) at which two opposite charges meet, to a relative error of 1e-9.

    It is the duration of the shortest run in which they merge.
    """
    low, high = 0.9 * expected, 1.1 * expected
    while high - low > 1e-9 * expected:
        times = np.linspace(low, high, 32)
        ends = tisim.run([pair(CHARGED, t, stepper, (CHARGE, -CHARGE)) for t in times])
        first = int(np.argmax([end.work["merges"] > 0 for end in ends]))
        low, high = times[max(first - 1, 0)], times[first]
    return 0.5 * (low + high)


def closed_forms() -> Iterator[Check]:
    """Yield the fall of two opposite charges, the fall of two magnetised grains, and the path of one charge
    in a field."""
    time = fall_time(MASS, CHARGE, START_DISTANCE, 2 * RADIUS)
    for name, stepper, bound in (
        (f"{STEPS} steps", Verlet(control=FixedStep(dt=time / STEPS)), FORM_BOUND),
        ("steps of the case", OWN_STEPPER, OWN_STEPPER_BOUND),
    ):
        yield Check(
            f"time until opposite charges meet, {name} (s)", meeting(stepper, time), time, bound * time
        )

    flux, duration = 0.8, 2e-3
    magnetic = {**fields.NO_FIELDS, "magnetic_field": flux}
    stepper = Verlet(control=FixedStep(dt=duration / STEPS))
    (end,) = tisim.run([pair(magnetic, duration, stepper, (0.0, 0.0))])
    (x, _, _), (v, _, _) = (end.state[name][1] - end.state[name][0] for name in ("position", "velocity"))
    speed = dipole_speed(MASS, iron_moment(flux), START_DISTANCE, x)
    yield Check(
        f"closing speed of magnetised grains, distance reduced {START_DISTANCE / x:.3g} times (m/s)",
        -v,
        speed,
        FORM_BOUND * speed,
    )

    electric = {**CHARGED, "electric_field": 2e6, "electric_amplitude": 5e6, "electric_frequency": 300.0}
    (end,) = tisim.run([pair(electric, duration, stepper, (CHARGE, 0.0))])
    turn = 2 * np.pi * electric["electric_frequency"]
    way = electric["electric_field"] * duration**2 / 2
    way += electric["electric_amplitude"] * (turn * duration - np.sin(turn * duration)) / turn**2
    way *= CHARGE / MASS
    yield Check(
        "displacement of a charge in an oscillating field (m)",
        end.state["position"][0, 1],
        way,
        FORM_BOUND * way,
    )


def conservation() -> Iterator[Check]:
    """Yield the checks of charge, mass and momentum of a flow of charged grains that merge, without external
    fields."""
    soft = {**agglomeration.BEST, "hardness": 1e5, **CHARGED, "charge_ratio": -0.5}
    result = tisim.run(agglomeration.scene(soft, seed=1, grains=250))
    before, after = result.start, result.state
    yield Check("the run of the charged flow completes (1 = yes)", float(result.status.ok), 1.0, 0.0)
    yield Check(
        "grains at the end: initial number less mergers",
        250.0 - result.work["merges"],
        float(len(after["mass"])),
        0.0,
    )
    for name, unit in (("charge", "C"), ("mass", "kg")):
        bound = CONSERVATION_BOUND * np.abs(before[name]).sum()
        yield Check(f"{name} of the charged flow ({unit})", after[name].sum(), before[name].sum(), bound)
    momentum = [(s["mass"][:, None] * s["velocity"]).sum(axis=0) for s in (before, after)]
    bound = CONSERVATION_BOUND * (before["mass"] * np.linalg.norm(before["velocity"], axis=1)).sum()
    for axis in range(3):
        what = f"momentum of the charged flow along {'xyz'[axis]} (kg m/s)"
        yield Check(what, momentum[1][axis], momentum[0][axis], bound)
