"""Energy minimisation: steps of FIRE against a NumPy reference, and packings at their jamming density."""

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from tests.scenes import compiled, simulate
from tests.shapes.pairs import Bodies, superquadric_contacts
from tests.steppers.packing.bits import same_bits
from tests.steppers.packing.test_mechanical_contraction import (
    CAPACITY,
    CUBOID,
    ELLIPSOID,
    ROD,
    SPHERE,
    deepest,
    fraction,
    hard,
    rod_contact,
)
from tisim import Box, InputError, Particles, Scene, run
from tisim.effects import Gravity
from tisim.steppers import EnergyMinimisation

pytestmark = pytest.mark.long

WORLDS = 3
"""The same in quick tests, so that they share a compiled simulation."""
RELATIVE = 1 + 1e-9
"""Overlaps are recomputed in NumPy."""


def scene(
    shape, number, packed=0.2, seed=0, duration=1e6, spread=0.0, stepper=EnergyMinimisation, **settings
):
    """Bodies at random places of a cubic box; they may overlap. spread : relative range of their sizes."""
    side, draw = (number * shape.volume() / packed) ** (1 / 3), np.random.default_rng(seed)
    particles = Particles(
        position=draw.uniform(0, side, (number, 3)),
        velocity=np.zeros((number, 3)),
        mass=np.ones(number),
        radius=shape.bounding_radius() * draw.uniform(1 - spread, 1 + spread, number),
    )
    return Scene(
        particles=particles,
        effects=[hard(shape)],
        domain=Box(low=(0, 0, 0), high=(side, side, side)),
        duration=duration,
        stepper=stepper(**settings),
        seed=seed,
    )


def width(shape):
    """D, the shortest side of the box around a shape."""
    return 2 * shape.half_extents().min()


def springs(x, turns, radius, side, shape):
    """Energy, forces and torques in units of the D of each body, and the deepest overlap (D)."""
    sizes, unit = radius / shape.bounding_radius(), width(shape)
    energy, force, torque, deepest = 0.0, np.zeros_like(x), np.zeros_like(x), 0.0
    for i in range(len(x)):
        for j in range(i):
            d = x[j] - x[i]
            d -= side * np.round(d / side)
            if np.linalg.norm(d) >= radius[i] + radius[j]:
                continue
            gap, normal, here, there = pair(d, turns[i], turns[j], sizes[i], sizes[j], shape)
            mean = 0.5 * (sizes[i] + sizes[j]) * unit
            if gap >= 0:
                continue
            depth = -gap / mean
            energy, deepest = energy + 0.5 * depth**2, max(deepest, depth)
            for k, sign, arm in ((i, -1, here), (j, 1, there)):
                own = sizes[k] * unit
                push = sign * depth * own / mean * normal
                force[k] += push
                torque[k] += np.cross(arm / own, push)
    return energy, force, torque, deepest


def pair(d, turn_i, turn_j, size_i, size_j, shape):
    """Gap, normal from i to j and points of contact of two bodies of different sizes."""
    if shape.superquadric():
        axes, exponents = np.array(shape.superquadric())[:, None]
        i, j = (
            Bodies(Rotation.concatenate([turn]), size * axes, exponents)
            for turn, size in ((turn_i, size_i), (turn_j, size_j))
        )
        return [one[0] for one in superquadric_contacts(d[None], i, j)]
    # The segments of both are scaled to one length along their axes.
    half, thick, z = shape.length / 2, shape.diameter / 2, [0.0, 0.0, 1.0]
    _, normal, here, there = rod_contact(
        d, size_i * turn_i.apply(z), size_j * turn_j.apply(z), (half, 0.0), (half, 0.0)
    )
    gap = normal @ (d + there - here) - thick * (size_i + size_j)
    return gap, normal, here + thick * size_i * normal, there - thick * size_j * normal


