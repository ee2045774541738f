import math

import numpy as np
import pytest

from tests.optimize.fake_runs import FakeEvaluator, FakeScene, fake_problem
from tisim import InputError, RunError
from tisim.numerics.skewed import interval
from tisim.optimize.evaluation.ensemble import Ensemble
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.evaluation.estimate import converged_after
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache

DESIGNS = [{"x0": 0.1, "x1": 0.2}, {"x0": 0.9, "x1": 0.2}, {"x0": 0.5, "x1": 0.5}]


def ensemble(tmp_path, evaluator, problem=None, seed=4, **settings):
    cache = Cache(tmp_path / "cache.h5")
    return Ensemble(problem or fake_problem(2), evaluator, cache, EnsembleSettings(**settings), seed)


def reference(values, tolerance, min_starts):
    """Z04 Eq. (8.1), written out literally."""
    for e in range(1, len(values)):
        now, before = np.mean(values[: e + 1]), np.mean(values[:e])
        if e + 1 >= min_starts and (abs(now - before) < tolerance * abs(now) or now == before):
            return e + 1
    return None


def test_the_ensemble_converges_like_its_reference():
    rng = np.random.default_rng(0)
    counts = set()
    for _ in range(500):
        values = rng.normal(1.0, rng.uniform(0.001, 0.3), 40)
        tolerance, least = rng.choice([5e-4, 5e-3, 0.05]), int(rng.integers(1, 8))
        means = np.cumsum(values) / np.arange(1, 41)
        assert converged_after(means, tolerance, least) == reference(values, tolerance, least)
        counts.add(converged_after(means, tolerance, least))
    assert len(counts) > 10
    assert converged_after([0.0, 0.0], 1e-3, 2) == 2
    assert converged_after([1.0], 1e-3, 1) is None


@pytest.mark.parametrize("block", [1, 3, 6, 50])
def test_the_estimate_is_the_mean_up_to_convergence_for_any_block_size(tmp_path, block):
    evaluator = FakeEvaluator()
    result = ensemble(tmp_path, evaluator, block=block, tolerance=2e-3, min_starts=3, max_starts=60).estimate(
        DESIGNS
    )
    for design, (estimate,) in zip(DESIGNS, result, strict=True):
        values = [evaluator.function(design, start_seed(4, k)) for k in range(60)]
        n = reference(values, 2e-3, 3)
        assert (estimate.starts, estimate.converged) == (n, True)
        assert estimate.mean == pytest.approx(np.mean(values[:n]), rel=1e-14)
        assert estimate.std == pytest.approx(np.std(values[:n], ddof=1), rel=1e-12)
        assert estimate.standard_error == pytest.approx(estimate.std / math.sqrt(n), rel=1e-12)
        assert (estimate.low, estimate.high) == interval(values[:n])


def test_one_call_for_all_designs_then_only_those_not_converged(tmp_path):
    def function(design, seed):
        return 1.0 if design["x0"] < 0.3 else float(np.random.default_rng(seed).normal(1.0, 0.5))

    evaluator = FakeEvaluator(function)
    result = ensemble(tmp_path, evaluator, block=4, min_starts=4, max_starts=10, tolerance=1e-9).estimate(
        DESIGNS
    )
    look, *calls = evaluator.calls
    assert {(s.design["x0"], s.seed) for s in look} == {
        (x, start_seed(4, k)) for x in (0.1, 0.9) for k in (0, 1)
    }
    assert [len(call) for call in calls] == [12 - 4, 8, 4]
    assert {scene.design["x0"] for scene in calls[1]} == {0.9, 0.5}
    assert [(e.starts, e.converged) for (e,) in result] == [(4, True), (10, False), (10, False)]


def test_common_random_numbers(tmp_path):
    def seeds(common, file):
        evaluator = FakeEvaluator()
        ensemble(tmp_path / file, evaluator, common_starts=common, min_starts=6).estimate(DESIGNS)
        scenes = [scene for call in evaluator.calls for scene in call]
        return [{s.seed for s in scenes if s.design == design} for design in DESIGNS]

    common, own = seeds(True, "common"), seeds(False, "own")
    assert common[0] == common[1] == common[2] == {start_seed(4, k) for k in range(6)}
    assert len(own[0] | own[1] | own[2]) == 18
    assert own == seeds(False, "again")
    assert start_seed(4, 0) != start_seed(5, 0)


