"""Magnetic moments near divergence.

Moments that magnetise each other beyond all bounds, from zero field to saturation, and magnets in unstable
balance.
"""

import numpy as np
from scipy.constants import Boltzmann, mu_0

from tisim import Material, Scene, run
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.runs import by_id, ends, given, kinetic, looks, missing, solved, verlet
from tisim.effects import (
    DipoleDipole,
    Granular,
    Hooke,
    LangevinMoment,
    LinearSpring,
    Magnetophoresis,
    Mie,
    MutualFroehlichMoment,
    MutualInducedMoment,
    NearField,
    PermanentMoment,
    RestitutionDamping,
    TruncatedDipoleDipole,
)
from tisim.sources import MagneticField

SOFT_IRON = 1e6 - 1
"""Susceptibility of a material with a relative permeability of 1e6."""


def magnetised(place, **options):
    """Return spheres with mu_r = 1e6 and a radius of 1 m in 1 T along z."""
    place = np.asarray(place, float)
    law = MutualInducedMoment(susceptibility=SOFT_IRON, **options)
    return Scene(
        particles=given(place, 0 * place, 1.0, 1.0),
        effects=(MagneticField(constant=(0, 0, 1)), law),
        stepper=verlet(1e-9),
        duration=1e-9,
    )


def in_line(height):
    """Return the moments (A m^2) of such spheres at heights (m) in line with the field, by a linear solve."""
    height = np.asarray(height, float)
    gain = SOFT_IRON / (3 + SOFT_IRON)
    apart = np.abs(height[:, None] - height) + np.diag(np.full(len(height), np.inf))
    return np.linalg.solve(
        np.eye(len(height)) - 2 * gain / apart**3, np.full(len(height), 4 * np.pi / mu_0 * gain)
    )


TO_ROUNDING = {"sweeps": 2000, "tolerance": 1e-12}
"""Options of moments that are solved to rounding."""


@hard_case(
    "Two spheres of mu_r = 1e6 overlap along the field: below 1.26 radii their moments have no finite "
    "solution. And a chain of 50.",
    Criterion("moments of pairs at 2 and 1.27 radii, relative error", 1e-9),
    Criterion("moments of the chain, relative error", 1e-9),
    Criterion("words missing from the message at 1.25 and 0.5 radii", 0, 0),
    Criterion("growth of a sweep there over 2 R^3/d^3, relative error", 1e-4),
    figure="divergence",
)
def moments_near_divergence(acceleration="anderson"):
    """acceleration : of the sweeps, "none" or "anderson"."""
    places = [[0, 2.0], [0, 1.27], 2.0 * np.arange(50.0), [0, 1.25], [0, 0.5]]
    results = solved([
        magnetised(np.outer(z, [0, 0, 1]), acceleration=acceleration, **TO_ROUNDING) for z in places
    ])  # fmt: skip
    errors = [
        np.abs(by_id(result.state)["moment"] / in_line(z)[:, None] - [0, 0, 1]).max()
        for result, z in zip(sound(results[:3]), places, strict=False)
    ]
    words = (
        "effects.mutual_induced_moment, at particle", "does not converge: a sweep multiplies the change by"
    )  # fmt: skip
    growth = [
        result.measures["sweep_factor"] / (2 / d**3) - 1
        for result, d in zip(results[3:], (1.25, 0.5), strict=True)
    ]
    return max(errors[:2]), errors[2], sum(missing(one, *words) for one in results[3:]), np.abs(growth).max()


@hard_case(
    "Superparamagnetic grains in fields from 1e-12 to 1e6 times their thermal field: L(x) cancels to "
    "rounding for small x.",
    Criterion("moment, relative error", 1e-12),
)
def zero_field_to_saturation():
    n, law = np.array([2.0, -3.0, 6.0]) / 7, LangevinMoment(temperature=300.0)
    thermal = Boltzmann * 300.0
    arguments = np.array([1e-12, 1e-6, 1e3, 1e6])
    states = ends([
        Scene(
            particles=given((0, 0, 0), (0, 0, 0), 1e-3, 1.0, saturation_moment=thermal),
            effects=(MagneticField(constant=tuple(x * n)), law, Magnetophoresis()),
            stepper=verlet(1e-9),
            duration=1e-9,
        )
        for x in arguments
    ])  # fmt: skip
    exact = np.where(arguments < 1, arguments / 3, 1 - 1 / arguments)
    return [np.abs(np.array([one["moment"][0] for one in states]) / thermal / exact[:, None] / n - 1).max()]


