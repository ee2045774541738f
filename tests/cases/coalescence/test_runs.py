"""Clouds that are looked at on their way, and what is drawn and said of them."""

import numpy as np
import pytest

from cases.case import Check
from cases.coalescence.checks import COMPARED, of_agglomeration, of_conservation, of_structure, of_the_cloud
from cases.coalescence.figures import asteroids, cluster_colours, forces, growth, shells, table
from cases.coalescence.measures import Conserved, Gathering
from cases.coalescence.published import MAGNETISATIONS
from cases.coalescence.runs import CloudRun, clouds, of_magnetisation
from cases.coalescence.scene import scene
from tests.cases.coalescence.test_measures import row, state_of


def made(magnetisation, bound, seed=0):
    """A run in which so many of 40 grains have come to be in a block, the others in pairs."""
    block = np.argwhere(np.ones((bound // 9, 3, 3))).astype(float)
    pairs = [row(2, at=(0, 10.0 * (k + 1), 0)) for k in range((40 - len(block)) // 2)]
    end = state_of(np.vstack([block, *pairs]), moment=np.tile([0.0, 0.0, 2.0], (40, 1)))
    states = [state_of(row(40, 3.0)), end]
    for state in states:
        state["velocity"], state["spin"] = np.tile([[1.0, 0.0, 0.0]], (2, 40, 1))
    return CloudRun(
        magnetisation, 0.5, scene(number=20, seed=seed), np.array([0.0, COMPARED]),
        [Gathering.of(one) for one in states], [Conserved.of(one) for one in states], end,
    )  # fmt: skip


RUNS = [
    made(m, bound, seed) for m, bound in zip(MAGNETISATIONS, (18, 18, 36), strict=True) for seed in (0, 1)
]


def test_what_is_said_of_runs():
    claims = {claim.name: claim for claim in (*of_agglomeration(RUNS), *of_structure(RUNS))}
    outside = claims["0 A/m: of grains outside, in clusters of two or more (L21, 50 cm: 0.007)"]
    assert outside.mean.value == 1.0
    assert claims["in clusters, 1190 less 0 A/m, of all grains"].mean.value == 0.0
    assert not claims["in clusters, 1190 less 0 A/m, of all grains"].least < 0
    ratio = RUNS[-1].asteroid.magnetisation / (0.5 * 1190.0)
    assert RUNS[-1].magnetised_part == pytest.approx(ratio)
    checks = {check.name: check for check in of_conservation(RUNS)}
    # Nothing moves; energy of gravity alone has fallen.
    assert all(check.ok for check in checks.values())


def test_the_rotation_at_which_a_cloud_parts():
    checks = list(of_the_cloud())
    assert all(isinstance(one, Check) and one.ok for one in checks)
    assert [one.expected for one in checks] == pytest.approx([82.8, 234.2], abs=0.5)


def test_what_is_drawn_of_runs():
    assert len(growth(RUNS).axes) == 3
    assert len(asteroids([of_magnetisation(RUNS, m)[0] for m in MAGNETISATIONS]).axes) == 3
    assert len(forces().axes) == 1
    assert len(table(RUNS).splitlines()) == 1 + len(RUNS)
    assert shells(RUNS[0]).shape == (2,)
    colours = cluster_colours(state_of(np.vstack([row(3), row(1, at=(0, 9, 0))])))
    assert (colours[:3] == colours[0]).all()
    assert not (colours[3] == colours[0]).all()


@pytest.mark.slow
def test_a_tiny_cloud_conserves_what_it_should():
    runs = clouds(1, number=30, seed_diameter=2.0, duration=400.0, looks=2, magnetisations=(0.0, 1190.0))
    assert [one.magnetisation for one in runs] == [0.0, 1190.0]
    for check in of_conservation(runs):
        assert check.ok, check
    # Magnets pull; the others only fall.
    assert runs[1].conserved[-1].kinetic > 1.05 * runs[0].conserved[-1].kinetic
