"""The virial against the same laws in NumPy: over all pairs and listed ones, and for contacts in shear."""

import numpy as np
import pytest
from scipy.constants import mu_0

from tests.effects.contact.loads import WORLDS, close, loads, pairs
from tests.effects.contact.sheared import DT, STEPS, ShearedGrains, crowd
from tests.effects.pair import test_mie
from tests.scenes import by_id, compiled, scene
from tisim import InputError
from tisim.effects import (
    DipoleDipole,
    Effect,
    EwaldDipoleDipole,
    Gravity,
    Impact,
    Mie,
    TreeGravity,
    Virial,
)


class Held(Effect):
    """Declares that some particles may be fixed."""

    fields = ("fixed",)


MIE = Mie(epsilon=0.5, n=12, m=6, cutoff=2.5)


def dipoles(state):
    """Force on each particle by each other one, N, (n, n, 3)."""
    n, d = pairs(state)
    a, b = state["moment"][:, None], state["moment"][None]
    along_a, along_b, both = ((x * y).sum(axis=2, keepdims=True) for x, y in ((a, n), (b, n), (a, b)))
    force = along_a * b + along_b * a + both * n - 5 * along_a * along_b * n
    return -3 * mu_0 / (4 * np.pi) * force / d[..., None] ** 4


def mie(state):
    """Force on each particle by each other one, N, (n, n, 3), by finite differences."""
    n, d = pairs(state)
    sigma, h = state["radius"][:, None] + state["radius"], 1e-4 * d
    at = [test_mie.potential(MIE, d + k * h, sigma) for k in (-2, -1, 1, 2)]
    near = (d < 2.5 * sigma) & ~np.eye(len(d), dtype=bool)
    return np.where(near, (at[0] - 8 * at[1] + 8 * at[2] - at[3]) / (12 * h), 0)[..., None] * n


def magnets(rng, n=40):
    """Magnets with cores, some of them fixed; moments are large enough for both laws to matter."""
    place = 0.25 * (np.argwhere(np.ones((4,) * 3))[rng.permutation(64)[:n]] + rng.uniform(-0.1, 0.1, (n, 3)))
    quantities = {"moment": 100 * rng.normal(size=(n, 3)), "fixed": np.arange(n) % 4 == 0}
    effects = (Held(), DipoleDipole(), MIE, Gravity(acceleration=(1, 2, 3)), Virial())
    return scene(
        place, np.zeros((n, 3)), effects, radius=rng.uniform(0.09, 0.1, n), mass=1.0, quantities=quantities
    )


@pytest.mark.long
def test_each_particle_has_half_of_the_virial_of_its_pairs(rng):
    scenes = [magnets(rng) for _ in range(2)]
    for state in loads(scenes, capacity=64):
        gap = state["position"][:, None] - state["position"][None]
        magnetic, cores = (np.einsum("ija,ijb->iab", gap, law(state)) / 2 for law in (dipoles, mie))
        assert 0.01 < np.abs(magnetic).max() / np.abs(cores).max() < 100
        close(state["virial"].reshape(-1, 3, 3), magnetic + cores, 1e-8)
        assert not state["force"][state["fixed"] > 0].any()


@pytest.mark.long
def test_measures_are_sums_over_particles(rng):
    (result,) = run(magnets(rng))
    expected = result.state["virial"].sum(axis=0)
    close([result.measures[f"virial_{a}{b}"] for a in "xyz" for b in "xyz"], expected)


def run(*scenes):
    simulation = compiled(scenes[0], WORLDS, 64)
    simulation.load(scenes)
    simulation.run()
    return simulation.results()


@pytest.mark.slow
def test_contacts_in_shear_have_the_virial_of_their_reference(rng):
    """Forces with history, between images that slide past each other."""
    made = crowd(rng)
    made = made.model_copy(update={"effects": (*made.effects, Virial())})
    (result,) = run(made)
    reference = ShearedGrains(made)
    reference.run(STEPS, DT)
    close(by_id(result)["virial"].sum(axis=0).reshape(3, 3), reference.virial, 1e-11)


@pytest.mark.parametrize(
    ("effects", "text"),
    [
        ((), "together with .*effects.dipole_dipole"),
        ((Impact(hardness=1.0), MIE), "impact"),
        ((EwaldDipoleDipole(cutoff=1.0, waves=(3, 3, 3)),), "without ewald_dipole_dipole"),
        ((TreeGravity(softening_length=0.1), MIE), "without tree_gravity"),
    ],
)
def test_the_virial_requires_pair_forces_alone(effects, text):
    with pytest.raises(InputError, match=text):
        scene([[0, 0, 0]], [[0, 0, 0]], (*effects, Virial()))
