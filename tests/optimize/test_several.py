"""Several objectives: the front is found and kept whole, and its search can be resumed."""

import csv
import pickle

import numpy as np
import pytest
from deap import creator, tools
from matplotlib.image import imread

from tests.optimize.fake_runs import FakeEvaluator, fake_problem, fake_record
from tisim import InputError
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.evaluation.estimate import FitnessEstimate
from tisim.optimize.hall_of_fame import HallOfFame, compromise, not_dominated
from tisim.optimize.methods.individual import Individual
from tisim.optimize.outcome import Outcome
from tisim.optimize.problem.objective import Objective
from tisim.optimize.report import report
from tisim.optimize.report.front import front_figure, others
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache, existing
from tisim.optimize.storage.maintenance import compact, verify
from tisim.optimize.storage.record import Record

ONE = EnsembleSettings(min_starts=1, select=0, confirm=0)
OBJECTIVES = (
    Objective("gain", lambda r: r.value[0], "1/s", maximise=True),
    Objective("price", lambda r: r.value[1]),
)


def zdt1(design, seed, noise=0.0):
    """ZDT1 (Zitzler, Deb and Thiele, Evol. Comput. 8 (2000) 173-195), with the first objective inverted.

    The front is price = 1 - sqrt(-gain), with all genes but the first equal to 0.
    """
    x = np.array(list(design.values()))
    g = 1 + 9 * x[1:].mean()
    a, b = noise * np.random.default_rng(seed).normal(size=2)
    return -float(x[0] + a), float(g * (1 - np.sqrt(x[0] / g)) + b)


def run(path, function=zdt1, evaluator=None, genes=3, **settings):
    chosen = Settings(**{"method": "nsga2", "seed": 1, "ensemble": ONE, "generations": 30, **settings})
    problem = fake_problem(genes, objective=OBJECTIVES)
    with Cache(path) as cache:
        return search(problem, evaluator or FakeEvaluator(function), cache, chosen)


@pytest.fixture(scope="module")
def outcome(tmp_path_factory):
    return run(tmp_path_factory.mktemp("front") / "cache.h5")


def values(outcome):
    return np.array([outcome.problem.costs(individual.fitness.values) for individual in outcome.hall])


def test_nsga2_finds_the_front_and_spreads_along_it(outcome):
    gain, price = values(outcome).T
    assert len(gain) >= 40
    assert np.mean(price - (1 - np.sqrt(-gain)) < 0.05) > 0.95
    assert np.ptp(gain) > 0.95
    assert np.diff(np.sort(gain)).max() < 0.1
    random = np.random.default_rng(0).random((40 * 31, 3))
    chance = [zdt1(dict(enumerate(x)), 0) for x in random]
    assert np.mean([p - (1 - np.sqrt(-g)) < 0.05 for g, p in chance]) < 0.01, "not by chance"


def test_no_design_of_the_front_is_dominated(outcome):
    costs = [[estimate.mean for estimate in estimates] for estimates in outcome.estimates.values()]
    front, points = values(outcome), np.array([outcome.problem.costs(each) for each in costs])
    better = (points[:, None, 0] >= front[None, :, 0]) & (points[:, None, 1] <= front[None, :, 1])
    strictly = (points[:, None, 0] > front[None, :, 0]) | (points[:, None, 1] < front[None, :, 1])
    assert not np.any(better & strictly)
    dominated = (
        (points[:, None, 0] >= points[None, :, 0]) & (points[:, None, 1] <= points[None, :, 1])
        & ((points[:, None, 0] > points[None, :, 0]) | (points[:, None, 1] < points[None, :, 1]))
    ).any(axis=0)  # fmt: skip
    assert len({tuple(point) for point in points[~dominated]}) == len(front)
    assert list(front[:, 0]) == sorted(front[:, 0], reverse=True), "most gain first"


def test_compromise_is_nearest_to_the_best_of_each():
    front = []
    for costs in ((0.0, 10.0), (0.4, 4.0), (0.9, 3.0), (1.0, 0.0)):
        front.append(Individual(costs, 2))
        front[-1].fitness.values = costs
    assert compromise(front) is front[1]
    assert compromise(front[:1]) is front[0]


