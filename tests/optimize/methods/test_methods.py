"""Requirements for every search method, and properties of single methods."""

import numpy as np
import pytest

from tests.optimize.fake_runs import FakeCache, FakeEvaluator, bowl, fake_problem
from tisim import InputError
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.base import every, find
from tisim.optimize.methods.cma_es import EDGE, drawn_of, folded, within
from tisim.optimize.methods.individual import Individual
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache

ONE = EnsembleSettings(min_starts=1, select=0, confirm=0)
METHODS = sorted(every())
SURROGATE = ("gaussian-process", "genetic")
"""Methods that take 0.05 s or more for a generation."""


def run(cache, function, evaluator=None, genes=5, **settings):
    settings = Settings(**{"seed": 1, "generations": 1000, "ensemble": ONE, **settings})
    return search(fake_problem(genes), evaluator or FakeEvaluator(function), cache, settings)


def quiet(design, seed):
    return bowl(design, seed, noise=0.0)


def rosenbrock(design, seed):
    """A curved valley along which the genes are coupled; its minimum is 0 at 1/2 in the unit cube."""
    x = 4 * np.array(list(design.values())) - 1
    return float(np.sum(100 * (x[1:] - x[:-1] ** 2) ** 2 + (1 - x[:-1]) ** 2))


def method_named(name, genes=5, seed=3, **options):
    kind = find(name)
    return kind(fake_problem(genes).genome, 1, kind.Options(**options), seed)


def worth(individuals, function=quiet):
    """Assign costs to individuals and sort them, best first."""
    for individual in individuals:
        cost = function(dict(enumerate(individual)), 0)
        reason = "" if np.isfinite(cost) else "failed"
        individual.know((FitnessEstimate(cost, 0.0, cost, cost, 1, True, reason),))
    return sorted((one for one in individuals if not one.failed), key=lambda one: one.fitness.values)


def test_methods_are_found_in_their_package():
    assert METHODS == ["cma-es", "gaussian-process", "genetic", "nsga2", "random", "restart", "zohdi"]


@pytest.mark.parametrize("name", METHODS)
def test_asks_within_the_unit_cube_and_by_its_seed_alone(name):
    references = [method_named(name), method_named(name), method_named(name, seed=4)]
    for _ in range(4 if name in SURROGATE else 12):
        populations = [method.ask() for method in references]
        assert [list(one) for one in populations[0]] == [list(one) for one in populations[1]]
        assert [list(one) for one in populations[0]] != [list(one) for one in populations[2]]
        for individuals, method in zip(populations, references, strict=True):
            assert all(isinstance(individual, Individual) for individual in individuals)
            assert np.all((np.array(individuals) >= 0) & (np.array(individuals) <= 1))
            assert 0 < method.width <= 1
            method.tell(individuals, worth(individuals))
            np.random.default_rng().random()


def driven(name, function, evaluations, genes, seed=3):
    """The least cost that a method finds on its own, without a cache or other parts of a search."""
    method, hall, evaluated = method_named(name, genes=genes, seed=seed), [], 0
    while evaluated < evaluations:
        individuals = method.ask()
        evaluated += sum(not individual.fitness.valid for individual in individuals)
        hall = sorted([*worth(individuals, function), *hall], key=lambda one: one.fitness.values)[:6]
        method.tell(individuals, hall)
    return hall[0].fitness.values[0]


@pytest.mark.parametrize("name", [name for name in METHODS if name != "random"])
def test_methods_beat_random_search_at_equal_evaluations(name):
    costs, chance, evaluations = [], [], 60 if name in SURROGATE else 300
    for seed in range(2 if name in SURROGATE else 5):
        costs.append(driven(name, quiet, evaluations, genes=8, seed=seed) - 0.5)
        chance.append(np.sum((np.random.default_rng(seed).random((340, 8)) - 0.3) ** 2, axis=1).min())
    assert np.median(costs) < np.median(chance) / 2
    assert max(costs) < min(chance)


@pytest.mark.parametrize("name", METHODS)
def test_budget_is_spent_and_not_exceeded(name):
    outcome = run(FakeCache(), quiet, method=name, max_evaluations=75)
    assert (outcome.stopped, outcome.evaluations) == ("evaluations", 75)
    starts = {"min_starts": 3, "max_starts": 9, "block": 3, "tolerance": 1e-3, "race": 6}
    outcome = run(FakeCache(), bowl, method=name, max_evaluations=100, ensemble=starts)
    assert outcome.stopped == "evaluations"
    assert 97 < outcome.evaluations <= 100


@pytest.mark.parametrize(
    "name", [pytest.param(n, marks=[pytest.mark.slow] * (n in ("random", "restart"))) for n in METHODS]
)
@pytest.mark.parametrize("after", [pytest.param(1, marks=pytest.mark.slow), 140])
def test_a_resumed_search_is_the_same(path, name, after):
    settings = {
        "method": name, "generations": 5 if name in SURROGATE else 9,
        "ensemble": EnsembleSettings(tolerance=3e-3, min_starts=2, block=2, max_starts=8, race=12),
    }  # fmt: skip
    settings["options"] = {"population": 8, **({"parents": 2} if name in ("zohdi", "restart") else {})}

    def course_of(outcome):
        return repr(list(outcome.logbook)), [(list(one), repr(one.estimates)) for one in outcome.hall]

    whole = run(FakeCache(), bowl, **settings)
    with Cache(path) as cache:
        part = run(cache, bowl, FakeEvaluator(interrupt_after=after), **settings)
    assert (part.stopped, part.evaluations) == ("interrupted", after)
    with Cache(path) as cache:
        again = run(cache, bowl, **settings)
    assert course_of(again) == course_of(whole)
    assert again.evaluations == whole.evaluations - after
    assert whole.evaluations > (150 if name in SURROGATE else 200)


