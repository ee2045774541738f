"""A genetic algorithm with DEAP or user operators, with and without a surrogate."""

import functools
import random

import numpy as np
import pytest
from deap import base, tools

from tests.optimize.fake_runs import FakeCache, FakeEvaluator, bowl, fake_problem
from tisim import InputError
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.methods.base import find
from tisim.optimize.methods.individual import Individual
from tisim.optimize.methods.operators import GeneticOperator
from tisim.optimize.problem.genes import Choice
from tisim.optimize.problem.genome import Gene, Genome
from tisim.optimize.search import search
from tisim.optimize.settings import Settings, identity

GENES = 5
ONE = EnsembleSettings(min_starts=1, max_starts=1, block=1)


def method(objectives=1, genome=None, seed=3, **options):
    kind = find("genetic")
    genome = genome or fake_problem(GENES).genome
    return kind(genome, objectives, kind.Options(**options), seed)


def told(individuals, function):
    """Assign costs to individuals, one number or several."""
    for individual in individuals:
        individual.know(
            tuple(FitnessEstimate.certain(float(c)) for c in np.atleast_1d(function(np.array(individual))))
        )
    return individuals


def searched(function, evaluations, **settings):
    """All designs that a method asks for when it runs on its own."""
    found, one = [], method(**settings)
    while len(found) < evaluations:
        individuals = one.ask()
        one.tell(told(individuals, function), [])
        found += individuals
    return found


def valley(x):
    """Rosenbrock's function, 0 at 1/2; the genes are coupled."""
    y = 4 * x - 1
    return float(np.sum(100 * (y[1:] - y[:-1] ** 2) ** 2 + (1 - y[:-1]) ** 2))


def two_costs(x):
    """Two bowls; every design between their centres is on the front."""
    return np.sum((x - 0.3) ** 2), np.sum((x - 0.7) ** 2)


def test_half_of_each_generation_is_in_the_trust_region():
    """Without noise: half of each generation lies in the trust region, and the rest away from its centre."""
    one = method()
    one.tell(told(one.ask(), valley), [])
    for _ in range(5):
        individuals = told(one.ask(), valley)
        distance = np.abs(np.array(individuals) - one.region.centre).max(axis=1)
        assert np.all(distance[: one.local] <= one.region.half_width + 1e-12)
        assert np.all(distance[one.local :] > 0.1)
        one.tell(individuals, [])


def test_the_surrogate_saves_runs():
    """With 60 runs and three seeds it is far better than the same algorithm without a surrogate."""
    best = {
        assisted: [
            min(one.fitness.values[0] for one in searched(valley, 60, seed=seed, surrogate=assisted))
            for seed in range(3)
        ]
        for assisted in (True, False)
    }
    assert np.median(best[True]) < np.median(best[False]) / 3


def test_the_surrogate_saves_noisy_runs():
    """With noise there is no trust region, so the ranking by the surrogate alone must help."""
    noise = np.random.default_rng(0)
    best = {}
    for assisted in (True, False):
        best[assisted] = []
        for seed in range(3):
            one, found = method(seed=seed, surrogate=assisted), []
            while len(found) < 60:
                individuals = one.ask()
                for individual in individuals:
                    cost = float(np.sum((np.array(individual) - 0.3) ** 2)) + 0.01 * noise.normal()
                    individual.know((FitnessEstimate(cost, 0.014, cost - 0.01, cost + 0.01, 2, True),))
                one.tell(individuals, [])
                found += individuals
            last = np.array(found[-8:])
            best[assisted].append(np.median(np.sum((last - 0.3) ** 2, axis=1)))
    assert np.median(best[True]) < 0.02
    assert np.median(best[True]) < np.median(best[False]) / 3


def test_several_objectives_with_a_surrogate_come_nearer_to_the_front():
    excess = {}
    for assisted in (True, False):
        found = searched(
            two_costs, 56, objectives=2, surrogate=assisted, **({} if assisted else {"population": 8})
        )
        costs = np.array([individual.fitness.values for individual in found[-16:]])
        # On the line between the centres sqrt(f1) + sqrt(f2) is their distance; elsewhere it is larger.
        excess[assisted] = np.sqrt(costs).sum(axis=1) - 0.4 * np.sqrt(GENES)
    assert np.median(excess[True]) < np.median(excess[False]) / 3
    assert np.median(excess[True]) < 0.05