def test_a_confirmed_front_is_sorted_by_its_means_over_held_out_starts():
    """Of costs (1, 3), (2, 2), (3, 1) the first is worse than it seemed, and the last is dominated."""
    front = []
    for first, confirmed in ((1.0, (2.5, 1.5)), (2.0, (2.0, 2.0)), (3.0, (3.0, 1.6))):
        front.append(Individual((first,), 2))
        front[-1].fitness.values = (first, 4.0 - first)
        front[-1].confirmed = tuple(FitnessEstimate(c, 0.1, c, c, 4, True, "") for c in confirmed)
    assert not_dominated(front) == [front[1], front[0]]


def test_hall_of_one_objective_keeps_the_best_different_ones():
    hall = HallOfFame(2)

    def individual(genes, cost):
        individual = Individual(genes)
        individual.know((FitnessEstimate(cost, 0.0, cost, cost, 4, True, "" if cost < 9 else "failed"),))
        return individual

    assert hall.update(
        [individual([0.1], 3.0), individual([0.1], 3.0), individual([0.2], 2.0), individual([0.3], 9.0)]
    )
    assert [list(one) for one in hall.individuals] == [[0.2], [0.1]]
    assert not hall.update([individual([0.4], 2.5)])
    assert [list(one) for one in hall.individuals] == [[0.2], [0.4]]
    assert hall.update([individual([0.5], 1.0)])
    # keys and items correspond as in DEAP, so that its own functions work
    assert [key.values for key in hall.keys] == [(2.0,), (1.0,)]
    hall.insert(individual([0.6], 1.5))
    assert [one.fitness.values for one in hall] == [(1.0,), (1.5,), (2.0,)]
    hall.remove(0)
    assert [one.fitness for one in reversed(hall)] == hall.keys == [one.fitness for one in hall][::-1]
    assert (len(hall), hall[0], hall[-1]) == (2, [0.6], [0.2])


def test_the_front_is_a_pareto_front_of_deap(outcome):
    assert isinstance(outcome.hall, tools.ParetoFront)
    assert [key.values for key in outcome.hall.keys] == [one.fitness.values for one in outcome.hall][::-1]
    front = tools.ParetoFront()
    front.update(list(outcome.hall))
    assert list(front) == list(outcome.hall)
    for one in outcome.hall:
        assert one.fitness.valid
        assert type(one.fitness) is creator.TisimFitness2
        assert one.fitness.weights == (-1.0, -1.0)
    again = pickle.loads(pickle.dumps(outcome.hall))
    assert [one.fitness.values for one in again] == [one.fitness.values for one in outcome.hall]


def test_log_and_report(outcome, tmp_path):
    log = outcome.logbook
    gains, prices = log.select("best gain (1/s)"), log.select("best price")
    assert gains == sorted(gains)
    assert prices == sorted(prices, reverse=True)
    assert log.select("front")[-1] == len(outcome.hall)
    paths = report.write(outcome, tmp_path)
    assert sorted(paths) == [
        "best.csv", "convergence.pdf", "convergence.png", "front.pdf", "front.png",
    ]  # fmt: skip
    with paths["best.csv"].open(encoding="utf-8") as file:
        rows = list(csv.DictReader(file))
    assert [float(row["gain (1/s)"]) for row in rows] == list(values(outcome)[:, 0])
    assert [float(row["price"]) for row in rows] == list(values(outcome)[:, 1])
    (axis,) = front_figure(outcome).axes
    series = {bars.get_label(): bars.lines[0].get_xydata() for bars in axis.containers}
    series |= {line.get_label(): line.get_xydata() for line in axis.get_lines()}
    np.testing.assert_array_equal(series["front, 1 start"], values(outcome))
    assert len(series["other designs, 1 start"]) == len(outcome.estimates) - len(outcome.hall)
    assert axis.get_xlabel() == "gain (1/s), more is better"
    assert imread(paths["front.png"]).std() > 0.01


