"""Comparisons bit by bit."""

import numpy as np


def same_arrays(found, expected, where=""):
    """Assert that arrays by name equal the expected ones; ``found`` may hold more of them."""
    for name, values in expected.items():
        np.testing.assert_array_equal(found[name], values, err_msg=f"{name} {where}")


def same_result(found, expected):
    """Assert that two results have the same status, time, counters and state."""
    assert (found.status, found.time, found.work) == (expected.status, expected.time, expected.work)
    assert found.state.keys() == expected.state.keys()
    same_arrays(found.state, expected.state)


def same_results(found, expected):
    """Assert that two lists have the same results, in order."""
    for one, other in zip(found, expected, strict=True):
        same_result(one, other)
