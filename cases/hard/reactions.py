"""Heat, reactions and bonds that run away.

Grains whose impacts heat them, soften them and make them react, at any temperature, until they merge into one
or break into fragments that fill all memory.
"""

import numpy as np

from tisim import Scene, run
from tisim.cases.common.runs import sound
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.reacting_flow import (
    BONDING_HARDNESS,
    STONE,
    STONE_HEAT_CAPACITY,
    STONE_MASS,
    STONE_RADIUS,
    energy,
    flow,
    laws,
)
from tisim.cases.hard.runs import by_id, given, momentum, verlet
from tisim.effects import DeformationWork, Friction, Heating, Impact, Reaction, Softening


def meeting(speed, effects, radius=STONE_RADIUS):
    """Return two equal grains at 300 K that just touch and approach at ``speed`` (m/s) each, for a very short
    time in which only the impact happens."""
    reach = radius * (1 - 1e-12)
    return Scene(
        particles=given(
            [[-reach, 0, 0], [reach, 0, 0]], [[speed, 0, 0], [-speed, 0, 0]], radius,
            STONE * 4 / 3 * np.pi * radius**3, temperature=300.0,
        ),
        effects=effects,
        stepper=verlet(1e-15),
        duration=1e-15,
    )  # fmt: skip


def restitution(result, speed):
    """Return the restitution of such an impact; 0 if the grains have bonded."""
    v = by_id(result.state)["velocity"][:, 0]
    return (v[1] - v[0]) / (2 * speed)


def balances(results):
    """Return the largest relative changes of mass, volume, momentum and energy."""
    rows = []
    for result in results:
        start, end = result.start, result.state
        size = (start["mass"] * np.linalg.norm(start["velocity"], axis=1)).sum()
        rows.append([
            abs(end["mass"].sum() / start["mass"].sum() - 1),
            abs((end["radius"] ** 3).sum() / (start["radius"] ** 3).sum() - 1),
            np.abs(momentum(end) - momentum(start)).max() / size,
            abs(energy(end) / energy(start) - 1),
        ])  # fmt: skip
    return np.max(rows, axis=0)


BALANCES = (
    Criterion("mass, relative change", 1e-14),
    Criterion("volume, relative change", 1e-13),
    Criterion("momentum, change over the sum of its magnitudes", 1e-13),
    Criterion("energy, relative change", 1e-12),
)


@hard_case(
    "Grains at 0 K, at 1e-30 K and up to 1e9 K collide, soften and react: exp(Q/RT) overflows, T^4 is 1e36.",
    Criterion("energy, relative change", 1e-11),
    Criterion("numbers that are not finite, and negative temperatures", 0, 0),
    Criterion("least number of impacts", least=11),
    Criterion("impacts whose iteration did not converge", 0, 0),
)
def absolute_zero_to_a_billion_kelvin():
    scenes = []
    for temperature in (0.0, 1e-30, 1e-3, 1.0, 1e6, 1e9):
        data = flow(seed=8, grains=60, hardness=1e5, duration=2e-4).to_dict()
        data["particles"]["quantities"]["temperature"] = temperature
        scenes.append(Scene.from_dict(data))
    results = sound(run(scenes))
    lost = sum((~np.isfinite(values)).sum() for result in results for values in result.state.values())
    lost += sum((result.state["temperature"] < 0).sum() for result in results)
    change = max(abs(energy(result.state) / energy(result.start) - 1) for result in results)
    work = [result.work for result in results]
    return change, lost, min(one["impacts"] for one in work), sum(one["unconverged"] for one in work)


def z04_iteration(pressure=0.5, iterations=200):
    """Return the history of e in the fixed-point iteration of Z04 for one hardness:
    e_(K+1) = max(1 - p / (1 - e_K), 0)."""
    e, history = 0.0, []
    for _ in range(iterations):
        e = max(1 - pressure / (1 - e), 0.0) if e < 1 else 0.0
        history.append(e)
    return np.array(history)