class Reference:
    """FIRE 2.0 in the coordinates of all bodies, of mass 1; orientations are rotated by dt omega."""

    def __init__(self, state, side, shape, first=0.05, longest=0.3):
        self.x, self.radius = state["position"].copy(), state["radius"]
        self.turns = Rotation.from_quat(state["orientation"], scalar_first=True)
        self.side, self.shape, self.first, self.longest = side, shape, first, longest
        self.v, self.momentum = np.zeros_like(self.x), np.zeros_like(self.x)
        self.dt, self.alpha, self.downhill, self.steps, self.turned_back = first, 0.25, 0, 0, 0

    def spin(self, momentum):
        """Angular velocities from angular momenta, in the units of each body."""
        inside = self.turns.inv().apply(momentum) / (self.shape.moments() / width(self.shape) ** 2)
        return self.turns.apply(inside)

    def step(self):
        energy, force, torque, deepest = springs(self.x, self.turns, self.radius, self.side, self.shape)
        spin, easy = self.spin(self.momentum), self.spin(torque)
        power = (force * self.v).sum() + (torque * spin).sum()
        self.steps += 1
        path, turn = np.zeros_like(self.x), np.zeros_like(self.x)
        if power > 0:
            self.downhill += 1
            if self.downhill > 20:
                self.dt, self.alpha = min(1.1 * self.dt, self.longest), 0.99 * self.alpha
        elif (self.v**2).sum() > 0:
            self.turned_back += 1
            path, turn = -0.5 * self.dt * self.v, -0.5 * self.dt * spin
            if self.steps > 20:
                self.dt = max(0.5 * self.dt, 0.02 * self.first)
            self.downhill, self.alpha = 0, 0.25
            self.v, self.momentum = 0 * self.v, 0 * self.v
        self.v, self.momentum = self.v + self.dt * force, self.momentum + self.dt * torque
        speed = np.sqrt((self.v**2).sum() + (self.momentum * self.spin(self.momentum)).sum())
        forces = np.sqrt((force**2).sum() + (torque * easy).sum())
        self.v = (1 - self.alpha) * self.v + self.alpha * speed / forces * force
        self.momentum = (1 - self.alpha) * self.momentum + self.alpha * speed / forces * torque
        lengths = (self.radius / self.shape.bounding_radius() * width(self.shape))[:, None]
        self.x = (self.x + lengths * (path + self.dt * self.v)) % self.side
        self.turns = Rotation.from_rotvec(turn + self.dt * self.spin(self.momentum)) * self.turns
        return energy, deepest


def axes_of(turns, shape):
    """The directions of bodies that a rotation about the axis of a rod does not change."""
    return turns.as_matrix()[:, :, slice(0, 3) if shape.superquadric() else slice(2, 3)]


@pytest.mark.parametrize(
    ("shape", "number"),
    [
        pytest.param(ROD, 80, marks=pytest.mark.slow),
        (SPHERE, 30),
        pytest.param(ELLIPSOID, 40, marks=pytest.mark.slow),
        pytest.param(CUBOID, 40, marks=pytest.mark.slow),
    ],
    ids=["rods", "spheres", "ellipsoids", "cuboids"],
)
def test_steps_equal_their_reference_and_the_energy_falls(shape, number):
    made = scene(shape, number, 0.5, spread=0.1)
    side, simulation = made.domain.high[0], compiled(made, worlds=WORLDS, capacity=CAPACITY)
    simulation.load([made])
    reference = Reference({name: np.array(simulation.state[name]) for name in simulation.state}, side, shape)
    energies = []
    while not (reference.turned_back and reference.downhill > 1 and reference.dt != 0.05):
        energies.append(reference.step()[0])
        simulation.run(steps=1)
        off = np.array(simulation.state["position"]) - reference.x
        # Errors of rounding grow in each step.
        np.testing.assert_allclose(off - side * np.round(off / side), 0, atol=1e-9)
        found = Rotation.from_quat(np.array(simulation.state["orientation"]), scalar_first=True)
        axes = [axes_of(turns, shape) for turns in (reference.turns, found)]
        np.testing.assert_allclose(*axes, rtol=0, atol=1e-9)
    assert len(energies) < 100
    assert energies[-1] < 0.2 * energies[0]


def test_forces_and_torques_of_the_reference_are_derivatives_of_its_energy(rng):
    made = scene(ROD, 60, 0.5, spread=0.1)
    start = made.start()
    x, radius, side = start["position"], start["radius"], made.domain.high[0]
    turns = Rotation.from_quat(start["orientation"], scalar_first=True)
    path, turn, step = rng.normal(size=(60, 3)), rng.normal(size=(60, 3)), 1e-6
    lengths = (radius / ROD.bounding_radius() * width(ROD))[:, None]
    ends = [
        springs(x + a * lengths * path, Rotation.from_rotvec(a * turn) * turns, radius, side, ROD)[0]
        for a in (-step, step)
    ]
    _, force, torque, _ = springs(x, turns, radius, side, ROD)
    power = (force * path).sum() + (torque * turn).sum()
    assert (ends[0] - ends[1]) / (2 * step) == pytest.approx(power, rel=1e-6)