def test_each_design_is_asked_for_once_and_few_designs_are_all_found():
    genome = Genome((Choice("material", ("steel", "glass", "ice")), Choice("wall", ("soft", "hard"))))
    for options in ({"first": 2, "population": 2}, {"surrogate": False, "population": 2}):
        one, asked = method(genome=genome, **options), []
        for _ in range(12):
            individuals = one.ask()
            one.tell(told(individuals, lambda x: float(x.sum())), [])
            asked += [tuple(genome.decode(individual).values()) for individual in individuals]
        assert len(set(asked)) == 6
        # generation 0 may have the same design twice
        assert len(asked) <= 6 + 2


def test_a_search_of_few_designs_ends():
    genome = Genome((Choice("material", ("steel", "glass")), Choice("wall", ("soft", "hard"))))
    problem = fake_problem(genome=genome)
    evaluator = FakeEvaluator(lambda design, seed: 1.0 + (design["wall"] == "hard") - len(design["material"]))
    for options in ({"first": 2, "population": 2}, {"surrogate": False}):
        settings = Settings(method="genetic", options=options, generations=8, ensemble=ONE)
        outcome = search(problem, evaluator, FakeCache(), settings)
        assert outcome.best.fitness.values == (-4.0,)
        assert len(outcome.logbook) == 9


OPTIONS = {
    "selDoubleTournament": {"fitness_size": 3, "parsimony_size": 1.2, "fitness_first": True},
    "selTournament": {"tournsize": 3},
    "cxBlend": {"alpha": 0.5},
    "cxSimulatedBinary": {"eta": 10.0},
    "cxSimulatedBinaryBounded": {"eta": 10.0},
    "cxUniform": {"indpb": 0.5},
    "mutGaussian": {"mu": 0.0, "sigma": 0.3, "indpb": 0.5},
    "mutPolynomialBounded": {"eta": 5.0, "indpb": 0.5},
    "mutShuffleIndexes": {"indpb": 0.3},
}
OPERATORS = {
    "select": ["selTournament", "selBest", "selRandom", "selWorst", "selLexicase", "selDoubleTournament"],
    "mate": [
        "cxBlend", "cxSimulatedBinaryBounded", "cxSimulatedBinary", "cxUniform", "cxOnePoint", "cxTwoPoint",
    ],
    "mutate": ["mutGaussian", "mutPolynomialBounded", "mutShuffleIndexes"],
}  # fmt: skip


@pytest.mark.parametrize(
    ("role", "name"), [(role, name) for role, names in OPERATORS.items() for name in names]
)
def test_deap_operators_breed_within_the_range(role, name):
    operator = {role: {"name": name, "options": OPTIONS.get(name, {})}}
    found = searched(lambda x: bowl(dict(enumerate(x)), 0, noise=0.0), 100, surrogate=False, **operator)
    assert all(isinstance(individual, Individual) and len(individual) == GENES for individual in found)
    assert np.all((np.array(found) >= 0) & (np.array(found) <= 1))
    assert len({tuple(individual) for individual in found}) > 90


def swapped(one, two, share=0.5):
    """A user-defined crossover."""
    for i in range(len(one)):
        if random.random() < share:
            one[i], two[i] = two[i], one[i]
    return one, two


def moved(individual, low, up, width=0.1):
    """A user-defined mutation with NumPy random numbers."""
    for i, change in enumerate(np.random.normal(0.0, width, len(individual))):  # noqa: NPY002
        individual[i] = min(max(individual[i] + change, low), up)
    return (individual,)


def test_operators_of_the_user_are_called_and_draw_nothing_global():
    calls = []

    def counted(individual, low, up):
        calls.append((low, up))
        return moved(individual, low, up)

    def state():
        return random.getstate(), np.random.get_state()[1].tolist()  # noqa: NPY002

    individuals = []
    for _ in range(2):
        before = state()
        one = method(mate=swapped, mutate=counted, surrogate=False)
        one.tell(told(one.ask(), valley), [])
        individuals.append([list(individual) for individual in one.ask()])
        assert state() == before
        random.random()
        np.random.random()  # noqa: NPY002
    assert individuals[0] == individuals[1]
    assert set(calls) == {(0.0, 1.0)}