@hard_case(
    "Restitution and impact pressure depend on each other: the iteration printed in Z04 alternates for ever "
    "between bond and rebound.",
    Criterion("restitution from 1 - sqrt(p)", 1e-9),
    Criterion("last change of Z04's own iteration", least=0.49),
    figure="threshold",
)
def bond_or_rebound():
    pressure, hardness = 0.5, 1e6
    speed = np.sqrt(pressure * 3 * hardness / (2 * STONE))
    (result,) = sound(run([meeting(speed, (Impact(hardness=hardness),))]))
    wavers = np.ptp(z04_iteration(pressure)[-2:])
    return abs(restitution(result, speed) - (1 - np.sqrt(pressure))), wavers


def strongly_coupled(speed, iterations=200, **more):
    """Return an impact near the adhesion speed in which hot grains are soft, and soft grains get hot."""
    return meeting(
        speed,
        (
            Impact(hardness=1e5, max_iterations=iterations, **more), Friction(coefficient=0.9),
            Heating(heat_capacity=STONE_HEAT_CAPACITY), DeformationWork(),
            Softening(activation_energy=3000.0), Reaction(energy_density=3e4),
        ),
    )  # fmt: skip


@hard_case(
    "Heat softens, and softness heats: 300 speeds through the threshold above which grains bond.",
    Criterion("impacts whose iteration did not converge", 0, 0),
    Criterion("most iterations", 200),
    Criterion("largest rise of the restitution with speed", 1e-9),
    Criterion("pairs that bond", least=1, most=299),
    Criterion("speeds above which a pair bonds, and at which it does not", 0, 0),
)
def threshold_of_bonding():
    speeds, results = across_the_threshold()
    e = [restitution(result, v) for v, result in zip(speeds, results, strict=True)]
    bonds = np.array([result.work["bonds"] for result in results])
    return (
        sum(result.work["unconverged"] for result in results),
        max(result.work["iterations"] for result in results), np.diff(e).max(), bonds.sum(),
        (np.diff(bonds) < 0).sum(),
    )  # fmt: skip


def across_the_threshold():
    """Return 300 speeds (m/s) and the results of their impacts."""
    speeds = np.linspace(1.0, 40.0, 300)
    return speeds, sound(run([strongly_coupled(v) for v in speeds]))


@hard_case(
    "150 grains in a periodic box all merge into one sphere, also across its faces.",
    *BALANCES,
    Criterion("grains left", 1, 1),
    Criterion("radius by volume, relative error", 1e-13),
)
def all_grains_merge():
    (result,) = results = sound(
        run([flow(seed=5, grains=150, hardness=10.0, side=0.016, images=True, duration=0.05)])
    )
    radius = result.state["radius"]
    return *balances(results), len(radius), abs(radius[0] / (150 ** (1 / 3) * STONE_RADIUS) - 1)


@hard_case(
    "Grains merge, break, react and cool for thousands of steps, in four worlds of hard and soft grains.",
    *BALANCES,
    Criterion("merges", least=101),
    Criterion("fractures", least=31),
)
def grains_that_merge_and_break():
    kinds = [(3e5, 10.0), (3e6, 1.0), (3e6, 30.0), (1e7, 3.0)]
    results = sound(
        run([
            flow(
                seed=k, grains=80, hardness=hardness, surface_energy=surface, grain_mass=STONE_MASS / 2,
                threshold=0.79, duration=4e-3,
            )
            for k, (hardness, surface) in enumerate(kinds)
        ])
    )  # fmt: skip
    counts = (sum(result.work[name] for result in results) for name in ("merges", "fractures"))
    return *balances(results), *counts


@hard_case(
    "Two agglomerates of 32 grains break into 64 fragments, all that the world has room for.",
    *BALANCES,
    Criterion("fragments", 64, 64),
    Criterion("mass of a fragment, relative error", 1e-13),
)
def fragments_fill_every_slot():
    scene = meeting(1e3, laws(BONDING_HARDNESS, surface_energy=1.0), STONE_RADIUS * 32 ** (1 / 3))
    (result,) = results = sound(run([scene]))
    mass = result.state["mass"]
    number = len(np.unique(result.state["id"])) if scene.capacity() == 64 else 0
    return *balances(results), number, np.abs(mass / STONE_MASS - 1).max()