@pytest.mark.slow
def test_spheres_jam_at_random_close_packing():
    made = [scene(SPHERE, 100, seed=k, precision=1e-4) for k in range(3)]
    densities = []
    for result in run(made):
        assert result.status.ok
        assert result.work["jammed"] == 1
        assert result.status.reason == "jammed: its bodies could not be brought closer"
        assert result.time < 1e6
        measures, density = result.measures, fraction(result, SPHERE)
        densities.append(density)
        assert measures["packing_fraction"] == pytest.approx(density, rel=1e-12)
        assert 0 < measures["jammed_fraction"] - density <= 1e-4
        depth = deepest(result.state, result.scene.domain.high[0], SPHERE, result.state["radius"][0])
        assert -1e-3 < depth <= 1e-4 * RELATIVE
    # O'Hern et al.: 0.639 +- 0.001 for many spheres, less for few.
    assert 0.61 < np.mean(densities) < 0.65


@pytest.mark.slow
def test_rods_jam_at_a_higher_density_than_spheres():
    made = scene(type(ROD)(length=0.5, diameter=1.0), 100, precision=1e-3, tolerance=1e-3)
    shape = made.effects[0].rods[0]
    result = run(made)
    assert 0.67 < fraction(result, shape) < 0.73
    size = result.state["radius"][0]
    assert deepest(result.state, made.domain.high[0], shape, size) <= 1e-3 * RELATIVE


@pytest.mark.slow
def test_the_bits_do_not_depend_on_batch_portions_or_checkpoint(tmp_path):
    settings = {"fraction_step": 0.1, "precision": 0.03, "tolerance": 1e-3, "patience": 30}
    scenes = [scene(ROD, 100 + k, 0.3, seed=k, **settings) for k in range(3)]
    usual = same_bits(scenes, tmp_path, 170)
    assert all(result.measures["jammed_fraction"] > 0 for result in usual)


@pytest.mark.slow
@pytest.mark.parametrize("shape", [ELLIPSOID, CUBOID], ids=["ellipsoids", "cuboids"])
def test_superquadrics_jam_at_a_higher_density_than_spheres(shape):
    made = scene(shape, 60, precision=1e-2, tolerance=1e-3, patience=200)
    result = run(made)
    assert result.work["jammed"] == 1
    assert 0.66 < fraction(result, shape) < 0.78
    size = result.state["radius"][0]
    assert deepest(result.state, made.domain.high[0], shape, size) <= 1e-3 * RELATIVE


def test_a_run_that_ends_before_it_is_jammed_returns_its_last_accepted_configuration():
    (result,) = simulate([scene(SPHERE, 100, duration=400.0)], worlds=WORLDS, capacity=CAPACITY)
    size, side = result.state["radius"][0], result.scene.domain.high[0]
    assert result.status.ok
    assert result.time == 400.0
    assert result.measures["jammed_fraction"] == 0
    assert result.work["jammed"] == 0
    assert result.status.reason == "reached its end"
    assert result.work["contractions"] > 1
    assert deepest(result.state, side, SPHERE, size) <= 1e-4 * RELATIVE
    assert result.measures["packing_fraction"] == pytest.approx(fraction(result, SPHERE), rel=1e-12)


def test_a_world_ends_at_its_target():
    """Bodies reach 0.4 and 0.45 without being jammed; the start of the third world is denser than its
    target."""
    made = [
        scene(SPHERE, 100, packed, target=target) for packed, target in ((0.2, 0.4), (0.2, 0.45), (0.3, 0.25))
    ]
    results = simulate(made, worlds=WORLDS, capacity=CAPACITY)
    for result, target in zip(results, (0.4, 0.45, 0.3), strict=True):
        density, size = result.measures["packing_fraction"], result.state["radius"][0]
        assert result.status.ok
        assert density == pytest.approx(target, rel=1e-6)
        assert density == pytest.approx(fraction(result, SPHERE), rel=1e-12)
        assert (result.work["jammed"], result.measures["jammed_fraction"]) == (0, 0.0)
        assert deepest(result.state, result.scene.domain.high[0], SPHERE, size) <= 1e-4 * RELATIVE


@pytest.mark.slow
def test_a_start_that_is_jammed_fails():
    result = run(scene(SPHERE, 100, 0.72))
    assert result.status.failed
    assert "overlaps of the start were not removed" in result.status.reason


def test_other_effects_are_refused():
    made = scene(ROD, 100)
    parts = {name: getattr(made, name) for name in ("particles", "domain", "duration", "stepper")}
    with pytest.raises(
        InputError, match=r"effects.gravity must be hard bodies alone, as energy_minimisation"
    ):
        Scene(**parts, effects=[*made.effects, Gravity()])
