"""Columns are read back to their stated rounding."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra import numpy as arrays

from tisim.report.columns import WHOLE_TYPES, Scale, column, rounded, uniform_scale, whole_numbers

SHAPES = st.tuples(st.integers(1, 6), st.integers(0, 7), st.integers(1, 4))


@settings(max_examples=100, derandomize=True, database=None, deadline=None)
@given(data=st.data(), bits=st.sampled_from(list(WHOLE_TYPES)), shape=SHAPES)
def test_whole_numbers_are_read_back_exactly(data, bits, shape):
    whole = data.draw(arrays.arrays(WHOLE_TYPES[bits], shape))
    scale = Scale(bits, (0.0,) * shape[2], (1.0,) * shape[2])
    one = column("any", "", scale, whole)
    again = np.broadcast_to(whole_numbers(one, shape[1]), shape)
    np.testing.assert_array_equal(again, whole)


@pytest.mark.parametrize("bits", [8, 16])
def test_values_are_within_the_stated_rounding(rng, bits):
    values = rng.uniform(-3.0, 7.0, (5, 40, 2))
    scale = uniform_scale([(values[..., k].min(), values[..., k].max()) for k in range(2)], bits)
    error = np.abs(scale.values(rounded(values, scale)) - values).max()
    assert 0.9 * scale.rounding() < error <= scale.rounding() * (1 + 1e-9)


def test_on_a_logarithmic_scale_the_rounding_is_relative(rng):
    values = np.exp(rng.uniform(-20.0, 3.0, (1, 5000, 1)))
    ends = uniform_scale([(np.log(values.min()), np.log(values.max()))], 16)
    scale = Scale(16, ends.origin, ends.step, logarithmic=True)
    error = np.abs(scale.values(rounded(values, scale)) / values - 1).max()
    assert 0.9 * scale.rounding() < error <= scale.rounding() * (1 + 1e-9)


def test_values_that_are_not_finite_are_missing():
    values = np.array([0.0, 1.0, np.nan, np.inf])[None, :, None]
    scale = uniform_scale([(0.0, 1.0)], 8, missing=True)
    shown = scale.values(rounded(values, scale))[0, :, 0]
    np.testing.assert_array_equal(shown, [0.0, 1.0, np.nan, np.nan])


def test_a_constant_takes_one_frame():
    whole = np.tile(np.arange(5, dtype=np.uint8)[:, None], (7, 1, 1))
    one = column("kept", "", Scale(8, (0.0,), (1.0,)), whole)
    assert (one.frames, one.order) == (1, 0)


@pytest.mark.parametrize(("power", "order"), [(0, 0), (1, 1), (2, 2)])
def test_the_order_suits_the_motion(rng, power, order):
    """Noise, steps at random, and free flight."""
    noise = rng.integers(-100, 100, (60, 500, 3))
    for _ in range(power):
        noise = np.cumsum(noise, axis=0)
    one = column("position", "m", Scale(16, (0.0,) * 3, (1.0,) * 3), noise.astype(np.uint16))
    assert one.order == order
