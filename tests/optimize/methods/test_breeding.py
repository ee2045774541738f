import numpy as np
import pytest

from tests.optimize.fake_runs import bowl
from tisim import InputError
from tisim.optimize.methods.breeding import Breeder
from tisim.optimize.methods.breeding_settings import Breeding

GENES = 5


def rated(population):
    for individual in population:
        if not individual.fitness.valid:
            individual.fitness.values = (bowl(dict(enumerate(individual)), 0, noise=0.0),)
    return population


def test_z04_generation_has_6_parents_6_offspring_8_fresh():
    breeder = Breeder(GENES, Breeding(), seed=3)
    population = rated(breeder.first())
    assert len(population) == 20
    for generation in range(1, 13):
        ranked = sorted(population, key=lambda individual: individual.fitness.values[0])
        if generation % 4 == 0:
            breeder.recentre(ranked[0])
        population = breeder.next_generation(population)
        assert len(population) == 20
        assert population[:6] == ranked[:6]
        assert all(individual.fitness.valid for individual in population[:6])
        assert not any(individual.fitness.valid for individual in population[6:])
        for number, child in enumerate(population[6:12]):
            pair = np.array(ranked[number - number % 2 : number - number % 2 + 2])
            assert np.all(pair.min(axis=0) <= child)
            assert np.all(child <= pair.max(axis=0))
            weight = (np.array(child) - pair[1]) / (pair[0] - pair[1])
            assert np.ptp(weight) > 1e-3, "every component has its own weight"
        for individual in population[12:]:
            assert np.all((breeder.box.low <= individual) & (individual <= breeder.box.high))
        rated(population)
    np.testing.assert_allclose(breeder.box.width, 0.5**3)


def test_same_seed_same_individuals_other_seed_others():
    first, again, other = (Breeder(GENES, Breeding(), seed).first() for seed in (5, 5, 6))
    assert first == again
    assert first != other


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"population": 20, "parents": 15, "offspring": 14},
            "parents . offspring must be <= population = 20; received 29",
        ),
        ({"population": 8, "parents": 8}, "parents must be < population = 8; received 8"),
        ({"offspring": 3}, "even"),
        ({"offspring": 8, "parents": 6}, "two for each pair"),
        ({"population": 0}, "search.options.population must be at least 2; received 0"),
        ({"recentre_factor": float("nan")}, "recentre_factor must be"),
        ({"popultion": 20}, "search.options.popultion must be a known key: .*; received 20"),
        ({"mutate": {"name": "mutGaussian"}}, "search.options.mutate must be a known key: .*"),
    ],
)
def test_unfit_settings_are_refused_before_anything_runs(settings, message):
    with pytest.raises(InputError, match=message):
        Breeder(GENES, Breeding(**settings), seed=0)
