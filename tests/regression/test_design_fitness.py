"""The fitness functions of vibration and blast do not change unintentionally.

These runs are not chaotic, so their values are stored as numbers, to the accuracy of other compilers in f64
and to the accuracy of f32.
"""

from __future__ import annotations

import numpy as np
import pytest

import tisim
from tisim.backend import runtime
from tisim.cases.blast import problem as blast
from tisim.cases.vibration import problem as vibration

VIBRATION = {
    (1.0, 1.0): -0.7005773424878275,
    (0.785, 11.8): -12.379667822859995,
    (0.2, 765.0): -5.549151949409214,
    (2.0, 630.0): -0.1307905496542935,
}
"""Flux (T) and stiffness (N/m) of a design -> fitness: off resonance, fast resonance, slow resonance, off."""

BLAST = {
    ((0.6, 0.3, -0.2), 0): 0.02469592752685592,
    ((0.6, 0.3, -0.2), 1): 0.01787569504388483,
    ((-0.6, -0.3, 0.2), 0): 0.023674566599064154,
    ((0.0, 0.0, 0.0), 0): 0.40372260010242017,
    ((0.7, 0.0, 0.0), 0): 0.19479323221873243,
    ((0.3, 0.15, -0.1), 1): 0.2901524728242706,
}
"""Field (T) and seed of a start -> misfit, with 500 particles."""


def tolerance():
    return 1e-6 if runtime.current().precision == "f64" else 2e-3


def values(scale=1.0):
    """Fitness values of both cases, with all fields scaled by a factor."""
    wave = vibration.problem()
    shape = blast.problem("small")
    waves = [wave.scene({"flux": scale * b, "stiffness": k}, 0) for b, k in VIBRATION]
    shapes = [
        shape.scene({f"flux_{axis}": scale * b for axis, b in zip("xyz", field, strict=True)}, seed)
        for field, seed in BLAST
    ]
    return (
        [wave.objective(result) for result in tisim.run(waves)],
        [shape.objective(result) for result in tisim.run(shapes)],
    )


@pytest.mark.long
def test_fitness_of_vibration_and_blast_equals_the_record():
    waves, shapes = values()
    np.testing.assert_allclose(waves, list(VIBRATION.values()), rtol=tolerance())
    np.testing.assert_allclose(shapes, list(BLAST.values()), rtol=tolerance())
    # A field stronger by 1 % changes each value that depends on it.
    waves, shapes = values(1.01)
    changed = [
        not np.isclose(a, b, rtol=2 * tolerance()) for a, b in zip(waves, VIBRATION.values(), strict=True)
    ]
    assert all(changed)
    changed = [
        not np.isclose(a, b, rtol=2 * tolerance()) for a, b in zip(shapes, BLAST.values(), strict=True)
    ]
    assert changed == [any(field) for field, _ in BLAST]
