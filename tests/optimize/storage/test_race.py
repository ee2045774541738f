"""Races give more starts to competing designs: fewer good ones are lost by chance, within the budget."""

import math

import numpy as np
import pytest
from scipy import stats

from tests.optimize.fake_runs import FakeCache, FakeEvaluator, fake_problem
from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.problem.objective import Objective
from tisim.optimize.search import search
from tisim.optimize.settings import Settings

DESIGNS = [{"x0": x} for x in (0.10, 0.12, 0.5, 0.9)]


def noisy(design, seed, noise=0.1):
    """Noise that is independent for every design and every start."""
    rng = np.random.default_rng([seed, int(1e6 * design["x0"])])
    return design["x0"] + noise * float(rng.normal())


def ensemble(function=noisy, problem=None, budget=None, **settings):
    settings = EnsembleSettings(
        **{"min_starts": 4, "block": 4, "max_starts": 60, "tolerance": 0.9, **settings}
    )
    made = Ensemble(problem or fake_problem(1), FakeEvaluator(function), FakeCache(), settings, 2)
    made.budget = math.inf if budget is None else budget
    return made


def reference(first, second):
    """The paired t test of SciPy: whether the first is significantly lower, two-sided 95 %."""
    test = stats.ttest_rel(second, first)
    return test.statistic > 0 and test.pvalue < 0.05


def test_competing_designs_get_more_starts():
    run = ensemble(race=60)
    assert [e.starts for (e,) in run.estimate(DESIGNS)] == [4] * 4
    raced = [e for (e,) in run.race(DESIGNS)]
    assert run.requested <= 16 + 60
    assert raced[0].starts == raced[1].starts > 16
    assert raced[3].starts == 4, "beaten before the first round"
    for design, estimate in zip(DESIGNS, raced, strict=True):
        values = [noisy(design, start_seed(2, k)) for k in range(estimate.starts)]
        assert estimate.mean == pytest.approx(np.mean(values), rel=1e-12)
    again = run.estimate(DESIGNS)
    assert [e for (e,) in again] == raced, "what is known of a design is not forgotten"


def test_losers_of_the_paired_test_are_out():
    costs = {design["x0"]: [noisy(design, start_seed(2, k), 0.3) for k in range(60)] for design in DESIGNS}
    run = ensemble(lambda design, seed: noisy(design, seed, 0.3), race=1000)
    run.estimate(DESIGNS)
    racing, used = list(costs), dict.fromkeys(costs, 4)
    while True:
        samples = {x: costs[x][: used[x]] for x in racing}
        racing = [x for x in samples if not any(reference(samples[y], samples[x]) for y in samples if y != x)]
        if len(racing) < 2 or used[racing[0]] == 60:
            break
        for x in racing:
            used[x] = min(used[x] + 4, 60)
    assert [e.starts for (e,) in run.race(DESIGNS)] == list(used.values())
    assert len(set(used.values())) > 1


def test_a_race_ends_with_its_share_the_budget_or_max_starts():
    run = ensemble(race=20)
    run.estimate(DESIGNS[:2])
    run.race(DESIGNS[:2])
    assert run.requested == 8 + 16, "a third round of 8 would cost more than 20"
    run = ensemble(race=1000, budget=30)
    run.estimate(DESIGNS[:2])
    run.race(DESIGNS[:2])
    assert run.requested == 24
    run = ensemble(race=1000, max_starts=10)
    run.estimate(DESIGNS[:2])
    assert [e.starts for (e,) in run.race(DESIGNS[:2])] == [10, 10]


def test_failure_in_a_race_fails_the_design():
    late = start_seed(2, 9)

    def function(design, seed):
        return "burst" if seed == late and design["x0"] == 0.10 else noisy(design, seed)

    run = ensemble(function, race=60)
    run.estimate(DESIGNS)
    (first,), (second,), *_ = run.race(DESIGNS)
    assert first.reason == f"start 9 (seed {late}): burst"
    assert second.ok


def test_a_design_is_out_only_when_beaten_in_every_objective():
    def two(design, seed):
        return noisy(design, seed, 0.02), -noisy(design, seed, 0.02), design["x0"] > 0.8

    both = tuple(Objective(f"f{k}", lambda r, k=k: r.value[k]) for k in (0, 1))
    run = ensemble(two, fake_problem(1, objective=both), race=32)
    run.estimate(DESIGNS)
    assert [of_all[0].starts for of_all in run.race(DESIGNS)] == [12] * 4, "a front: none beats another"


def noisy_bowl(design, seed):
    """The noise is as large as the final differences between designs, and independent for every design."""
    x = np.array(list(design.values()))
    own = np.random.default_rng([seed, *(x * 2**32).astype(np.int64).tolist()])
    return float(np.sum((x - 0.3) ** 2) + 0.3 * own.normal())


@pytest.mark.slow
def test_races_make_the_claimed_cost_less_biased_at_equal_evaluations():
    """Compared are the claimed and the true costs of the best of 24 searches of 400 runs each. The true costs
    are alike with and without races (docs/inverse_design.md)."""
    bias = {}
    for race in (0, 16):
        starts = EnsembleSettings(min_starts=2, block=2, max_starts=40, tolerance=0.9, race=race)
        errors = []
        for seed in range(24):
            settings = Settings(
                seed=seed, method="nsga2", generations=99, max_evaluations=400, ensemble=starts
            )
            outcome = search(fake_problem(3), FakeEvaluator(noisy_bowl), FakeCache(), settings)
            # Less than a block and a half of starts is left over.
            assert 397 <= outcome.evaluations <= 400
            true = np.sum((np.array(outcome.best) - 0.3) ** 2)
            errors.append(outcome.hall[0].estimates[0].mean - true)
        bias[race] = np.mean(errors)
    assert bias[0] < -0.05, "the best of noisy values"
    assert abs(bias[16]) < 0.5 * abs(bias[0])
