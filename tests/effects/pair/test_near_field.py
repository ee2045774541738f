"""The near field against its NumPy reference: every strength, integer and other exponents, near
pairs only."""

from itertools import product

import numpy as np
import pytest

from tests.effects.contact.loads import WORLDS, balanced, close, fields_beside_the_core, loads, pairs
from tests.scenes import scene
from tisim import Box, InputError
from tisim.effects import NearField, TruncatedNearField

COULOMB = 8.9875517873681764e9
"""1/(4 pi epsilon_0), N m^2/C^2."""


def cloud(rng, effect, n=12, **more):
    quantities = {"charge": rng.normal(size=n)}
    if effect.signed:
        quantities["polarity"] = rng.choice([-1, 1], n)
    return scene(
        rng.uniform(0, 1, (n, 3)),
        rng.normal(size=(n, 3)),
        (effect,),
        radius=rng.uniform(0.01, 0.1, n),
        mass=rng.uniform(1, 2, n),
        quantities=quantities,
        **more,
    )


def reference(law, state):
    """Z16 (7.23) and the text after it."""
    radius = state["radius"]
    own = {
        "plain": np.ones_like(radius),
        "mass": state["mass"],
        "area": 4 * np.pi * radius**2,
        "volume": 4 / 3 * np.pi * radius**3,
        "charge": state.get("charge"),
    }[law.strength]
    if law.signed:
        own = own * state["polarity"]
    n, d = pairs(state)
    size = own[:, None] * own * (law.alpha1 * d**-law.beta1 - law.alpha2 * d**-law.beta2)
    if isinstance(law, TruncatedNearField):
        size = np.where(d <= law.cutoff, size, 0)
    return (size[..., None] * n).sum(axis=1)


def check(scenes):
    for one, state in zip(scenes, loads(scenes), strict=True):
        expected = reference(one.effects[0], state)
        assert np.abs(expected).max() > 0
        close(state["force"], expected)
        balanced(state)


def coefficients(rng):
    return {"alpha1": rng.uniform(), "alpha2": rng.uniform()}


STRENGTHS = [pytest.param("mass", True, marks=pytest.mark.long), ("charge", True)]
STRENGTHS += [
    pytest.param(*kind, marks=pytest.mark.slow)
    for kind in (("plain", False), ("area", False), ("volume", True))
]


@pytest.mark.parametrize(("strength", "signed"), STRENGTHS)
def test_every_strength(strength, signed, rng):
    """With unlike sizes, charges and signs; all pairs; action and reaction."""
    check([
        cloud(rng, NearField(**coefficients(rng), strength=strength, signed=signed))
        for _ in range(WORLDS)
    ])  # fmt: skip


@pytest.mark.long
@pytest.mark.parametrize(
    "exponents",
    [
        (0, 6),
        pytest.param((2.0, 13), marks=pytest.mark.slow),
        pytest.param((1.5, 2.25), marks=pytest.mark.slow),
    ],
)
def test_exponents(exponents, rng):
    check([
        cloud(rng, NearField(**coefficients(rng), beta1=exponents[0], beta2=exponents[1]))
        for _ in range(WORLDS)
    ])  # fmt: skip


@pytest.mark.slow
def test_near_pairs_only(rng):
    """Also over the pair list, which worlds with many particles use."""
    scenes = [
        cloud(rng, TruncatedNearField(**coefficients(rng), cutoff=rng.uniform(0.4, 0.8)))
        for _ in range(WORLDS)
    ]
    check(scenes)
    many = cloud(rng, TruncatedNearField(alpha1=1.0, alpha2=0.5, cutoff=0.15, beta2=3), n=400)
    (state,) = loads([many], capacity=400)
    expected = reference(many.effects[0], state)
    assert np.abs(expected - reference(NearField(alpha1=1.0, alpha2=0.5, beta2=3), state)).max() > 1
    close(state["force"], expected)


@pytest.mark.long
def test_alpha1_attracts_and_alpha2_repels():
    """Two particles side by side; between unlike signs each force is reversed."""

    def on_the_left(**options):
        setup = scene([[0, 0, 0], [0.5, 0, 0]], np.zeros((2, 3)), (NearField(**options),), quantities=signs)
        return loads([setup])[0]["force"][0]

    signs = {}
    np.testing.assert_allclose(on_the_left(alpha1=3.0), [6, 0, 0])
    np.testing.assert_allclose(on_the_left(alpha2=3.0), [-12, 0, 0])
    signs = {"polarity": [1, -1]}
    np.testing.assert_allclose(on_the_left(alpha1=3.0, signed=True), [-6, 0, 0])
    np.testing.assert_allclose(on_the_left(alpha2=3.0, signed=True), [12, 0, 0])


@pytest.mark.long
def test_between_charges_it_is_coulombs_law():
    law = NearField(alpha2=COULOMB, strength="charge")
    scenes = [
        scene([[0, 0, 0], [0, 0.3, 0.4]], np.zeros((2, 3)), (law,), quantities={"charge": charge})
        for charge in ([1e-6, 2e-6], [-1e-6, 2e-6])
    ]
    like, unlike = loads(scenes)
    np.testing.assert_allclose(np.linalg.norm(like["force"], axis=1), COULOMB * 2e-12 / 0.25)
    assert like["force"][0, 1] < 0 < unlike["force"][0, 1]


def test_equilibrium_at_alpha2_over_alpha1():
    """beta = (1, 2): no force at d = alpha2 / alpha1, and the stiffness of Z13 (33) there."""
    law, h = NearField(alpha1=2.0, alpha2=1.0), 1e-6
    scenes = [scene([[0, 0, 0], [0.5 + x, 0, 0]], np.zeros((2, 3)), (law,)) for x in (0.0, h, -h)]
    at, out, back = (state["force"][1, 0] for state in loads(scenes))
    assert at == pytest.approx(0, abs=1e-14)
    assert (back - out) / (2 * h) == pytest.approx(2.0 * (2.0 / 1.0) ** 2, rel=1e-6)


@pytest.mark.long
def test_the_nearest_image_acts_in_a_periodic_box():
    law = NearField(alpha1=1.0)
    box = Box(low=(0, 0, 0), high=(1, 1, 1))
    setup = scene([[0.1, 0.5, 0.5], [0.9, 0.5, 0.5]], np.zeros((2, 3)), (law,), radius=0.01, domain=box)
    np.testing.assert_allclose(loads([setup])[0]["force"], [[-5, 0, 0], [5, 0, 0]], rtol=1e-12)


def test_only_needed_fields_are_allocated():
    for strength, signed in product(["plain", "mass", "charge"], [False, True]):
        law = NearField(strength=strength, signed=signed)
        setup = scene([[0, 0, 0]], [[0, 0, 0]], (law,))
        more = ({"charge"} if strength == "charge" else set()) | ({"polarity"} if signed else set())
        assert fields_beside_the_core(setup) == {"force"} | more


WRONG = {
    "near_field.beta1 must be at least 0; received -1": {"beta1": -1},
    "near_field.alpha2 must be at least 0.0; received -2": {"alpha2": -2},
    "near_field.strength must be 'plain', 'mass', 'area', 'volume' or 'charge'; received 'size'": {
        "strength": "size"
    },
}


@pytest.mark.parametrize("message", WRONG)
def test_invalid_values_are_refused(message):
    with pytest.raises(InputError) as fault:
        NearField(**WRONG[message])
    assert str(fault.value) == message
