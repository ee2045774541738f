"""Mixtures of unequal sizes and stiffnesses, and a bed compressed by a piston at the speed of sound."""

import numpy as np
import pytest

from tests.effects.contact.grains import cell
from tests.hard.granular_scenes import grains, kinetic, loaded
from tests.scenes import by_id, roundoff

pytestmark = pytest.mark.slow


def test_a_mixture_comes_to_rest_and_bears_its_weight(rng):
    """Two large grains fall on small ones on a floor; both materials occur in each size.

    At the end the forces on every grain balance, and floor and sides bear the weight. The energy never
    exceeds its initial value.
    """
    g, side = 1.0, 0.25
    spots = np.stack(np.meshgrid(*[0.03 * np.arange(8) + 0.02] * 2), axis=-1).reshape(-1, 2)[:62]
    small = np.column_stack([spots + 0.004 * rng.uniform(-1, 1, spots.shape), np.full(62, 0.0051)])
    place = np.vstack([[[0.105, 0.108, 0.115], [0.145, 0.142, 0.32]], small])
    radius = np.repeat([0.1, 0.005], [2, 62])
    law = {
        "restitution": 0.2, "friction": 0.5, "rolling_friction": 0.2, "rolling_stiffness": 200.0,
        "rolling_damping": 10.0, "twisting_friction": 1e-3, "twisting_stiffness": 1e-3,
        "twisting_damping": 1e-5,
    }  # fmt: skip
    made = grains(
        "hooke", place, np.zeros((64, 3)), planes=cell(side)[:3] + cell(side)[3:5], gravity=(0, 0, -g),
        radius=radius, mass=500 * 4 / 3 * np.pi * radius**3, material=np.arange(64) // 2 % 2,
        first={**law, "stiffness": 1e3}, second={**law, "stiffness": 1e6}, dt=4e-6, steps=1_000_000,
    )  # fmt: skip
    simulation = loaded([made])
    energies = []
    for _ in range(200):
        (result,) = simulation.results()
        state = result.state
        energies.append(kinetic(state).sum() + g * (state["mass"] * state["position"][:, 2]).sum())
        simulation.run(steps=5000)
    (result,) = simulation.results()
    assert result.status.ok
    state, weight = by_id(result), g * result.state["mass"]
    assert max(energies) < energies[0] * (1 + 1e-6 + 1e2 * roundoff())
    assert energies[-1] < 0.95 * energies[0]
    rest = np.linalg.norm(state["force"], axis=1)
    assert (rest < 1e-6 * weight).all()
    assert result.measures["walls_force_z"] == pytest.approx(-weight.sum(), rel=1e-6)


YOUNG, POISSON = 1e6, 0.3
E_STAR = YOUNG / (2 * (1 - POISSON**2))
PRESSED = 1e-4
"""Overlap divided by the radius (m) at which the speed of sound in the bed equals the piston speed."""
SOUND = 2 * (2 * E_STAR * (0.5 * PRESSED) ** 0.5) ** 0.5
"""Speed of sound (m/s) in a chain of grains of 1 kg and 1 m."""
SIDE, TOP, TRAVEL = 6.0, 8.1, 1.6
"""Side of the bed, initial height of the piston and its travel, m."""


def contacts(state, height):
    """Overlap (m), R*, m* and closing speed (m/s) of all pairs, and of all grains with the six walls."""
    r, v = state["position"], state["velocity"]
    i, j = np.triu_indices(len(r), 1)
    apart = r[j] - r[i]
    d = np.linalg.norm(apart, axis=1)
    closing = -((v[j] - v[i]) * apart).sum(axis=1) / d
    walls = [(axis, np.zeros(3), np.zeros(3)) for axis in np.eye(3)]
    walls += [(-axis, SIDE * axis, np.zeros(3)) for axis in np.eye(3)[:2]]
    walls.append((np.array([0, 0, -1.0]), np.array([0, 0, height]), np.array([0, 0, -SOUND])))
    rows = [np.stack([2 - d, 0 * d + 0.5, 0 * d + 0.5, closing])]
    for normal, point, speed in walls:
        gap = (r - point) @ normal
        rows.append(np.stack([1 - gap, 0 * gap + 1, 0 * gap + 1, -(v - speed) @ normal]))
    found = np.concatenate(rows, axis=1)
    return found[:, found[0] > 0]


def test_the_work_of_a_piston_equals_the_energy_of_the_bed(rng):
    """The work of the piston equals the kinetic, contact and damping energy at all times.

    With friction the work exceeds the kinetic and contact energy. No grain passes through a wall.
    """
    layers = np.stack(np.meshgrid(*[2.0 * np.arange(3) + 1] * 2, 2.0 * np.arange(4) + 1), axis=-1)
    place = layers.reshape(-1, 3) + 0.02 * rng.uniform(-1, 1, (36, 3))
    planes = [*cell(SIDE)[:5]]
    steps, dt = 2000, TRAVEL / SOUND / 2000
    made = [
        grains(
            "mindlin", place, np.zeros((36, 3)), planes=planes, dt=dt, steps=steps,
            piston=(((0.0, 0.0, TOP), (0.0, 0.0, -1.0)), (0.0, 0.0, -SOUND)),
            first={"restitution": e, "friction": mu},
        )
        for e, mu in ((1.0, 0.0), (0.5, 0.0), (0.5, 0.5))
    ]  # fmt: skip
    simulation = loaded(made)
    work, lost, energy = (np.zeros((steps + 1, 3)) for _ in range(3))
    force, power = np.zeros((steps + 1, 3)), np.zeros((steps + 1, 3))
    for k in range(steps + 1):
        for w, result in enumerate(simulation.results()):
            assert result.status.ok or result.status.reason == "running", result.status.reason
            state, height = by_id(result), TOP - SOUND * result.time
            overlap, radius, mass, closing = contacts(state, height)
            stiff = 2 * E_STAR * np.sqrt(radius * overlap)
            log = np.log(made[w].materials["first"].restitution)
            drag = -2 * (5 / 6) ** 0.5 * log / np.hypot(log, np.pi) * np.sqrt(stiff * mass)
            force[k, w], power[k, w] = result.measures["piston_force_z"], (drag * closing**2).sum()
            held = (8 / 15 * E_STAR * radius**0.5 * overlap**2.5).sum()
            energy[k, w] = kinetic(state).sum() + held
            low, high = state["position"].min(axis=0), state["position"].max(axis=0)
            assert (low > 0).all()
            assert (high < [SIDE, SIDE, height]).all()
        simulation.run(steps=1)
    work[1:] = np.cumsum((force[1:] + force[:-1]) / 2 * SOUND * dt, axis=0)
    lost[1:] = np.cumsum((power[1:] + power[:-1]) / 2 * dt, axis=0)
    balance = (energy - energy[0] + lost - work) / work[-1]
    assert (work[-1] > 10 * 0.5 * SOUND**2).all()
    np.testing.assert_allclose(balance[:, 0], 0, atol=1e-6 + 1e2 * roundoff())
    np.testing.assert_allclose(balance[:, 1], 0, atol=2e-4)
    assert lost[-1, 0] == 0 < 0.1 * work[-1, 1] < lost[-1, 1]
    assert balance[:, 2].max() < 2e-4
    assert balance[-1, 2] < -2e-3
