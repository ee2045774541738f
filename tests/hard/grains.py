"""Grains under all Z16 contact laws in one scene structure, and pair quantities by quadrature."""

import numpy as np
from scipy.integrate import quad

from tests.scenes import by_id, compiled, fixed, scene
from tisim.backend.taichi import ti
from tisim.components.component import Vector
from tisim.effects import (
    Contact,
    ContactBond,
    ContactDissipation,
    ContactFriction,
    ContactSoftening,
    Force,
    Gravity,
    Tether,
    parameter,
)

WORLDS, CAPACITY = 6, 12
K, R, SPRING = 1e6, 1.0, 1e5
"""Stiffness (N/m^2) and radius (m) of all grains here, and the stiffness of the anchor springs (N/m)."""


class Held(Force):
    """A spring to its anchor for each of the first ``number`` particles; a constant pull for the others."""

    fields = Tether.fields
    number: float = parameter("", "number", 0.0, ge=0)
    pull: Vector = parameter("N", "pull", (0.0, 0.0, 0.0))

    @ti.func
    def force(self, s, w, i, t):
        total = SPRING * (s.anchor[w, i] - s.position[w, i])
        if s.id[w, i] >= self.number(w):
            total = self.pull(w)
        return total


def grains(position, velocity, dt, steps, mass=1.0, temperature=300.0, **laws):
    """A scene of grains of radius R; without ``laws`` only the contact acts. Bonds have an exponent of 1."""
    friction, bond = laws.get("friction", (0, 0, 0)), laws.get("bond", (0, 0, 0.99))
    position = np.asarray(position, float)
    effects = (
        Contact(stiffness=K),
        ContactSoftening(sensitivity=laws.get("sensitivity", 0.0), reference_temperature=300.0),
        ContactDissipation(damping=laws.get("damping", 0.0)),
        ContactFriction(stiffness=friction[0], static=friction[1], dynamic=friction[2]),
        ContactBond(stiffness=bond[0], exponent=1, grip_stiffness=bond[1], threshold=bond[2]),
        Gravity(acceleration=(0, 0, -laws.get("gravity", 0.0))),
        Held(number=laws.get("held", 0), pull=laws.get("pull", (0, 0, 0))),
    )
    quantities = {
        "spin": np.array(laws.get("spin", np.zeros_like(position)), float),
        "temperature": temperature,
        "anchor": np.asarray(laws.get("anchor", position)),
    }
    more = {"quantities": quantities, "stepper": fixed(dt), "duration": dt * steps}
    return scene(position, velocity, effects, R, mass=mass, **more)


def watched(scenes, looks=1):
    """The results, and the states of each world at the start and after each of ``looks`` equal parts of its
    run."""
    simulation = compiled(scenes[0], WORLDS, CAPACITY)
    simulation.load(scenes)
    steps = max(round(m.duration / m.stepper.control.dt) for m in scenes)
    states_by_world = [[by_id(result)] for result in simulation.results()]
    for _ in range(looks):
        simulation.run(steps=-(-steps // looks))
        for states, result in zip(states_by_world, simulation.results(), strict=True):
            states.append(by_id(result))
    return simulation.results(), states_by_world


def run(scenes):
    results, _ = watched(scenes)
    for result in results:
        assert result.status.ok, result.status.reason
    return [by_id(result) for result in results]


def area(d):
    """Contact area, Z16 (B.5), m^2."""
    return np.pi * max(R**2 - d**2 / 4, 0.0) * (d < 2 * R)


def push(d):
    """Contact force, Z16 (7.3), N."""
    return K * (1 - d / (2 * R)) ** 2 * area(d)


def stored_energy(d):
    """Energy stored in the contact, J."""
    return quad(push, d, 2 * R)[0] if d < 2 * R else 0.0


def kinetic(state):
    """Kinetic energy with rotation, J."""
    turning = 0.4 * state["mass"] * state["radius"] ** 2 * (state["spin"] ** 2).sum(axis=1)
    return 0.5 * (state["mass"] * (state["velocity"] ** 2).sum(axis=1) + turning).sum()


def angular_momentum(state):
    """Total angular momentum about the origin, kg m^2/s."""
    orbit = np.cross(state["position"], state["mass"][:, None] * state["velocity"])
    return (orbit + 0.4 * (state["mass"] * state["radius"] ** 2)[:, None] * state["spin"]).sum(axis=0)