def test_operators_of_a_toolbox_of_deap():
    toolbox = base.Toolbox()
    toolbox.register("mate", tools.cxBlend, alpha=0.3)
    toolbox.register("mutate", tools.mutPolynomialBounded, eta=5.0, indpb=0.5)
    by_toolbox = searched(valley, 60, surrogate=False, mate=toolbox.mate, mutate=toolbox.mutate)
    by_name = searched(
        valley, 60, surrogate=False,
        mate={"name": "cxBlend", "options": {"alpha": 0.3}},
        mutate={"name": "mutPolynomialBounded", "options": {"eta": 5.0, "indpb": 0.5}},
    )  # fmt: skip
    assert by_toolbox == by_name


def toolbox_of(**operators):
    toolbox = base.Toolbox()
    for role, (function, options) in operators.items():
        toolbox.register(role, function, **options)
    return toolbox


BLEND, POLYNOMIAL = (tools.cxBlend, {"alpha": 0.3}), (tools.mutPolynomialBounded, {"eta": 5.0, "indpb": 0.5})


def test_a_whole_toolbox_of_deap():
    select = (tools.selTournament, {"tournsize": 3})
    toolbox = toolbox_of(select=select, mate=BLEND, mutate=POLYNOMIAL, evaluate=(valley, {}))
    by_name = {
        "select": {"name": "selTournament", "options": {"tournsize": 3}},
        "mate": {"name": "cxBlend", "options": {"alpha": 0.3}},
        "mutate": {"name": "mutPolynomialBounded", "options": {"eta": 5.0, "indpb": 0.5}},
    }
    for surrogate in (False, True):
        found = searched(valley, 40, surrogate=surrogate, toolbox=toolbox)
        assert found == searched(valley, 40, surrogate=surrogate, **by_name)
        assert found != searched(valley, 40, surrogate=surrogate)
    nsga2 = find("nsga2")
    options = nsga2.Options(toolbox=toolbox_of(mate=BLEND), population=12)
    assert nsga2(fake_problem(GENES).genome, 1, options, 3).operators.toolbox.mate.func.keywords == BLEND[1]


def test_the_selection_of_nsga2_in_a_toolbox_takes_any_number_of_parents():
    costs = functools.partial(searched, two_costs, 60, objectives=2, surrogate=False, population=10)
    assert costs(toolbox=toolbox_of(select=(tools.selTournamentDCD, {}))) == costs()


def test_decorators_of_a_toolbox():
    calls = []

    def kept(function):
        @functools.wraps(function)
        def wrapped(*arguments, **options):
            calls.append(options)
            children = function(*arguments, **options)
            for child in children:
                child[:] = [0.5 * gene for gene in child]
            return children

        return wrapped

    toolbox = toolbox_of(mate=BLEND, mutate=POLYNOMIAL)
    plain = searched(valley, 60, surrogate=False, toolbox=toolbox)
    toolbox.decorate("mate", kept)
    decorated = searched(valley, 60, surrogate=False, toolbox=toolbox)
    assert calls[0] == BLEND[1]
    assert np.mean(decorated[20:]) < np.mean(plain[20:]) - 0.05


def test_the_operators_of_a_toolbox_are_part_of_the_search():
    def made(alpha):
        toolbox = toolbox_of(mate=(tools.cxBlend, {"alpha": alpha}))
        settings = Settings(method="genetic", options={"toolbox": toolbox})
        return identity(fake_problem(GENES), settings, {})["search"]["options"]

    assert made(0.3) == made(0.3)
    assert made(0.3) != made(0.4)
    assert made(0.3)["mate"]["name"] == "cxBlend"
    assert "toolbox" not in made(0.3)


