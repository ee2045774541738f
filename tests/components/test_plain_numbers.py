"""Numbers given by users, including NumPy's, are stored unchanged or refused."""

import numpy as np
import pytest

import tisim
from tisim.effects import Gravity
from tisim.optimize import Gene
from tisim.steppers import Collocation, FixedStep

MASKED = np.ma.array([1.0, 2.0, 3.0], mask=[0, 1, 0])


def particles(**given):
    """Return a single particle, with the given values replaced."""
    whole = {"position": [(0, 0, 0)], "velocity": [(0, 0, 0)], "radius": 1e-3, "density": 1.0}
    return tisim.Particles(**(whole | given))


def scene(seed):
    return tisim.Scene(particles=particles(), duration=1.0, seed=seed)


SETTINGS = {
    "fixed_step.dt": lambda value: FixedStep(dt=value),
    "collocation.stages": lambda value: Collocation(stages=value),
    "scene.seed": scene,
    "gravity.acceleration.2": lambda value: Gravity(acceleration=(0, 0, value)),
    "particles.radius": lambda value: particles(radius=value),
    "particles.position": lambda value: particles(position=[(0, 0, value)]),
    "particles.charge": lambda value: particles(quantities={"charge": value}).arrays(
        tisim.Box(low=(-1, -1, -1), high=(1, 1, 1)), 0
    ),
    "material.young": lambda value: tisim.Material(young=value),
    "low of gene x": lambda value: Gene("x", "", value, 2.0),
    "box.low.2": lambda value: tisim.Box(low=(-1, -1, value), high=(9, 9, 9)),
}
NO_NUMBERS = [True, np.True_, 1 + 2j, np.complex128(1), np.ma.masked, np.array(True), np.array(1j)]


@pytest.mark.parametrize("where", SETTINGS)
@pytest.mark.parametrize("value", NO_NUMBERS, ids=repr)
def test_anything_but_a_number_is_refused(where, value):
    with pytest.raises(tisim.InputError, match=rf"^{where} must be (a number|numbers|without masked)"):
        SETTINGS[where](value)


@pytest.mark.parametrize("values", [MASKED, np.array([0, 0, 1j]), np.array([False, True, True])], ids=repr)
@pytest.mark.parametrize(
    ("where", "make"),
    [
        ("gravity.acceleration", lambda values: Gravity(acceleration=values)),
        ("particles.position", lambda values: particles(position=values[None])),
        ("particles.radius", lambda values: particles(position=np.eye(3), velocity=np.eye(3), radius=values)),
        ("clump.radii", lambda values: tisim.Clump(centres=3 * np.eye(3), radii=values, density=1.0)),
    ],
)  # fmt: skip
def test_non_numeric_arrays_are_refused(where, make, values):
    with pytest.raises(tisim.InputError, match=rf"^{where} must be (numbers|without masked entries)"):
        make(values)


def test_an_array_without_masked_entries_is_unchanged():
    whole = np.ma.array([1.0, 2.0, 3.0], mask=False)
    assert Gravity(acceleration=whole).acceleration == (1.0, 2.0, 3.0)
    assert particles(position=whole[None]).position.tolist() == [[1.0, 2.0, 3.0]]


@pytest.mark.parametrize("kind", [int, np.int64, np.uint64, lambda value: np.array(value)])
def test_large_seeds_are_kept(kind):
    assert scene(kind(2**62 + 1)).seed == 2**62 + 1
    assert scene(0).replace({"seed": kind(2**62 + 3)}).seed == 2**62 + 3


@pytest.mark.parametrize("kind", [np.int8, np.uint8, np.float16, np.float32, np.float64, int])
def test_numbers_of_numpy_are_numbers(kind):
    assert FixedStep(dt=kind(2)).dt == 2.0
    assert Collocation(stages=kind(3)).stages == 3
    assert particles(radius=kind(3)).radius.tolist() == [3.0]
    assert Gravity(acceleration=(0, kind(1), 0)).acceleration == (0.0, 1.0, 0.0)


def test_a_gene_of_eight_bits_has_its_whole_range():
    gene = Gene("x", "", np.int8(-100), np.int8(100))
    assert gene.decode(0.7) == pytest.approx(40.0)


def test_booleans_are_accepted_as_flags():
    fixed = particles(quantities={"fixed": np.array([True])})
    assert fixed.arrays(tisim.Box(low=(-1, -1, -1), high=(1, 1, 1)), 0)["fixed"].tolist() == [1.0]
