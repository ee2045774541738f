"""Starts given as arrays equal starts given as lists, take less time, and keep the existing digests."""

import json
import pickle
import tracemalloc

import numpy as np
import pytest

from tisim import InputError, Particles, Scene
from tisim.components.serialization import ROWS_PER_PIECE, json_pieces


def text(value):
    return "".join(json_pieces(value))


@pytest.mark.parametrize("columns", [(), (3,)])
def test_text_of_arrays_equals_text_of_their_lists(rng, columns):
    """Numbers of all sizes, random bit patterns, and numbers near the change of notation."""
    size = (ROWS_PER_PIECE + 5, *columns)
    bits = rng.integers(0, 2**64, size, dtype=np.uint64).view(np.float64)
    edges = [
        0.0,
        -0.0,
        5e-324,
        2.3e-308,
        1e-5,
        9.9e-5,
        1e-4,
        1.0,
        1e15,
        9.999999999999998e15,
        1e16,
        1e22,
        1e23,
    ]
    for array in (
        np.where(np.isfinite(bits), bits, 1.0), rng.uniform(-1, 1, size), 10 ** rng.uniform(-7, 19, size),
        np.resize([*edges, *np.negative(edges)], size), np.float32(rng.uniform(-1, 1, size)),
        rng.integers(-5, 5, size), rng.integers(0, 2, size) == 1, np.ones(size)[:0], np.ones(size)[:1],
        np.full(size, 1e-6),
    ):  # fmt: skip
        assert text(array) == json.dumps(array.tolist())


def test_text_of_data_with_arrays():
    data = {"b": {"z": [1, {"y": 2, "x": None}], "a": np.eye(3)}, "a": "\0\"'µ", "c": (1.5, 2), "": {}}
    lists = {**data, "b": {**data["b"], "a": np.eye(3).tolist()}}
    assert text(data) == json.dumps(lists, sort_keys=True)


def kinds():
    """Lists, tuples, whole numbers and arrays of several types."""
    return Particles(
        position=[[0, 1, 2], [3.5, 4, -0.0]], velocity=np.arange(6).reshape(2, 3), radius=[1, 1.0],
        density=2000,
        quantities={
            "temperature": np.float32([300.1, 200.7]), "fixed": np.array([0, 0]), "charge": [1, 2.0],
            "spin": ((0, 0, 1), (1e-5, 2e16, 3)), "moment": 3,
        },
    )  # fmt: skip


def one():
    return Particles(
        position=np.zeros((3, 3)), velocity=np.zeros((3, 3)), radius=5e-5,
        mass=np.array([1e-9, 2e-9, 3e-9]), quantities={"temperature": 300.0},
    )  # fmt: skip


def magnitudes():
    draw = np.random.Generator(np.random.Philox(7))
    x = 10.0 ** draw.uniform(-7, 18, (50, 3)) * draw.choice([-1.0, 1.0], (50, 3))
    radius = 10.0 ** draw.uniform(-6, 1, 50)
    return Particles(position=x, velocity=x[::-1] * 1e-3, radius=radius, mass=1e-3)


DIGESTS = {
    kinds: "54afc170ed95a6a7a171ecc2014e3c80ece2197954abf8b573d569298a0687b5",
    one: "4b907cc869046cdaeba1d9ec15d1ac9212be36a0bd935e74b20bc68eac21f701",
    magnitudes: "06a89ba40c956a8fd261f81054f1c79868b453e134a9d100b8e0f2c423e71f5b",
}
"""Recorded when starts consisted of tuples; search caches use these digests as keys."""


@pytest.mark.parametrize("make", DIGESTS, ids=lambda make: make.__name__)
def test_digests_are_unchanged(monkeypatch, make):
    """The digests were taken with physics version 2."""
    monkeypatch.setattr("tisim.scene.scene.PHYSICS_VERSION", 2)
    scene = Scene(name=make.__name__, particles=make(), duration=1.0, seed=3)
    assert scene.digest() == DIGESTS[make]
    again = Scene.from_dict(json.loads(json.dumps(scene.to_dict())))
    assert again.digest() == DIGESTS[make]
    assert scene.to_dict() == again.to_dict()


