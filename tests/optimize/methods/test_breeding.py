import random

import numpy as np
import pytest

from optimize.methods.breeding import Breeder
from optimize.methods.breeding_settings import Breeding, GeneticOperator
from optimize.methods.individual import Individual
from tests.optimize.fake_runs import bowl
from tisim import InputError

GENES = 5


def rated(population):
    for string in population:
        if not string.fitness.valid:
            string.fitness.values = (bowl(dict(enumerate(string)), 0, noise=0.0),)
    return population


def test_z04_generation_has_6_parents_6_offspring_8_fresh():
    breeder = Breeder(GENES, Breeding(), seed=3)
    population = rated(breeder.first())
    assert len(population) == 20
    for generation in range(1, 13):
        ranked = sorted(population, key=lambda string: string.fitness.values[0])
        if generation % 4 == 0:
            breeder.recentre(ranked[0])
        population = breeder.next_generation(population)
        assert len(population) == 20
        assert population[:6] == ranked[:6]
        assert all(string.fitness.valid for string in population[:6])
        assert not any(string.fitness.valid for string in population[6:])
        for number, child in enumerate(population[6:12]):
            pair = np.array(ranked[number - number % 2 : number - number % 2 + 2])
            assert np.all(pair.min(axis=0) <= child)
            assert np.all(child <= pair.max(axis=0))
            weight = (np.array(child) - pair[1]) / (pair[0] - pair[1])
            assert np.ptp(weight) > 1e-3, "every component has its own weight"
        for string in population[12:]:
            assert np.all((breeder.box.low <= string) & (string <= breeder.box.high))
        rated(population)
    np.testing.assert_allclose(breeder.box.width, 0.5**3)


def test_same_seed_same_strings_other_seed_others():
    first, again, other = (Breeder(GENES, Breeding(), seed).first() for seed in (5, 5, 6))
    assert first == again
    assert first != other


OPERATORS = {
    "select": ["selTournament", "selBest", "selRandom", "selWorst", "selLexicase", "selDoubleTournament"],
    "mate": [
        "cxBlend",
        "cxSimulatedBinaryBounded",
        "cxSimulatedBinary",
        "cxUniform",
        "cxOnePoint",
        "cxTwoPoint",
    ],
    "mutate": ["mutGaussian", "mutPolynomialBounded", "mutShuffleIndexes"],
}
OPTIONS = {
    "selTournament": {"tournsize": 3},
    "selDoubleTournament": {"fitness_size": 3, "parsimony_size": 1.2, "fitness_first": True},
    "cxBlend": {"alpha": 0.5},
    "cxSimulatedBinaryBounded": {"eta": 10.0},
    "cxSimulatedBinary": {"eta": 10.0},
    "cxUniform": {"indpb": 0.5},
    "mutGaussian": {"mu": 0.0, "sigma": 0.3, "indpb": 0.5},
    "mutPolynomialBounded": {"eta": 5.0, "indpb": 0.5},
    "mutShuffleIndexes": {"indpb": 0.3},
}


@pytest.mark.parametrize(
    ("kind", "name"), [(kind, name) for kind, names in OPERATORS.items() for name in names]
)
def test_deap_operators_breed_within_the_box(kind, name):
    operators = {kind: GeneticOperator(name=name, options=OPTIONS.get(name, {}))}
    settings = Breeding(breeding="deap", offspring=12, mutation_probability=1.0, **operators)
    breeder = Breeder(GENES, settings, seed=1)
    population = rated(breeder.first())
    offspring = set()
    for generation in range(6):
        if generation == 3:
            breeder.recentre(min(population, key=lambda string: string.fitness.values[0]))
        population = breeder.next_generation(population)
        for string in population[6:]:
            assert isinstance(string, Individual)
            assert not string.fitness.valid
            assert np.all((breeder.box.low <= string) & (string <= breeder.box.high))
            offspring.add(tuple(string))
        rated(population)
    assert len(offspring) > 40, "offspring differ"


def test_callers_random_state_is_untouched():
    random.seed(11)
    np.random.seed(11)  # noqa: NPY002 - the legacy global state is what is being guarded
    before = random.getstate(), np.random.get_state()[1].tolist()  # noqa: NPY002
    breeder = Breeder(GENES, Breeding(breeding="deap"), seed=1)
    breeder.next_generation(rated(breeder.first()))
    assert before == (random.getstate(), np.random.get_state()[1].tolist())  # noqa: NPY002


def test_callers_random_numbers_do_not_steer_the_search():
    def strings(noise):
        random.seed(noise)
        breeder = Breeder(GENES, Breeding(breeding="deap"), seed=1)
        population = rated(breeder.first())
        random.random()
        return breeder.next_generation(population)

    assert strings(1) == strings(2)


@pytest.mark.parametrize(
    ("settings", "message"),
    [
        (
            {"select": {"name": "selNothing"}},
            "operator name must be one of .*selTournament.*received 'selNothing'",
        ),
        ({"mate": {"name": "mutGaussian"}}, "operator name must be one of cx"),
        ({"select": {"name": "selRoulette"}}, "favours large fitness"),
        ({"select": {"name": "selNSGA2"}}, "several objectives"),
        ({"mate": {"name": "cxBlend"}}, r"options of cxBlend must be complete: \['alpha'\]"),
        (
            {"mate": {"name": "cxBlend", "options": {"alpha": 1, "beta": 2}}},
            "options of cxBlend must be among",
        ),
        ({"mate": {"name": "cxOrdered"}}, "fit for real-valued strings"),
        ({"mutate": {"name": "mutESLogNormal", "options": {"c": 1.0, "indpb": 1.0}}}, "fit for real-valued"),
        (
            {"mutate": {"name": "mutGaussian", "options": {"mu": 0, "sigma": "x", "indpb": 1}}},
            "fit for real-valued",
        ),
        (
            {"population": 20, "parents": 15, "offspring": 15},
            "parents . offspring must be <= population = 20; received 30",
        ),
        ({"population": 8, "parents": 8}, "parents must be < population = 8; received 8"),
        (
            {"breeding": "z04", "mutate": {"name": "mutNothing"}},
            "search.options.mutate must be left out unless breeding is deap",
        ),
        (
            {"breeding": "z04", "mutation_probability": 0.2},
            "search.options.mutation_probability must be left out unless breeding is deap; received 0.2",
        ),
        ({"offspring": 3, "breeding": "z04"}, "even"),
        ({"offspring": 8, "parents": 6, "breeding": "z04"}, "two for each pair"),
        ({"population": 0}, "search.options.population must be at least 2; received 0"),
        ({"recentre_factor": float("nan")}, "recentre_factor must be"),
        ({"popultion": 20}, "search.options.popultion must be a known key: .*; received 20"),
    ],
)
def test_unfit_settings_are_refused_before_anything_runs(settings, message):
    with pytest.raises(InputError, match=message):
        Breeder(GENES, Breeding(**{"breeding": "deap", **settings}), seed=0)
