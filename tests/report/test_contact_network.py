"""The contacts that a report stores, with their forces beside an independent Hertz."""

import numpy as np
import pytest

from tests.report.conftest import scene
from tisim import Clump, Material, Particles
from tisim.effects import JKR, Granular, RigidClumps
from tisim.effects.contact.overlapping_pairs import OverlappingPairs
from tisim.files import python_file
from tisim.io.reader import Frame
from tisim.report.compressed_trajectory import compress
from tisim.report.contact_network import contact_network, normal_forces
from tisim.report.kept_frames import ListedFrames
from tisim.steppers import FixedStep, Verlet

STEEL = {"young": 2e9, "poisson": 0.3, "restitution": 0.9, "friction": 0.5, "surface_energy": 0.5}
RUBBER = {"young": 1e7, "poisson": 0.48, "restitution": 0.4, "friction": 0.9, "surface_energy": 0.5}
TWO = {"steel": Material(**STEEL), "rubber": Material(**RUBBER)}


def stored(of_scene, *states):
    """The network of frames, given as arrays by name."""
    n = len(states[0]["id"])
    usual = {"mass": np.ones(n), "velocity": np.zeros((n, 3)), "spin": np.zeros((n, 3))}
    frames = [Frame(0.01 * k, k, usual | state, {}) for k, state in enumerate(states)]
    sequence = ListedFrames(of_scene, frames)
    return contact_network(sequence, compress(sequence, range(len(frames))))


def test_forces_are_those_of_hertz_for_unlike_grains(rng):
    n = 60
    radius, material = rng.uniform(1e-3, 3e-3, n), rng.integers(0, 2, n)
    place = rng.uniform(-0.008, 0.008, (n, 3))
    made = scene(n, effects=(Granular(),), materials=TWO)
    network = stored(made, {"id": np.arange(n), "position": place, "radius": radius, "material": material})
    young, poisson = (np.array([STEEL[name], RUBBER[name]])[material] for name in ("young", "poisson"))
    softness = (1 - poisson**2) / young
    for (i, j, *_), force in zip(network.pairs, network.values(), strict=True):
        apart = place[j] - place[i]
        depth = radius[i] + radius[j] - np.linalg.norm(apart - 0.02 * np.rint(apart / 0.02))
        reduced = 1 / (1 / radius[i] + 1 / radius[j])
        expected = 4 / 3 / (softness[i] + softness[j]) * reduced**0.5 * depth**1.5
        assert force**0.5 == pytest.approx(expected**0.5, abs=0.5001 * network.step)
        assert force == pytest.approx(expected, abs=network.rounding())
    assert len(set(map(tuple, material[network.pairs[:, :2]]))) == 4, "all pairs of materials"


def test_attraction_is_negative_and_keeps_its_sign(rng):
    """Of soft adhesive grains, light contacts attract and deep ones repel each other."""
    made = scene(4, effects=(Granular(normal=JKR()),), materials={"rubber": TWO["rubber"]})
    place = np.array([[-0.005, 0, 0], [-0.005 + 2e-3 - 1e-8, 0, 0], [0.004, 0, 0], [0.0055, 0, 0]])
    state = {"id": np.arange(4), "position": place, "radius": np.full(4, 1e-3)}
    network = stored(made, state)
    light, deep = network.values()
    energy, reduced = RUBBER["surface_energy"], 0.5e-3
    assert light == pytest.approx(-8 / 9 * 3 * np.pi * energy * reduced, abs=1.01 * network.rounding())
    assert deep > -light
    assert network.origin < 0


def test_spheres_of_a_body_do_not_touch_each_other():
    dumbbell = Clump(centres=[(-5e-4, 0, 0), (5e-4, 0, 0)], radii=[1e-3], density=1e3)
    given = Particles.of_clumps(dumbbell, [(0.0, 0.0, 0.0), (0.0, 1.9e-3, 0.0)])
    made = scene(4, particles=given, effects=(Granular(), RigidClumps()), materials={"steel": TWO["steel"]})
    network = stored(made, {"id": np.arange(4)} | made.start())
    body = made.start()["clump"][network.pairs[:, :2]]
    assert len(body) > 0
    assert (body[:, 0] != body[:, 1]).all()


def test_a_law_without_a_force_in_numpy_leaves_the_contacts(own_file):
    """Its contacts are drawn, and no force is claimed."""
    text = (
        "from tisim.effects import NormalForce\n"
        "class Unknown(NormalForce):\n"
        "    def mix(self, pair):\n"
        "        return {}\n"
    )
    module = python_file.load(own_file("unknown.py", text))
    law = Granular(normal=module.Unknown())
    made = scene(
        2, effects=(law,), materials={"steel": TWO["steel"]}, stepper=Verlet(control=FixedStep(dt=1e-6))
    )
    place = np.array([[0.0, 0, 0], [1.5e-3, 0, 0]])
    state = {"id": np.arange(2), "position": place, "radius": np.full(2, 1e-3)}
    overlap = np.array([0.5e-3])
    pairs = OverlappingPairs(state, np.array([0]), np.array([1]), overlap, made.acting())
    assert np.isinf(normal_forces(pairs)).all()
    network = stored(made, state)
    assert network.pairs.tolist() == [[0, 1, 0, 0]]
    assert network.usual == 0
