"""Counter-based noise: Philox4x32-10 as published, and the distributions of numbers made from its bits."""

import numpy as np
import pytest
from scipy import stats

from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.numerics import philox

ONES = 0xFFFFFFFF


@in_taichi_thread
@ti.kernel
def _philox(counters: ti.types.ndarray(), keys: ti.types.ndarray(), out: ti.types.ndarray()):
    for n in range(counters.shape[0]):
        c = philox.Words([counters[n, 0], counters[n, 1], counters[n, 2], counters[n, 3]])
        words = philox.philox(c, keys[n, 0], keys[n, 1])
        for k in ti.static(range(4)):
            out[n, k] = words[k]


@in_taichi_thread
@ti.kernel
def _bits(where: ti.types.ndarray(), out: ti.types.ndarray()):
    """where : rows of seed, stream, particle, step and draw."""
    for n in range(where.shape[0]):
        words = philox.bits(
            where[n, 0],
            ti.cast(where[n, 1], ti.u32),
            ti.cast(where[n, 2], ti.u32),
            where[n, 3],
            ti.cast(where[n, 4], ti.u32),
        )
        for k in ti.static(range(4)):
            out[n, k] = words[k]


@in_taichi_thread
@ti.kernel
def _numbers(words: ti.types.ndarray(), uniform: ti.types.ndarray(), normal: ti.types.ndarray()):
    for n in range(words.shape[0]):
        w = philox.Words([words[n, 0], words[n, 1], words[n, 2], words[n, 3]])
        u, z = philox.uniform(w), philox.normal(w)
        for k in ti.static(range(2)):
            uniform[n, k] = u[k]
            normal[n, k] = z[k]


@in_taichi_thread
@ti.kernel
def _normals(words: ti.types.ndarray(), normal: ti.types.ndarray()):
    for n in range(words.shape[0]):
        z = philox.normals(philox.Words([words[n, 0], words[n, 1], words[n, 2], words[n, 3]]))
        for k in ti.static(range(4)):
            normal[n, k] = z[k]


def words_of(counters, keys):
    counters = np.ascontiguousarray(counters, np.uint32)
    out = np.zeros((len(counters), 4), np.uint32)
    _philox(counters, np.ascontiguousarray(keys, np.uint32), out)
    return out


def numbers(words):
    words = np.ascontiguousarray(words, np.uint32)
    uniform, normal = np.zeros((len(words), 2)), np.zeros((len(words), 2))
    _numbers(words, uniform, normal)
    return uniform, normal


def reference(counter, key):
    """Reference implementation of Philox4x32-10 with Python integers (Salmon et al. 2011, section 3.3)."""
    c, (a, b) = [int(x) for x in counter], (int(x) for x in key)
    for _ in range(10):
        left, right = c[0] * 0xD2511F53, c[2] * 0xCD9E8D57
        c = [(right >> 32) ^ c[1] ^ a, right & ONES, (left >> 32) ^ c[3] ^ b, left & ONES]
        a, b = (a + 0x9E3779B9) & ONES, (b + 0xBB67AE85) & ONES
    return c


@pytest.mark.parametrize(
    ("counter", "key", "expected"),
    [
        ((0, 0, 0, 0), (0, 0), "6627e8d5 e169c58d bc57ac4c 9b00dbd8"),
        ((ONES,) * 4, (ONES,) * 2, "408f276d 41c83b0e a20bc7c6 6d5451fd"),
        (
            (0x243F6A88, 0x85A308D3, 0x13198A2E, 0x03707344),
            (0xA4093822, 0x299F31D0),
            "d16cfe09 94fdcceb 5001e420 24126ea1",
        ),
    ],
)
def test_known_answers_of_random123(counter, key, expected):
    """The known-answer vectors distributed with Random123 (kat_vectors, philox4x32 10)."""
    words = [int(text, 16) for text in expected.split()]
    assert words_of([counter], [key])[0].tolist() == words
    assert reference(counter, key) == words


def test_philox_is_its_reference_in_python_integers(rng):
    counters = rng.integers(0, 2**32, (500, 4), dtype=np.uint32)
    keys = rng.integers(0, 2**32, (500, 2), dtype=np.uint32)
    assert words_of(counters, keys).tolist() == [reference(c, k) for c, k in zip(counters, keys, strict=True)]