@hard_case(
    "Two magnets fall on each other head to tail and rebound from hard cores (d^-30), twenty times.",
    Criterion("energy, largest relative change", 1e-3),
    Criterion("turns of the distance", least=31),
    Criterion("least distance over the diameter", least=0.9, most=2 ** (1 / 15)),
)
def magnets_that_snap_together():
    moment, bottom = 4e3, 2 * 2 ** (1 / 15)
    scene = Scene(
        particles=given([[0, 0, -1.3], [0, 0, 1.3]], np.zeros((2, 3)), 1.0, 1.0, moment=[[0, 0, moment]] * 2),
        effects=(DipoleDipole(), Mie(epsilon=3.0)),
        stepper=verlet(1e-3),
        duration=60.0,
    )
    (states,) = looks([scene], 200)
    gaps = np.array([np.linalg.norm(np.diff(state["position"], axis=0)) for state in states])
    wall = np.where(gaps < bottom, 3 * (4 * ((2 / gaps) ** 30 - (2 / gaps) ** 15) + 1), 0.0)
    energy = np.array([kinetic(state) for state in states])
    energy += wall - 2 * mu_0 / (4 * np.pi) * moment**2 / gaps**3
    turns = (np.diff(np.sign(np.diff(gaps))) != 0).sum()
    return np.abs(energy / energy[0] - 1).max(), turns, gaps.min() / 2


@hard_case(
    "Two magnets are held head to head in unstable balance, exactly and with an offset of 1e-3 rad.",
    Criterion("in exact balance: spin, rad/s", 0, 0),
    Criterion("with the offset: energy, change over the energy of the pair", 1e-3),
    Criterion("with the offset: largest change of a moment, over the moment", least=0.5),
)
def antiparallel_magnets():
    size, tilt, power = 1e3, 1e-3, 13
    hold = NearField(alpha1=0.4, beta1=1, alpha2=0.2 * 2.0**power, beta2=power)

    def pair(x, z):
        return Scene(
            particles=given(
                [[0, 0, 0], [0, 0, 2.2]], np.zeros((2, 3)), 1.0, 1.0,
                moment=size * np.array([[0, 0, 1.0], [x, 0, z]]), spin=np.zeros((2, 3)),
            ),
            effects=(PermanentMoment(), DipoleDipole(), hold),
            stepper=verlet(2e-3),
            duration=60.0,
        )  # fmt: skip

    def energy(state):
        gap = state["position"][1] - state["position"][0]
        d = np.linalg.norm(gap)
        a, b = state["moment"]
        dipoles = mu_0 / (4 * np.pi * d**3) * (a @ b - 3 * (a @ gap) * (b @ gap) / d**2)
        return kinetic(state) + dipoles + 0.4 * np.log(d) + 0.2 * 2.0**power / 12 / d**12

    still, moving = sound(run([pair(0.0, -1.0), pair(np.sin(tilt), -np.cos(tilt))]))
    before, after = by_id(moving.start), by_id(moving.state)
    scale = 2e-7 * size**2 / 2.2**3
    turned = np.linalg.norm(after["moment"] - before["moment"], axis=1).max() / size
    return np.abs(still.state["spin"]).max(), abs(energy(after) - energy(before)) / scale, turned


def soft_chain(stiffness=1e5, saturation=1.7e6, **more):
    """Return five grains in a row, just in contact, whose moments are updated by one sweep in each step.

    stiffness : of the contacts, N/m. saturation : magnetisation, A/m.
    """
    place = np.array([[0, 0, 2.0 * k] for k in range(5)])
    moment = MutualFroehlichMoment(
        susceptibility=1e3, saturation=saturation, sweeps=0, cutoff=6.0, shifted=True, **more
    )
    return Scene(
        particles=given(place, 0 * place, 1.0, 1.0),
        materials={"steel": Material(stiffness=stiffness, restitution=0.1, friction=0.5)},
        effects=(
            Granular(normal=Hooke(), damping=RestitutionDamping(), tangential=LinearSpring()),
            MagneticField(constant=(0, 0, 1e-3)), moment, TruncatedDipoleDipole(cutoff=6.0, shifted=True),
        ),
        stepper=verlet(1e-4),
        duration=4.0,
    )  # fmt: skip


@hard_case(
    "A chain of soft grains without saturation collapses: its moments grow by a factor in each step.",
    Criterion("words missing from the message", 0, 0),
    Criterion("largest speed in the state kept, m/s", 100),
    Criterion("largest speed without the guard, m/s", least=1e6),
)
def collapse_of_soft_magnets():
    guarded, free = run([
        soft_chain(1.0, 1e12), soft_chain(1.0, 1e12, largest_change=2.0)
    ])  # fmt: skip
    words = (
        "does not converge: a sweep multiplies the change by",
        "by effects.mutual_froehlich_moment, at particle",
    )
    lost = missing(guarded, *words)
    # Another guard stops the free run when it has exploded.
    return lost, np.abs(guarded.state["velocity"]).max(), np.abs(free.state["velocity"]).max()