@pytest.mark.parametrize("name", METHODS)
def test_some_failures_and_only_failures(name):
    def half(design, seed):
        return quiet(design, seed) if design["x0"] > 0.5 else "lost"

    outcome = run(FakeCache(), half, method=name, generations=6 if name in SURROGATE else 12)
    assert max(outcome.logbook.select("failed")) > 0
    assert outcome.best[0] > 0.5
    assert outcome.best.estimates[0].mean < 0.7
    outcome = run(FakeCache(), lambda design, seed: "lost", method=name, generations=1)
    assert outcome.best is None
    assert len(outcome.logbook) == 2


def test_cma_es_follows_a_valley_that_the_genetic_algorithm_does_not():
    best = {name: driven(name, rosenbrock, 1500, genes=4) for name in ("cma-es", "zohdi")}
    assert best["cma-es"] < 1e-6
    assert best["cma-es"] < best["zohdi"] / 100


def corner(design, seed):
    """A cone with its minimum at a corner of the unit cube."""
    return float(np.linalg.norm(list(design.values())))


def test_cma_es_finds_a_corner():
    """With reflection at the bounds it would only reach 1e-4."""
    method, least = method_named("cma-es", genes=4), np.inf
    for _ in range(50):
        individuals = method.ask()
        hall = worth(individuals, corner)
        method.tell(individuals, hall)
        least = min(least, hall[0].fitness.values[0])
    assert least < 1e-6


def test_designs_beyond_the_bounds_are_moved_inside():
    points = np.linspace(-EDGE, 1 + EDGE, 2001)
    inside, slope = within(points), np.gradient(within(points), points)
    assert (inside[0], inside[-1]) == (0.0, 1.0)
    middle = (points >= EDGE) & (points <= 1 - EDGE)
    np.testing.assert_array_equal(inside[middle], points[middle])
    assert np.abs(np.diff(slope)).max() < 0.02
    assert slope.min() >= 0
    np.testing.assert_allclose(within(1 - points), 1 - inside, atol=1e-15)
    np.testing.assert_allclose(drawn_of(inside), points, atol=1e-12)
    far = np.array([-EDGE - 0.2, 1 + EDGE + 0.2, 3 + 5 * EDGE + 0.1, 0.5])
    np.testing.assert_allclose(
        folded(far), [-EDGE + 0.2, 1 + EDGE - 0.2, 1 + EDGE - 0.1 - 0, 0.5], atol=1e-12
    )


def test_cma_es_restarts_with_twice_the_population_after_convergence():
    method = method_named("cma-es", genes=2, smallest=1e-2)
    sizes, moved = [], []
    for _ in range(60):
        individuals = method.ask()
        sizes.append(len(individuals))
        method.tell(individuals, worth(individuals))
        moved.append(method.moved)
    assert sizes[0] == 6
    first = moved.index(True)
    assert set(sizes[: first + 1]) == {6}
    assert sizes[first + 1] == 12
    assert method.width > 0


def test_a_stalled_search_restarts_around_the_best():
    method = method_named("restart", genes=3, stalled=2, smallest=0.2)
    widths, best = [], None
    for generation in range(14):
        individuals = method.ask()
        assert len(individuals) == 20
        if generation and method.moved:
            assert [one.fitness.valid for one in individuals] == [True] + [False] * 19, "only the best stays"
            assert individuals[0] is best
            assert np.all(np.abs(np.array(individuals) - best).max(axis=0) <= method.width)
            widths.append(method.width)
        if best is None:
            best = worth(individuals)[0]
        for individual in individuals:
            if individual is not best:
                individual.know((FitnessEstimate.certain(9.0),))  # never better than the first
        method.tell(individuals, [best])
    assert widths == [0.5, 0.25, 1.0, 0.5, 0.25, 1.0]


def test_options_belong_to_the_method():
    assert Settings(method="cma-es", options={"sigma": 0.2}).options.sigma == 0.2
    for name, options, message in (
        ("cma-es", {"parents": 3}, r"search\.options\.parents must be a known key: .*; received 3"),
        ("zohdi", {"sigma": 0.2}, r"search\.options\.sigma must be a known key: .*; received 0\.2"),
        ("cma-es", {"sigma": 0}, r"search\.options\.sigma must be greater than 0\.0; received 0"),
        ("restart", {"recentre_every": 4}, r"search\.options\.recentre_every must be at most 0; received 4"),
        ("nsga2", 5, r"search\.options must be settings of the method, by name; received 5"),
    ):
        with pytest.raises(InputError, match=message):
            Settings(method=name, options=options)
    again = Settings.model_validate_json(
        Settings(method="nsga2", options={"population": 5}).model_dump_json()
    )
    assert again.options.population == 5
