"""The shape of noise is estimated from designs with two starts each, including the sign of its skewness."""

import numpy as np
import pytest

from tisim.optimize import Gene, Genome, Objective
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.individual import Individual
from tisim.optimize.surrogate.noise import LEAST_DESIGNS, moments

GENOME = Genome((Gene("x", "", 0.0, 1.0), Gene("y", "", 0.0, 1.0)))


BOWL = Objective("bowl", lambda result: result.value)


def designs(draw, number=400, starts=2, seed=1):
    """Designs of a bowl with noise, each with ``starts`` starts."""
    rng = np.random.default_rng(seed)
    made = []
    for _ in range(number):
        point = rng.random(2)
        individual = Individual(point)
        individual.know((FitnessEstimate.of(BOWL, (point**2).sum() + draw(rng, starts), False),))
        made.append(individual)
    return made


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("starts", [2, 5])
def test_rare_outcomes_are_detected_with_their_sign(sign, starts):
    """For one outcome in 20 at 20 deviations the moments are 1 + 19 and 0.05 * 0.95 * 0.9 * 20^3."""
    made = designs(lambda rng, n: sign * (rng.normal(size=n) + 20 * (rng.random(n) < 0.05)), starts=starts)
    (found,) = moments(GENOME, made)
    assert found.second == pytest.approx(20, rel=0.3)
    assert found.third == pytest.approx(sign * 342, rel=0.4)
    assert 0.5 * 400 * starts < found.count <= 400 * starts


def test_normal_noise_has_no_skewness():
    (found,) = moments(GENOME, designs(lambda rng, n: 0.1 * rng.normal(size=n)))
    assert found.second == pytest.approx(0.01, rel=0.15)
    assert abs(found.skewness) < 0.5


def test_unpredicted_deviations_reduce_the_weight():
    """Next to an unpredictable deviation of 100, noise of 1 is hardly visible."""
    rng = np.random.default_rng(2)
    made = designs(lambda _, n: 100 * rng.normal() + rng.normal(size=n))
    (found,) = moments(GENOME, made)
    assert found.count < 4


def test_few_designs_or_single_starts_give_no_shape():
    def noise(rng, n):
        return rng.normal(size=n)

    assert moments(GENOME, designs(noise, number=LEAST_DESIGNS - 1)) is None
    assert moments(GENOME, designs(noise, starts=1)) is None
    assert moments(GENOME, designs(noise, number=LEAST_DESIGNS)) is not None