def test_operators_are_part_of_the_search():
    def made(**options):
        return identity(fake_problem(GENES), Settings(method="genetic", options=options), {})

    narrow, wide = (functools.partial(moved, width=width) for width in (0.1, 0.2))
    assert made(mutate=narrow) == made(mutate=functools.partial(moved, width=0.1))
    assert made(mutate=narrow) != made(mutate=wide) != made()
    stored = made(mutate=narrow)["search"]["options"]["mutate"]
    assert stored["name"] == "moved"
    assert len(stored["checksum"]) == 24
    settings = Settings(method="genetic", options={"mutate": narrow})
    again = Settings.model_validate_json(settings.model_dump_json())
    with pytest.raises(InputError, match="mutate must be the function itself, from Python; received moved"):
        search(fake_problem(GENES), FakeEvaluator(), FakeCache(), again)


@pytest.mark.parametrize(
    ("options", "objectives", "message"),
    [
        ({"select": "selNothing"}, 1, "operator name must be one of .*selTournament.*'selNothing'"),
        ({"mate": "mutGaussian"}, 1, "operator name must be one of cx"),
        ({"select": "selRoulette"}, 1, "favours large fitness"),
        ({"select": "selNSGA2"}, 1, "several objectives"),
        ({"select": "selBest"}, 2, "operator name must be one of selTournamentDCD, .*; received 'selBest'"),
        ({"mate": "cxBlend"}, 1, r"options of cxBlend must be complete: \['alpha'\]"),
        ({"mate": {"name": "cxBlend", "options": {"beta": 2}}}, 1, "options of cxBlend must be among"),
        ({"mate": "cxOrdered"}, 1, "fit for real-valued individuals"),
        ({"mutate": lambda individual: individual}, 1, "fit for real-valued individuals"),
        ({"mutate": lambda individual: ([np.nan] * len(individual),)}, 1, "fit for real-valued individuals"),
        (
            {"mutate": lambda individual: (list(np.random.default_rng().random(len(individual))),)}, 1,
            "operators must be random by the modules random and numpy.random alone",
        ),
        ({"surrogate": False, "inner": 3}, 1, "inner must be left out if surrogate is false"),
        ({"parents": 3}, 1, "search.options.parents must be a known key"),
        ({"toolbox": "mine"}, 1, "search.options.toolbox must be a deap.base.Toolbox .*; received 'mine'"),
        (
            {"toolbox": toolbox_of(evaluate=(valley, {}))}, 1,
            "with one or more of select, mate, mutate; received one with clone, map, evaluate",
        ),
        (
            {"toolbox": toolbox_of(mate=BLEND), "mate": "cxOnePoint"}, 1,
            "search.options.mate must be left out if the toolbox has it; received 'cxOnePoint'",
        ),
        ({"toolbox": toolbox_of(mate=(tools.cxBlend, {}))}, 1, r"must be complete: \['alpha'\]"),
        ({"toolbox": toolbox_of(mate=(tools.cxOrdered, {}))}, 1, "fit for real-valued individuals"),
        ({"toolbox": toolbox_of(mate=(tools.cxESBlend, BLEND[1]))}, 1, "no attribute 'strategy'"),
        ({"toolbox": toolbox_of(select=(tools.selNSGA2, {}))}, 2, "one of selTournamentDCD, .*'selNSGA2'"),
    ],
)  # fmt: skip
def test_unfit_settings_are_refused_before_anything_runs(options, objectives, message):
    with pytest.raises(InputError, match=message):
        method(objectives, **options)


def test_an_operator_is_given_by_its_name_alone():
    assert method(mate="cxOnePoint").options.mate == GeneticOperator(name="cxOnePoint")


def test_nsga2_equals_the_genetic_method_without_a_surrogate():
    kind = find("nsga2")
    costs = {1: lambda x: x, 2: lambda x: np.append(x, 1 - x)}
    for objectives, population in ((1, 20), (2, 40)):
        references = (
            kind(Genome((Gene("x", "", 0.0, 1.0),)), objectives, kind.Options(), 5),
            method(objectives, Genome((Gene("x", "", 0.0, 1.0),)), 5, surrogate=False),
        )
        for _ in range(3):
            asked = [one.ask() for one in references]
            assert asked[0] == asked[1]
            assert len(asked[0]) == population
            for one, individuals in zip(references, asked, strict=True):
                one.tell(told(individuals, costs[objectives]), [])
