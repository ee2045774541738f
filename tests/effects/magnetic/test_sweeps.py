"""One sweep a step, as L21 has it: three touching spheres, in an L, after each of the first sweeps."""

import numpy as np

from tests.effects.contact.loads import close
from tests.effects.magnetic.magnets import MU_0, dipole_field
from tests.effects.magnetic.test_dipole_dipole import induced
from tests.scenes import by_id, compiled
from tisim.effects import MutualInducedMoment

L = np.array([[0, 0, 2.0], [0, 0, 0], [2.0, 0, 0]])
"""P1, P2 and P3 of L21, table 4.3: P2 touches P1, along the field, and P3, across it."""
ERRORS = [
    [-39.885, -36.526, 0.040],
    [-12.371, -12.515, -7.736],
    [-3.370, -3.321, 0.165],
    [-1.014, -1.082, -0.590],
    [-0.278, -0.286, 0.026],
]
"""Of the force on each, percent of that in the end, after 0, 1, ... sweeps from the moments that each has by
itself, for mu_r without end; computed with NumPy in plain loops."""


def force(m):
    """On each of the three, over 3 mu_0 / (4 pi)."""
    total = np.zeros((3, 3))
    for i, j in np.argwhere(~np.eye(3, dtype=bool)):
        d = L[j] - L[i]
        n = d / np.linalg.norm(d)
        a, b = m[i] @ n, m[j] @ n
        total[i] -= (a * m[j] + b * m[i] + (m[i] @ m[j] - 5 * a * b) * n) / np.linalg.norm(d) ** 4
    return total


def test_each_sweep_takes_moments_as_far_as_in_numpy():
    """A sweep a step, from nothing: after k + 1 of them the error is that of k sweeps of moments along the
    field. L21 prints -23.6, -22.9 and 17.0 %, then -0.66, -0.49 and 1.0 %, which no susceptibility or order
    of sweeps that was tried gives: each sweep leaves 0.27 to 0.31 of the error, not 0.03."""
    law = MutualInducedMoment(susceptibility=1e12, sweeps=0)
    simulation = compiled(induced(L, (0, 0, 1.0), law), capacity=4)
    simulation.load([induced(L, (0, 0, 1.0), law, steps=8, dt=1e-9)])
    gain, field, along = 4 * np.pi / MU_0, dipole_field(L), np.array([0, 0, 1.0])
    matrix = np.eye(9) - gain * field.transpose(0, 2, 1, 3).reshape(9, 9)
    final = np.linalg.solve(matrix, gain * np.tile(along, 3)).reshape(3, 3)
    # The sweep at the start has made these.
    moments = [gain * np.tile(along, (3, 1))]
    for _ in range(4):
        simulation.run(steps=1)
        (result,) = simulation.results()
        moments.append(gain * (along + np.einsum("ijab,jb->ia", field, moments[-1])))
        close(by_id(result)["moment"], moments[-1], 1e-9)
    sizes = [np.linalg.norm(force(m), axis=1) for m in moments]
    percent = 100 * (np.array(sizes) / np.linalg.norm(force(final), axis=1) - 1)
    np.testing.assert_allclose(percent, ERRORS, rtol=0, atol=2e-3)
    assert result.measures["sweep_factor"] < 0.32
