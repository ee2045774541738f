"""The ball that relaxes before the blast: at rest by forces computed independently, and what it changes."""

from itertools import combinations

import numpy as np
import pytest
from scipy.integrate import quad

from tisim.cases.blast import scene as blast
from tisim.cases.blast.relaxation import CLUMPS, RANDOM, RELAXED, relaxation_figure
from tisim.cases.blast.relaxed_ball import (
    BALLS,
    BLASTS,
    NEAR_FIELD_OF_NEIGHBOURS,
    Ball,
    largest,
    mean,
    near_energy,
    relaxing,
    study,
    tables,
)

NUMBER, SEEDS = 60, range(2)
KINDS = {"no interaction": ({}, (RANDOM, RELAXED)), CLUMPS: BLASTS[CLUMPS]}
STIFFNESS = 1e7 * np.exp(-(300 / 500 - 1))
"""Contact stiffness at 300 K, Pa (Z16 7.18)."""


def attraction(d):
    """The near field of two particles, N."""
    return blast.MASS**2 * (0.5 / d - 0.01 / d**2)


def forces(position):
    """Near field of neighbours and contact (Z16 7.5, 7.23, B.5) on each particle, N."""
    total = np.zeros_like(position)
    for i, j in combinations(range(len(position)), 2):
        separation = position[j] - position[i]
        d = np.linalg.norm(separation)
        force = attraction(d) if d <= blast.NEIGHBOURS else 0.0
        if d < 2 * blast.RADIUS:
            area = np.pi * (blast.RADIUS**2 - d**2 / 4)
            force -= STIFFNESS * (1 - d / (2 * blast.RADIUS)) ** 2 * area
        total[i] += force * separation / d
        total[j] -= force * separation / d
    return total


def test_a_ball_that_relaxes_starts_at_rest_without_field():
    scene = relaxing(NUMBER, 3, BALLS[RELAXED])
    assert {"lorentz", "magnetic_field"}.isdisjoint(effect.kind() for effect in scene.effects)
    start, random = (
        one.particles.arrays(one.domain, one.seed) for one in (scene, blast.scene(number=NUMBER, seed=3))
    )
    assert not start["velocity"].any()
    np.testing.assert_array_equal(start["position"], random["position"])


def test_the_attraction_that_sets_rest_is_of_touching_particles():
    assert pytest.approx(attraction(2 * blast.RADIUS), rel=1e-12) == blast.PAIR_ATTRACTION


@pytest.mark.parametrize("cutoff", [blast.NEIGHBOURS, np.inf])
def test_energy_of_the_near_field_is_its_work(cutoff):
    position = np.array([(0, 0, 0), (0.11, 0, 0), (0, 0.12, 0.02), (0.3, 0.1, 0)])
    state = {"position": position, "mass": np.full(4, blast.MASS)}
    far = cutoff if np.isfinite(cutoff) else 2 * blast.BALL * (4 / blast.NUMBER) ** (1 / 3)
    distances = [np.linalg.norm(a - b) for a, b in combinations(position, 2)]
    work = sum(quad(attraction, d, far)[0] for d in distances if d < cutoff)
    assert near_energy(state, cutoff) == pytest.approx(work, rel=1e-9)


def test_largest_cluster_of_two_clusters():
    x = np.array([0.0, 0.09, 0.18, 1.0, 1.09, 3.0])
    state = {"position": np.outer(x, [1, 0, 0]), "radius": np.full(6, 0.05), "mass": np.ones(6)}
    assert largest(state) == 3


@pytest.fixture(scope="module")
def found():
    return study(NUMBER, SEEDS, (blast.ENERGY, 2e5), KINDS)


@pytest.mark.slow
def test_the_relaxed_ball_is_in_equilibrium(found):
    state = found.relaxed[RELAXED].state
    residual = np.linalg.norm(forces(state["position"]), axis=1).mean() / blast.PAIR_ATTRACTION
    assert found.relaxed[RELAXED].status.reason == "grains are at rest, by effects.at_rest"
    assert residual < 0.02
    # The forces on a particle cancel; they are not small.
    one_by_one = [
        np.linalg.norm(forces(state["position"][[0, j]])[0]) for j in range(1, NUMBER)
    ]  # fmt: skip
    assert sum(one_by_one) > 50 * residual * blast.PAIR_ATTRACTION
    for balls in found.balls.values():
        for ball in balls:
            assert ball.kinetic < 1e-4
            assert ball.unbalanced < 0.02
    assert mean(found.balls[RELAXED], "coordination").value > 5


@pytest.mark.slow
def test_a_relaxed_ball_holds_together(found):
    """With the energy of Z16 only the random ball becomes longer; far above the binding energy both do."""
    start = mean(found.balls[RELAXED], "half_axis").value
    assert mean(found.balls[RELAXED], "bound").value > 1.5
    assert mean(found.shapes[CLUMPS, RELAXED], "along").value < 1.3 * start
    assert mean(found.shapes[CLUMPS, RELAXED], "largest").value == NUMBER
    assert mean(found.shapes[CLUMPS, RANDOM], "along").value > 3 * start
    assert mean(found.by_energy[RELAXED, 2e5], "along").value > 3 * start
    free = found.shapes["no interaction", RELAXED]
    assert mean(free, "along").value > 3 * mean(free, "across").value


@pytest.mark.slow
def test_the_pulse_is_added_to_a_relaxed_ball(found):
    relaxed = found.relaxed[RELAXED]
    scene = blast.scene(number=NUMBER, start=relaxed, **NEAR_FIELD_OF_NEIGHBOURS)
    start = scene.particles.arrays(scene.domain, scene.seed)
    np.testing.assert_array_equal(start["position"], relaxed.state["position"])
    pulse = start["velocity"] - relaxed.state["velocity"]
    np.testing.assert_allclose(np.linalg.norm(pulse, axis=1), blast.SPEED, rtol=1e-9)
    np.testing.assert_allclose(start["charge"], blast.SPECIFIC_CHARGE * start["mass"])


@pytest.mark.slow
def test_tables_and_figure_have_the_means(found):
    text = tables(found)
    assert f"| {CLUMPS} | {RELAXED} | {mean(found.shapes[CLUMPS, RELAXED], 'along')} |" in text
    assert str(mean(found.shapes[CLUMPS, RANDOM], "along")) in text
    figure = relaxation_figure(found)
    *_, residuals, kinds, energies = figure.axes
    assert len(figure.axes) == 7
    assert residuals.lines[0].get_ydata()[-1] < 1e-4
    assert len(kinds.get_yticks()) == len(BLASTS)
    drawn = np.asarray(energies.containers[1].lines[0].get_ydata(), float)
    np.testing.assert_allclose(drawn, [mean(found.by_energy[RELAXED, w], "along").value for w in (1e4, 2e5)])
    assert isinstance(found.balls[RELAXED][0], Ball)
