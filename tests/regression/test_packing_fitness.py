"""The fitness functions of packing do not change unintentionally.

Packings are chaotic: the rounding of another compiler leads to other packings, of the same mean density.
Means over starts are stored.
"""

import numpy as np
import pytest

import tisim
from tests.regression.test_fitness import STANDARD_ERRORS
from tisim.cases.packing.problem import problem

STARTS = 16
DENSE = {
    (1.0, 1.0, 0.5): (0.62193, 0.00375),
    (1.4, 1.0, 0.5): (0.68932, 0.00244),
    (3.0, 1.0, 0.5): (0.64021, 0.00238),
    (1.0, 2.0, 0.7): (0.65996, 0.00139),
}
"""Aspect ratio, size ratio, share of the larger bodies -> mean packing fraction, and its standard error."""


def means(change=0.0):
    """Mean and standard error of the packing fraction of each design, shape (designs, 2), with each aspect
    ratio increased by ``change``."""
    dense = problem("small")
    (objective,) = dense.objectives
    scenes = [
        dense.scene({"aspect": aspect + change, "size_ratio": ratio, "large_share": share}, seed)
        for aspect, ratio, share in DENSE
        for seed in range(STARTS)
    ]
    values = np.reshape([objective.of(result) for result in tisim.run(scenes)], (len(DENSE), STARTS))
    return np.stack([values.mean(axis=1), values.std(axis=1, ddof=1) / np.sqrt(STARTS)], axis=1)


@pytest.mark.slow
@pytest.mark.long
def test_fitness_of_packing_equals_the_record():
    now, record = means(), np.array(list(DENSE.values()))
    off = np.abs(now[:, 0] - record[:, 0]) / np.hypot(now[:, 1], record[:, 1])
    assert (off < STANDARD_ERRORS).all(), now
    # Longer bodies change it.
    changed = np.abs(means(0.4)[:, 0] - record[:, 0]) / record[:, 1]
    assert (changed > STANDARD_ERRORS).any()