def test_the_counter_contains_every_coordinate_of_a_draw(rng):
    """The seed is the 64-bit key; step (64 bits), draw, particle and stream fill the counter."""
    where = np.zeros((400, 5), np.uint64)
    where[:, 0] = rng.integers(0, 2**63, 400)
    where[:, 1:3] = rng.integers(0, 2**32, (400, 2))
    where[:, 3] = rng.integers(0, 2**47, 400)
    where[:, 4] = rng.integers(0, 100, 400)
    out = np.zeros((400, 4), np.uint32)
    _bits(where, out)
    for (seed, stream, particle, step, draw), words in zip(where.tolist(), out.tolist(), strict=True):
        counter = (step & ONES, (step >> 32) ^ (draw << 16), particle, stream)
        assert words == reference(counter, (seed & ONES, seed >> 32))


def test_neighbouring_draws_are_independent():
    """Seeds, streams, particles, steps and draws that differ by one never give the same word."""
    where = np.array(np.meshgrid(*[range(5)] * 5, indexing="ij"), np.uint64).reshape(5, -1).T
    out = np.zeros((len(where), 4), np.uint32)
    _bits(np.ascontiguousarray(where), out)
    assert len(np.unique(out, axis=0)) == len(where)
    # On average half of all bits differ between neighbouring draws.
    flipped = np.unpackbits((out[1:] ^ out[:-1]).view(np.uint8)).mean()
    assert flipped == pytest.approx(0.5, abs=4 * 0.5 / np.sqrt(32 * 4 * len(out)))


@pytest.fixture(scope="module")
def sample():
    """Rows of words for 200 particles at 1000 steps, as an operator would draw them."""
    steps, particles = np.meshgrid(np.arange(1000), np.arange(200))
    where = np.zeros((steps.size, 5), np.uint64)
    where[:, 0], where[:, 1] = 7, 3
    where[:, 2], where[:, 3] = particles.ravel(), steps.ravel()
    words = np.zeros((len(where), 4), np.uint32)
    _bits(where, words)
    return numbers(words)


def test_uniform_numbers_are_uniform(sample):
    uniform, _ = sample
    for column in uniform.T:
        assert stats.kstest(column, "uniform").pvalue > 0.01
    assert stats.kstest(uniform[:, 0] * uniform[:, 1], lambda p: p - p * np.log(p)).pvalue > 0.01


def test_normal_numbers_are_normal_and_independent(sample):
    _, normal = sample
    n = len(normal)
    for column in normal.T:
        assert stats.kstest(column, "norm").pvalue > 0.01
        # Four standard errors of the second and the fourth moment.
        assert column.var() == pytest.approx(1.0, abs=4 * np.sqrt(2 / n))
        assert (column**4).mean() == pytest.approx(3.0, abs=4 * np.sqrt(96 / n))
    series = normal[:, 0].reshape(200, 1000)
    pairs = {
        "two of one draw": (normal[:, 0], normal[:, 1]),
        "step and next": (series[:, 1:], series[:, :-1]),
        "particle and next": (series[1:], series[:-1]),
    }
    for name, (a, b) in pairs.items():
        assert abs((a * b).mean()) < 4 / np.sqrt(a.size), name


def test_extreme_words_stay_inside_the_open_interval():
    """The number is never 0, whose logarithm is infinite, nor 1, which would be on the upper face of a
    box."""
    uniform, normal = numbers([[0, 0, 0, 0], [ONES] * 4, [0, 0, ONES, ONES]])
    assert (uniform > 0).all()
    assert (uniform < 1).all()
    assert np.isfinite(normal).all()
    assert normal.max() == pytest.approx(np.sqrt(-2 * np.log(2.0**-54)), rel=1e-12)


def test_four_normal_numbers_follow_box_and_muller():
    """One word gives a length, sqrt(-2 ln u); another gives an angle in the first quadrant and two signs."""
    draw = np.random.default_rng(2)
    ends = [[0] * 4, [ONES] * 4, [2, 3, 2**31, 2**30]]
    words = np.vstack([draw.integers(0, 2**32, (100_000, 4)), ends]).astype(np.uint32)
    normals = np.zeros((len(words), 4))
    _normals(words, normals)
    for k in (0, 2):
        length = np.sqrt(-2 * np.log((words[:, k] + 0.5) / 2**32))
        angle = np.pi / 2 * ((words[:, k + 1] >> 2) + 0.5) / 2**30
        first, second = 1.0 - (words[:, k + 1] & 2), 1.0 - 2.0 * (words[:, k + 1] & 1)
        np.testing.assert_allclose(normals[:, k], length * first * np.cos(angle), rtol=0, atol=5e-11)
        np.testing.assert_allclose(normals[:, k + 1], length * second * np.sin(angle), rtol=0, atol=5e-11)
    columns = normals[:-3]
    for column in columns.T:
        assert stats.kstest(column, "norm").pvalue > 0.01
    correlation = np.corrcoef(np.hstack([columns, columns**2]).T)
    assert np.abs(correlation - np.diag(np.diag(correlation))).max() < 5 / np.sqrt(len(columns))