def test_a_start_of_arrays_equals_one_of_lists():
    start = one()
    data = {key: value for key, value in Scene(particles=start, duration=1.0).to_dict()["particles"].items()}
    assert data.pop("kind") == "particles"
    assert data["mass"] == [1e-9, 2e-9, 3e-9]
    assert Particles(**data) == start
    assert Scene(particles=Particles(**data), duration=1.0) == Scene(particles=start, duration=1.0)
    moved = np.zeros((3, 3))
    moved[2, 2] = 1e-300
    for other in (
        {"position": moved}, {"mass": np.array([1e-9, 2e-9])[:1]}, {"quantities": {"temperature": 301.0}},
        {"quantities": {}}, {"quantities": {"temperature": np.full(3, 300.0)}},
    ):  # fmt: skip
        assert Particles(**{**data, **other}) != start
    arrays = {**data, "quantities": {"temperature": np.full(3, 300.0)}}
    lists = {**data, "quantities": {"temperature": [300.0] * 3}}
    assert Particles(**arrays) == Particles(**lists) == Particles(**arrays)
    assert start != "particles"
    with pytest.raises(TypeError, match="unhashable"):
        hash(start)


def test_arrays_are_copies_that_cannot_be_written_to():
    heat = np.full(3, 300.0)
    start = Particles(**{**one().model_dump(), "quantities": {"temperature": heat}})
    heat[0] = 0.0
    for particles in (start, pickle.loads(pickle.dumps(start))):
        assert particles.quantities["temperature"].tolist() == [300.0] * 3
        for values in (
            particles.position,
            particles.velocity,
            particles.mass,
            *particles.quantities.values(),
        ):
            with pytest.raises(ValueError, match="read-only"):
                values[0] = 1.0
    assert pickle.loads(pickle.dumps(start)) == start


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"position": np.zeros((3, 2))}, "particles.position.0.2 must be given; received nothing"),
        ({"position": np.zeros((0, 3))}, "particles.velocity must be one value or 0 of them"),
        (
            {"position": np.full((3, 3), np.nan)},
            "particles.position.0.0 must be a finite number",
        ),
        (
            {"velocity": np.zeros((2, 3))},
            r"particles.velocity must be one value or 3 of them",
        ),
        ({"radius": np.array(["a"])}, "particles.radius.0 must be a number; received 'a'"),
        ({"radius": np.ones((3, 1))}, "particles.radius.0 must be a number"),
        ({"radius": -np.ones(3)}, "particles.radius must be greater than 0; received -1.0"),
        ({"quantities": {"charge": np.array([1.0, np.inf, 0.0])}}, "particles.charge must be finite"),
    ],
)
def test_arrays_and_lists_give_the_same_error_messages(changes, message):
    data = one().model_dump()
    for arrays in (changes, {name: v if isinstance(v, dict) else v.tolist() for name, v in changes.items()}):
        with pytest.raises(InputError, match=message):
            Particles(**{**data, **arrays})


def test_scenes_and_digests_need_no_lists_of_all_numbers(rng):
    """Lists of the numbers alone would take 45 MB."""
    where = rng.uniform(-1, 1, (200_000, 3))
    tracemalloc.start()
    particles = Particles(position=where, velocity=where, radius=1e-3, mass=1.0)
    _, making = tracemalloc.get_traced_memory()
    scene, (before, _) = Scene(particles=particles, duration=1.0), tracemalloc.get_traced_memory()
    tracemalloc.reset_peak()
    scene.digest()
    _, digesting = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    assert making < 6 * where.nbytes
    assert digesting - before < 15e6


def test_lists_of_arrays_are_plain_data():
    """A list of NumPy vectors: such a scene can be changed, written and compared."""
    moment = np.array([0.0, 1.0, 2.0])
    quantities = {"moment": [moment, 2 * moment], "charge": [np.float64(1), np.int8(2)]}
    listed = {"moment": [[0.0, 1.0, 2.0], [0.0, 2.0, 4.0]], "charge": [1.0, 2]}
    made, plain = (
        Scene(
            particles=Particles(
                position=np.eye(3)[:2], velocity=np.eye(3)[:2], radius=1, density=1, quantities=q
            ),
            duration=1.0,
        )
        for q in (quantities, listed)
    )  # fmt: skip
    assert made.replace({"duration": 2.0}).particles == made.particles
    assert made.to_toml() == plain.to_toml()
    assert made.digest() == plain.digest()