def test_designs_of_few_starts_are_distinguished_from_well_known_ones(outcome):
    """The front from 9 starts, other designs from 3 and 9."""

    def design(gain, starts):
        individual = Individual([gain, starts / 10], 2)
        of_all = tuple(
            FitnessEstimate(cost, 0.1, cost - 0.05, cost + 0.05, starts, True) for cost in (-gain, 1.0 - gain)
        )
        individual.estimates = of_all
        return individual

    front, precise, lucky = design(0.5, 9), design(0.4, 9), design(0.9, 3)
    front.fitness.values, front.confirmed = (-0.5, 0.5), front.estimates
    other = Outcome(outcome.problem, outcome.settings, {})
    other.hall.fill([front])
    other.estimates = {tuple(individual): individual.estimates for individual in (front, precise, lucky)}
    assert others(other) == ([precise.estimates], [lucky.estimates])
    (axis,) = front_figure(other).axes
    (bars,) = axis.containers
    assert bars.get_label() == "front, run again: 9 starts, 95 % intervals"
    across = bars.lines[2][0].get_segments()[0]
    np.testing.assert_allclose(across, [[0.45, 0.5], [0.55, 0.5]])
    assert any(line.get_label() == "other designs, 9 starts" for line in axis.get_lines())
    front.confirmed = ()
    assert not front_figure(other).axes[0].containers[0].has_xerr
    few = next(line for line in axis.get_lines() if "only 3 starts" in str(line.get_label()))
    assert few.get_xydata().tolist() == [[0.9, 0.09999999999999998]]


@pytest.mark.slow
def test_a_resumed_search_is_the_same(path, tmp_path):
    settings = {"ensemble": EnsembleSettings(max_starts=8, confirm=2), "generations": 2}

    def noisy(design, seed):
        if design["x1"] < 0.2:
            return "lost"
        return zdt1(design, seed, noise=0.02)

    whole = run(tmp_path / "whole.h5", noisy, **settings)
    part = run(path, evaluator=FakeEvaluator(noisy, interrupt_after=200), **settings)
    assert part.interrupted
    again = run(path, noisy, **settings)
    assert again.evaluations == whole.evaluations - 200
    assert [(list(one), repr(one.estimates), repr(one.confirmed)) for one in again.hall] == [
        (list(one), repr(one.estimates), repr(one.confirmed)) for one in whole.hall
    ]
    assert repr(list(again.logbook)) == repr(list(whole.logbook))
    assert verify(path).ok
    assert max(whole.logbook.select("failed")) > 0
    assert all(estimate.starts == 2 for individual in whole.hall for estimate in individual.confirmed)


def test_cache_holds_all_objectives(path):
    many = [
        Record(**{**vars(fake_record(n)), "values": {"gain": n / 3, "price": -1.0}, "ok": n != 3})
        for n in range(8)
    ]
    nothing = {"gain": float("nan"), "price": float("nan")}
    failed = Record(**{**vars(fake_record(9, ok=False)), "values": nothing})
    with Cache(path) as cache:
        for record in many:
            cache.put(record)
        cache.fold()
        cache.put(failed)
        assert [r.values for r in Cache(path).records()[:8]] == [r.values for r in many]
    assert compact(path) == 9
    records = existing(path).records()
    assert [record.payload() for record in records] == [record.payload() for record in (*many, failed)]
    assert verify(path).ok


def test_impossible_values_are_refused(path):
    with pytest.raises(
        InputError,
        match="for several objectives: gaussian-process, genetic, nsga2, random; received 'zohdi'",
    ):
        run(path, method="zohdi")
    with pytest.raises(InputError, match="target must be left out for several objectives; received 1"):
        run(path, target=1.0)
    with pytest.raises(InputError, match=r"method must be one of .*; received 'simplex'"):
        Settings(method="simplex")
    with pytest.raises(InputError, match=r"objectives must be one or more, all different"):
        fake_problem(objective=())
    with pytest.raises(InputError, match=r"objectives must be one or more, all different"):
        fake_problem(objective=OBJECTIVES[:1] * 2)
    with pytest.raises(InputError, match="derived must be empty for several objectives"):
        fake_problem(objective=OBJECTIVES, derived={"twice": lambda x: 2 * x})
    with pytest.raises(InputError, match="met_at must be left out for several objectives"):
        fake_problem(objective=OBJECTIVES, met_at=1.0)


def test_one_maximised_objective(path):
    """The search equals one for the negative objective, and shows the objective itself."""
    large = fake_problem(objective=(Objective("height", lambda r: -r.value, "m", maximise=True),))
    with Cache(path) as cache:
        high = search(large, FakeEvaluator(), cache, Settings(seed=1, generations=3, target=-0.6))
    with Cache(path) as cache:
        low = search(
            fake_problem(name="low"), FakeEvaluator(), cache, Settings(seed=1, generations=3, target=0.6)
        )
    assert [list(one) for one in high.hall] == [list(one) for one in low.hall]
    assert high.logbook.select("best") == [-best for best in low.logbook.select("best")]
    assert (high.stopped, low.stopped) == ("target", "target")
    assert report.best_csv(high).decode().splitlines()[1].split(",")[5].startswith("-0.5")
