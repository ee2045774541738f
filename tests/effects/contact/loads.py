"""Random particles, the initial forces on them, read without a step, and helpers shared by NumPy
references."""

import numpy as np

from tests.scenes import compiled, scene
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.effects import Force
from tisim.engine.assembly import needed_fields
from tisim.state.fields import CORE, resolve_fields
from tisim.steppers.common import FORCE_BEFORE, TORQUE_BEFORE

WORLDS = 8
"""Number of worlds at a time: the same for all, so that each structure is compiled once."""


def vector(rng, scale=1.0):
    """A vector of random components."""
    return tuple(float(x) for x in rng.normal(size=3) * scale)


def cloud(rng, effects, n=12, **more):
    """Random particles, each with its own radius and mass."""
    radius, mass = rng.uniform(0.1, 1, n), rng.uniform(1, 2, n)
    return scene(rng.normal(size=(n, 3)), rng.normal(size=(n, 3)), effects, radius=radius, mass=mass, **more)


def loads(scenes, dt=0.0, capacity=16):
    """Initial states of scenes of one structure, with force, and with torque if there is one.

    dt : the step (s) in which the forces are evaluated.
    """
    simulation = compiled(scenes[0], worlds=WORLDS, capacity=capacity)
    simulation.load(scenes)
    simulation.s.write("dt", np.full(WORLDS, dt))
    simulation.first.advance(1)
    columns = {field.name: simulation.s.read(field.name) for field in simulation.s.fields}
    counts = simulation.s.read("count")
    assert (simulation.s.read("failed") == 0).all()
    return [
        {name: column[w, :n] for name, column in columns.items()} for w, n in enumerate(counts[: len(scenes)])
    ]


@in_taichi_thread
@ti.kernel
def _jacobians(s: ti.template(), effect: ti.template(), out: ti.types.ndarray()):
    for w in range(s.worlds):
        for i in range(s.count[w]):
            jacobian = effect.velocity_jacobian(s, w, i, s.time[w])
            for a, b in ti.static(ti.ndrange(3, 3)):
                out[w, i, a, b] = jacobian[a, b]


def jacobians(scenes, step, capacity=16):
    """velocity_jacobian of the only force of these scenes, and its central difference; step in m/s."""
    simulation = compiled(scenes[0], worlds=WORLDS, capacity=capacity)
    simulation.load(scenes)
    (force,) = simulation.assembly.effects.of(Force)
    assert force.data.offers("velocity_jacobian")
    claimed = np.zeros((WORLDS, capacity, 3, 3))
    _jacobians(simulation.s, force, claimed)
    start = simulation.s.read("velocity")
    difference = np.zeros_like(claimed)
    for b, sign in ((b, sign) for b in range(3) for sign in (1, -1)):
        simulation.s.write("velocity", start + sign * step * np.eye(3)[b])
        simulation.first.advance(1)
        difference[..., b] += sign * simulation.s.read("force") / (2 * step)
    n = [len(scene.particles.position) for scene in scenes]
    return [claimed[w, : n[w]] for w in range(len(n))], [difference[w, : n[w]] for w in range(len(n))]


def fields_beside_the_core(setup):
    """Names of the fields that the effects of a scene allocate, in addition to position, velocity, mass,
    radius and id. Fields of the guard of explicit steps are left out."""
    fields = resolve_fields(needed_fields(setup.effects, setup.stepper))
    return {field.name for field in fields} - {field.name for field in (*CORE, FORCE_BEFORE, TORQUE_BEFORE)}


def pairs(state):
    """Unit vectors from each particle to each other, (n, n, 3), and distances; to itself they are 0 and 1."""
    gap = state["position"][None] - state["position"][:, None]
    distance = np.linalg.norm(gap, axis=2) + np.eye(len(gap))
    return gap / distance[..., None], distance


def close(actual, expected, tolerance=1e-12):
    """Assert that two arrays are equal to within a fraction of the largest component."""
    np.testing.assert_allclose(actual, expected, rtol=0, atol=tolerance * np.abs(expected).max())


def balanced(state, tolerance=1e-13):
    """Assert that forces sum to zero, and so does the total torque."""
    force, moment = state["force"], np.cross(state["position"], state["force"])
    np.testing.assert_allclose(force.sum(axis=0), 0, atol=tolerance * np.abs(force).sum())
    scale = np.abs(moment).sum()
    if "torque" in state:
        moment, scale = moment + state["torque"], scale + np.abs(state["torque"]).sum()
    np.testing.assert_allclose(moment.sum(axis=0), 0, atol=tolerance * scale)
