"""The impact of two grains, written independently from Z04's equations, and random impacts for tests."""

import numpy as np
from scipy.optimize import brentq

from tests.scenes import HEAT_CAPACITY, scene
from tisim.effects import DeformationWork, Friction, Heating, Impact, Reaction, Softening

PAIRS = 300


DT = 1e-9


GAS_CONSTANT = 8.31446261815324


COMBINATIONS = {
    "impact": (),
    "friction": (Friction,),
    "heat": (Friction, Heating, DeformationWork, Reaction),
    "soft": (Heating, Softening),
    "all": (Friction, Heating, DeformationWork, Softening, Reaction),
}


def draw(rng):
    """One random oblique impact, as plain numbers: unequal grains, any direction, hard or soft."""
    radii = 1e-3 * 4.0 ** rng.uniform(0, 1, 2)
    density = 10.0 ** rng.uniform(3, 4, 2)
    normal = rng.normal(size=3)
    normal /= np.linalg.norm(normal)
    aside = rng.normal(size=3)
    v_n, v_t = 10.0 ** rng.uniform(0, 2), 10.0 ** rng.uniform(-2, 2)
    aside -= aside @ normal * normal
    v_i = rng.normal(size=3) * 50
    return {
        "radius": radii,
        "mass": density * 4 / 3 * np.pi * radii**3,
        "position": np.array([[0.0, 0, 0], normal * radii.sum() * (1 - 1e-9)]) + rng.normal(size=3),
        "velocity": np.array([v_i, v_i - v_n * normal + v_t * aside / np.linalg.norm(aside)]),
        "temperature": rng.uniform(100, 1000, 2),
        # So that |I_n| / (2 a H), cold, lies between 0.01 and 3 at e = 0.
        "hardness": density.mean() * v_n**2 * 10.0 ** rng.uniform(-1, 1.5),
        "beta": rng.uniform(0.5, 1.5),
        "a0": rng.choice([0.0, 0.3]),
        "af": rng.uniform(0.5, 1.0),
        "friction": 10.0 ** rng.uniform(-2, 0),
        "q": rng.uniform(0, 1000),
        "alpha": 10.0 ** rng.uniform(2, 5) * v_n**2 * radii.min() * 1e-2,
    }


def effects(pair, kinds):
    """The effects of a pair, with the laws in ``kinds``."""
    factories = {
        Friction: lambda: Friction(coefficient=pair["friction"]),
        Heating: lambda: Heating(heat_capacity=HEAT_CAPACITY),
        DeformationWork: DeformationWork,
        Softening: lambda: Softening(activation_energy=pair["q"]),
        Reaction: lambda: Reaction(energy_density=pair["alpha"]),
    }
    impact = Impact(
        hardness=pair["hardness"],
        deformation_length=pair["beta"],
        initial_area=pair["a0"],
        final_area=pair["af"],
        tolerance=1e-14,
    )
    return (impact, *(factories[kind]() for kind in kinds))


def as_scene(pair, kinds):
    return scene(
        pair["position"],
        pair["velocity"],
        effects(pair, kinds),
        radius=pair["radius"],
        mass=pair["mass"],
        dt=DT,
        quantities={"temperature": pair["temperature"]},
    )


def reference(pair, kinds):
    """The impact by Z04's equations in e itself; the coupled e-T problem is solved by bracketing, not by
    iteration."""
    m, b, v, t = pair["mass"], pair["radius"], pair["velocity"], pair["temperature"]
    r = pair["position"] + DT * v
    n = (r[1] - r[0]) / np.linalg.norm(r[1] - r[0])
    u_n, u_t = v @ n, v - np.outer(v @ n, n)
    approach = u_n[0] - u_n[1]
    least = b.min()

    def outcome(e):
        """Velocities, temperatures and energies for a restitution e (2.1)-(2.5), (4.17), (6.8)-(6.10)."""
        common = (m @ u_n) / m.sum()
        after_n = common + np.array([-1, 1]) * e * approach * m[::-1] / m.sum()
        time = 2 * pair["beta"] * least / approach * (1 + e)
        force = abs(m[0] * (after_n[0] - u_n[0]) / time)
        after_t = u_t.copy()
        slip = u_t[0] - u_t[1]
        if e == 0:
            after_t[:] = (m @ u_t) / m.sum()
        elif Friction in kinds and np.linalg.norm(slip) > 0:
            pull = min(pair["friction"] * force * time, np.linalg.norm(slip) / (1 / m).sum())
            after_t -= np.outer(np.array([1, -1]) * pull / m, slip / np.linalg.norm(slip))
        after = np.outer(after_n, n) + after_t
        # In the centre-of-mass frame of the pair (see impact.py on the paper's split).
        centre = (m @ v) / m.sum()
        loss = 0.5 * m * (((v - centre) ** 2).sum(axis=1) - ((after - centre) ** 2).sum(axis=1))
        area = (pair["a0"] + (pair["af"] - pair["a0"]) * (1 - e)) * np.pi * least**2
        work = m.prod() / m.sum() * approach**2 * (1 - e**2) / 3 * (DeformationWork in kinds)
        heat = pair["alpha"] * area * (Reaction in kinds)
        hot = t + (loss + work + heat) / (m * HEAT_CAPACITY) * (Heating in kinds)
        hard = pair["hardness"] * np.exp(pair["q"] / (GAS_CONSTANT * hot) * (Softening in kinds))
        return after, hot, force, area, hard.min(), work, heat

    def excess(e):
        """Negative if (3.1) requires a larger restitution than e."""
        _, _, force, area, hard, _, _ = outcome(e)
        return e - (1 - force / (2 * area * hard))

    # The root nearest to bonding, which is also where the paper's iteration starts.
    e = 0.0
    if excess(0.0) < 0:
        grid = 1 - np.geomspace(1, 1e-6, 300)
        first = next(k for k in range(1, len(grid)) if excess(grid[k]) >= 0)
        e = brentq(excess, grid[first - 1], grid[first], xtol=1e-16, rtol=1e-14)
    after, hot, _, _, _, work, heat = outcome(e)
    return {"velocity": after, "temperature": hot, "work": work, "heat": heat, "e": e}