@pytest.mark.parametrize(
    ("bad", "reason"),
    [
        (math.nan, "objective is nan"),
        (math.inf, "objective is inf"),
        (-math.inf, "objective is -inf"),
        ("diverged at 1e-3 s in impact", "diverged at 1e-3 s in impact"),
    ],
)
def test_a_failed_start_never_wins_and_is_recorded(tmp_path, bad, reason):
    third = start_seed(4, 2)

    def function(design, seed):
        return bad if design["x0"] == 0.9 and seed == third else 1.0

    evaluator = FakeEvaluator(function, leaves_state=False)
    run = ensemble(tmp_path, evaluator, min_starts=6)
    (good,), (failed,), _ = run.estimate(DESIGNS)
    assert good.mean == 1.0
    assert failed.mean == math.inf
    assert not failed.ok
    assert failed.reason == f"start 2 (seed {third}): {reason}"
    failures = [record for record in run.runs.cache.records() if not record.ok]
    assert [(record.reason, record.seed, math.isnan(record.values["fitness"])) for record in failures] == [
        (reason, third, True)
    ]
    again = FakeEvaluator(function)
    assert repr(ensemble(tmp_path, again, min_starts=6).estimate(DESIGNS)[1]) == repr((failed,))
    assert again.digests == []


def test_infeasible_design_fails_alone(tmp_path):
    def scene(design, seed):
        if design["x0"] == 0.9:
            raise InputError("packing must be below 0.74; received 0.9")
        return FakeScene(design, seed)

    result = ensemble(tmp_path, FakeEvaluator(), fake_problem(2, scene=scene)).estimate(DESIGNS)
    assert [estimate.ok for (estimate,) in result] == [True, False, True]
    assert result[1][0].mean == math.inf
    assert result[1][0].reason == "infeasible: packing must be below 0.74; received 0.9"


def test_nothing_is_evaluated_twice(tmp_path):
    evaluator = FakeEvaluator()
    run = ensemble(tmp_path, evaluator)
    first = run.estimate([*DESIGNS, DESIGNS[0]])
    assert first[3] == first[0]
    assert len(evaluator.digests) == len(set(evaluator.digests)) == run.requested
    assert run.runs.hits == 0
    other = FakeEvaluator()
    again = ensemble(tmp_path, other)
    assert again.estimate([*DESIGNS, DESIGNS[0]]) == first
    assert (other.digests, again.runs.evaluations, again.runs.hits) == ([], 0, run.requested)


@pytest.mark.parametrize("change", ["precision", "problem", "version"])
def test_changed_problems_do_not_reuse_fitness_values(tmp_path, change):
    ensemble(tmp_path, FakeEvaluator()).estimate(DESIGNS)
    evaluator = FakeEvaluator()
    problem = fake_problem(2, **{"problem": {"name": "dish"}, "version": {"version": 2}}.get(change, {}))
    if change == "precision":
        evaluator.settings["precision"] = "f32"
    run = ensemble(tmp_path, evaluator, problem)
    run.estimate(DESIGNS)
    assert (run.runs.hits, run.runs.evaluations > 0) == (0, True)


def test_progress_rises_to_one(tmp_path):
    fractions = []
    ensemble(tmp_path, FakeEvaluator(), block=2, min_starts=2, tolerance=1e-4).estimate(
        DESIGNS, fractions.append
    )
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert len(set(fractions)) > 10
    assert max(fractions[:-1]) <= 1.0 + 1e-12


def test_finished_evaluations_are_stored_before_the_rest_runs(tmp_path):
    run = ensemble(tmp_path, FakeEvaluator(interrupt_after=7), min_starts=4)
    with pytest.raises(KeyboardInterrupt):
        run.estimate(DESIGNS)
    assert len(Cache(tmp_path / "cache.h5")) == 7


def test_an_evaluator_that_forgets_a_scene_is_detected(tmp_path):
    class Forgetful(FakeEvaluator):
        def evaluate(self, scenes, progress):
            return (pair for pair in super().evaluate(scenes, progress) if pair[0] != 1)

    with pytest.raises(RunError, match="every scene"):
        ensemble(tmp_path, Forgetful()).estimate(DESIGNS)


def test_settings_are_checked():
    with pytest.raises(InputError, match="min_starts must be <= max_starts = 3; received 4"):
        EnsembleSettings(min_starts=4, max_starts=3)
    with pytest.raises(
        InputError, match=r"search\.ensemble\.tolerance must be greater than 0\.0; received 0"
    ):
        EnsembleSettings(tolerance=0)
    with pytest.raises(
        InputError,
        match=r"^search\.ensemble\.blok must be a known key: .*; received 2; did you mean 'block'\?$",
    ):
        Settings(ensemble={"blok": 2})
    with pytest.raises(InputError, match=r"^search\.ensemble must be a valid dictionary .*; received 3$"):
        Settings(ensemble=3)
