"""Extreme ratios of mass, size and stiffness.

Light particles beside heavy ones, small beside large and soft beside stiff, in one scene.
"""

import numpy as np
from scipy.integrate import solve_ivp

from tisim import Scene, run
from tisim.cases.common.runs import sound
from tisim.cases.hard.granular import HERTZ_MINDLIN_LAW, GrainLaw
from tisim.cases.hard.hard_case import Criterion, hard_case
from tisim.cases.hard.impacts import touching
from tisim.cases.hard.reacting_flow import STONE
from tisim.cases.hard.runs import by_id, ends, given, kinetic, momentum
from tisim.cases.hard.springs import tight
from tisim.effects import NearField


@hard_case(
    "1 g and 1 t vibrate about the balance of an attraction and a repulsion, in both orders.",
    Criterion("distance against SciPy's DOP853 at 1e-11, m of 0.1", 2e-5),
    Criterion("relative velocity, m/s of 10", 2e-3),
    Criterion("total momentum over the exchanged momentum", 1e-9),
    Criterion("energy, relative error", 1e-7),
)
def masses_a_million_apart(stepper=tight):
    """stepper : function of the first and the longest step."""
    light, heavy, duration = 1e-3, 1e3, 1.003
    reduced = light * heavy / (light + heavy)
    states = ends([
        Scene(
            particles=given([[0, 0, 0], [0.6, 0, 0]], np.zeros((2, 3)), 1e-3, mass),
            effects=(NearField(alpha1=2.0, alpha2=1.0),),
            stepper=stepper(first=1e-3, longest=1e-2),
            duration=duration,
        )
        for mass in ([light, heavy], [heavy, light])
    ])  # fmt: skip
    exact = solve_ivp(
        lambda _, y: [y[1], -(2 / y[0] - 1 / y[0] ** 2) / reduced], (0, duration), [0.6, 0.0], "DOP853",
        rtol=1e-11, atol=1e-11,
    ).y[:, -1]  # fmt: skip
    rows = []
    for state in states:
        (distance, *_), (opening, *_) = (np.diff(state[name], axis=0)[0] for name in ("position", "velocity"))
        exchanged = light * np.abs(state["velocity"]).max()
        energy = kinetic(state) + 2 * np.log(distance) + 1 / distance
        rows.append([
            abs(distance - exact[0]), abs(opening - exact[1]), np.abs(momentum(state)).max() / exchanged,
            abs(energy / (2 * np.log(0.6) + 1 / 0.6) - 1),
        ])  # fmt: skip
    return np.max(rows, axis=0)


@hard_case(
    "Hard spheres with radii up to 1 : 1e9 and masses up to 1 : 1e27 rebound or bond.",
    Criterion("momentum, relative change", 1e-14),
    Criterion("rebound of the light sphere as from a wall, relative error", 1e-3),
    Criterion("pairs that did not rebound, or did not bond", 0, 0),
)
def spheres_of_unequal_size():
    scenes = []
    for hardness in (1e12, 1e-3):
        for small, large, density in ((1e-6, 1e-3, STONE), (1e-6, 1e-3, [1.0, 1e4]), (1e-9, 1.0, STONE)):
            mass = np.asarray(density) * 4 / 3 * np.pi * np.array([small, large]) ** 3
            scenes.append(touching((small + large) * (1 - 1e-12), 10.0, hardness, [small, large], mass))
    results = sound(run(scenes))
    moved = max(np.abs(momentum(one.state) / momentum(one.start) - 1).max() for one in results)
    rebound = max(
        np.abs(by_id(one.state)["velocity"][0] / -one.start["velocity"][0] - 1).max() for one in results[:3]
    )
    merges = [one.work["merges"] for one in results]
    wrong = sum(one.work["impacts"] != 1 for one in results) + (merges != [0, 0, 0, 1, 1, 1])
    return moved, rebound, wrong


@hard_case(
    "A grain hits another of 1e-6 to 1e6 times its mass.",
    Criterion("restitution, relative error", 5e-3),
    Criterion("momentum and angular momentum, change over the momentum at the start", 2e-13),
)
def restitution_of_unlike_masses(law: GrainLaw = HERTZ_MINDLIN_LAW, restitution=0.5):
    """law : the law of contact. restitution : of its material; 1 for a law without."""
    ratios = np.array([1e-6, 1e-3, 1.0, 1e3, 1e6])
    scenes = [
        law.scene(
            [[0, 0, 9], [2, 0, 9]],
            [[(1 + 1 / ratio) ** 0.5, 0, 0], [0, 0, 0]],
            mass=[1.0, ratio],
            first={"restitution": restitution} if restitution < 1 else {},
            dt=1e-4 * (ratio / (1 + ratio)) ** 0.5,
            steps=4000,
        )
        for ratio in ratios
    ]
    parting, moved = [], []
    for ratio, scene, state in zip(ratios, scenes, ends(scenes), strict=True):
        fastest = (1 + 1 / ratio) ** 0.5
        parting.append(abs(np.diff(state["velocity"][:, 0])[0] / (restitution * fastest) - 1))
        start = scene.start()
        scale = (start["mass"] * np.linalg.norm(start["velocity"], axis=1)).sum()
        moved.append(np.abs(momenta(state) - momenta(start)).max() / scale)
    return max(parting), max(moved)


def momenta(state):
    """Return the total momentum, and the total angular momentum about the origin; shape (6,)."""
    linear = state["mass"][:, None] * state["velocity"]
    inertia = 0.4 * (state["mass"] * state["radius"] ** 2)[:, None]
    turning = np.cross(state["position"], linear) + inertia * state["spin"]
    return np.concatenate([linear, turning], axis=1).sum(axis=0)


@hard_case(
    "Small grains fly at four large ones 20 times their size and 8000 times their mass; every other grain is "
    "1000 times stiffer.",
    Criterion("momentum and angular momentum, change over the momentum at the start", 1e-12),
    Criterion("kinetic energy left", 0.9),
    Criterion("grains that have collided", least=31),
)
def mixture_of_grains(law: GrainLaw = HERTZ_MINDLIN_LAW):
    """law : the law of contact."""
    draw = np.random.Generator(np.random.Philox(20040101))
    soft = law.unbonded()
    stiff = {key: 1e3 * soft[key] for key in ("stiffness", "young") if key in soft}
    corners = np.array([[1, 1, 1], [-1, -1, 1], [-1, 1, -1], [1, -1, -1]]) * 0.16
    out = draw.normal(size=(60, 3))
    out *= draw.uniform(0.55, 0.8, 60)[:, None] / np.linalg.norm(out, axis=1)[:, None]
    place, radius = np.vstack([corners, out]), np.repeat([0.2, 0.01], [4, 60])
    velocity = -np.repeat([1.0, 5.0], [4, 60])[:, None] * place + draw.normal(size=(64, 3))
    scene = law.scene(
        place, velocity, 20 * draw.normal(size=(64, 3)), radius=radius, mass=8e3 * radius**3,
        first=soft, second={**soft, **stiff}, material=np.arange(64) % 2, dt=2e-6, steps=100_000,
    )  # fmt: skip
    (state,), start = ends([scene]), scene.start()
    scale = (start["mass"] * np.linalg.norm(start["velocity"], axis=1)).sum()
    collided = np.abs(state["velocity"] - start["velocity"]).max(axis=1) > 1e-3
    return (
        np.abs(momenta(state) - momenta(start)).max() / scale,
        kinetic(state) / kinetic(start),
        collided.sum() if collided[:4].all() else 0,
    )
