import itertools
import json
import math
import random

import numpy as np
import pytest

from tests.optimize.fake_runs import FakeEvaluator, bowl, fake_problem
from tisim import InputError, RunError
from tisim.optimize.evaluation.ensemble import FRESH
from tisim.optimize.evaluation.ensemble_settings import EnsembleSettings
from tisim.optimize.evaluation.runs import start_seed
from tisim.optimize.methods.operators import GeneticOperator
from tisim.optimize.search import search
from tisim.optimize.search_records import searches
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.maintenance import verify

ONE = EnsembleSettings(min_starts=1, select=0, confirm=0)  # a function without noise needs no averaging
DEAP_OPTIONS = {
    "surrogate": False,
    "mate": GeneticOperator(name="cxSimulatedBinaryBounded", options={"eta": 10.0}),
    "mutate": GeneticOperator(name="mutPolynomialBounded", options={"eta": 20.0, "indpb": 0.3}),
}
DEAP = {"method": "genetic", "options": DEAP_OPTIONS}


def quiet_bowl(design, seed):
    return bowl(design, seed, noise=0.0)


def run(path, evaluator=None, genes=4, problem=None, callbacks=None, **settings):
    evaluator = evaluator or FakeEvaluator(quiet_bowl)
    values = {"seed": 1, "method": "zohdi", "ensemble": ONE, **settings}
    with Cache(path) as cache:
        return search(
            problem or fake_problem(genes), evaluator, cache, Settings(**values), **(callbacks or {})
        )


@pytest.mark.parametrize("settings", [{}, pytest.param(DEAP, marks=pytest.mark.slow)], ids=["z04", "deap"])
def test_beats_random_search_at_equal_evaluations(tmp_path, settings):
    """In 10 dimensions with three seeds the median best is far below an equal number of random points."""
    best, chance = [], []
    for seed in range(3):
        outcome = run(tmp_path / f"{seed}.h5", genes=10, seed=seed, **settings)
        requested = sum(outcome.logbook.select("starts"))
        assert 300 < requested <= 20 * 26  # individuals that are bred twice are not run twice
        points = np.random.default_rng(seed).random((requested, 10))
        best.append(outcome.best.estimates[0].mean - 0.5)
        chance.append(np.sum((points - 0.3) ** 2, axis=1).min())
    assert np.median(best) < np.median(chance) / 5
    assert max(best) < min(chance)


def test_log_of_a_search(path):
    outcome = run(path, generations=12)
    log = outcome.logbook
    assert (outcome.stopped, outcome.interrupted) == ("generations", False)
    assert log.select("gen") == list(range(13))
    assert log.select("designs") == [20] + [14] * 12  # parents are never evaluated again
    best = log.select("best")
    assert all(later <= earlier for earlier, later in itertools.pairwise(best))
    assert best[-1] < best[0]
    assert [g for g, moved in zip(log.select("gen"), log.select("recentred"), strict=True) if moved] == [
        4,
        8,
        12,
    ]
    np.testing.assert_allclose(log.select("box"), [1.0] * 5 + [0.5] * 4 + [0.25] * 4)
    assert [one.fitness.values[0] for one in outcome.hall] == sorted(
        one.fitness.values[0] for one in outcome.hall
    )
    assert outcome.best.estimates[0].mean == min(best) == outcome.hall[0].fitness.values[0]
    assert len({tuple(one) for one in outcome.hall}) == 6


@pytest.mark.parametrize("settings", [{}, DEAP], ids=["z04", "deap"])
def test_seed_decides_everything_and_nothing_global_does(tmp_path, settings):
    def result(file, seed):
        outcome = run(tmp_path / file, generations=3, seed=seed, ensemble=EnsembleSettings(), **settings)
        return repr(list(outcome.logbook)), [list(one) for one in outcome.hall]

    random.seed(1)
    state = random.getstate()
    first = result("a.h5", 1)
    assert random.getstate() == state
    random.seed(2)
    assert result("b.h5", 1) == first
    assert result("c.h5", 2) != first


def test_stopping_rules(tmp_path):
    full = run(tmp_path / "full.h5", generations=20)
    best = full.logbook.select("best")
    target = best[7]
    outcome = run(tmp_path / "t.h5", generations=20, target=target)
    assert outcome.stopped == "target"
    assert outcome.logbook.select("best") == best[: best.index(target) + 1]
    outcome = run(tmp_path / "e.h5", generations=20, max_evaluations=60)
    assert (outcome.stopped, outcome.evaluations) == ("evaluations", 60)
    again = run(tmp_path / "e.h5", generations=20, max_evaluations=60)
    assert (again.stopped, again.evaluations, again.hits) == ("evaluations", 0, 60)
    outcome = run(tmp_path / "p.h5", FakeEvaluator(lambda design, seed: 1.0), generations=20, patience=3)
    assert (outcome.stopped, len(outcome.logbook)) == ("patience", 4)
    assert run(tmp_path / "g.h5", generations=0).logbook.select("designs") == [20]


def test_wall_clock_stops_in_the_middle_of_a_generation(path):
    evaluator = FakeEvaluator(quiet_bowl, delay=0.02)
    outcome = run(path, evaluator, wall_clock_s=0.3, ensemble=EnsembleSettings(min_starts=6))
    assert outcome.stopped == "wall clock"
    assert outcome.elapsed_s >= 0.3
    assert len(outcome.logbook) == 0
    assert outcome.best is None
    assert 0 < len(evaluator.digests) <= 16 < 20 * 6
    assert len(evaluator.digests) == len(Cache(path)) == outcome.evaluations


def test_wall_clock_stops_between_generations(path):
    outcome = run(path, generations=10_000, wall_clock_s=1.0, ensemble=ONE.model_copy(update={"confirm": 4}))
    assert outcome.stopped == "wall clock"
    assert outcome.best.confirmed == ()
    assert 0 < len(outcome.logbook) < 10_000
    assert outcome.best.estimates[0].mean == min(outcome.logbook.select("best"))


def test_failures_never_win(path):
    def function(design, seed):
        if design["x0"] < 0.35:  # the minimum lies here
            return ("collapsed", math.nan, -math.inf)[seed % 3]
        return quiet_bowl(design, seed)

    outcome = run(path, FakeEvaluator(function), generations=8)
    assert min(outcome.logbook.select("failed")) >= 0
    assert max(outcome.logbook.select("failed")) > 0
    assert outcome.best.estimates[0].ok
    assert all(math.isfinite(one.estimates[0].mean) and one[0] >= 0.35 for one in outcome.hall)
    assert np.all(np.isfinite(outcome.logbook.select("mean")))


def test_all_failed_is_an_outcome_without_a_best(path):
    outcome = run(path, FakeEvaluator(lambda design, seed: "broken"), generations=1)
    assert outcome.best is None
    assert outcome.logbook.select("failed") == [20] * 2
    assert outcome.logbook.select("recentred") == [False] * 2
    assert outcome.logbook.select("best") == [math.inf] * 2


def test_callbacks_report_the_progress_of_the_search(path):
    generations, steps = [], []
    callbacks = {"on_generation": generations.append, "on_progress": steps.append}
    outcome = run(path, callbacks=callbacks, generations=3)
    assert [p.generation for p in generations] == [0, 1, 2, 3]
    assert [p.best[0] for p in generations] == outcome.logbook.select("best")
    assert [p.evaluations for p in generations] == [20, 34, 48, 62]
    assert generations[-1].best_design == outcome.problem.genome.decode(outcome.best)
    assert generations[-1].fraction == 1.0
    for number in range(4):
        fractions = [p.fraction for p in steps if p.generation == number]
        assert fractions == sorted(fractions)
        assert fractions[-1] == 1.0
        assert len(set(fractions)) >= 14
    assert steps[0].best_design is None
    again = []
    run(path, callbacks={"on_generation": again.append}, generations=3)
    assert [(p.evaluations, p.hits) for p in again] == [(0, 20), (0, 34), (0, 48), (0, 62)]


def test_the_file_contains_the_settings_of_the_search(path):
    outcome = run(path, generations=4, **DEAP)
    cache = Cache(path)
    about = cache.table(outcome.name).attrs
    settings = Settings.model_validate_json(about["settings"])
    assert settings == outcome.settings
    made_of = json.loads(about["identity"])
    assert (made_of["problem"], made_of["problem_version"]) == ("bowl", 1)
    assert made_of["evaluator"] == {"precision": "f64", "device": "cpu"}
    assert {"python", "numpy", "deap", "h5py"} <= set(json.loads(about["versions"]))
    assert about["stopped"] == "generations"
    assert cache.table(f"{outcome.name}/logbook").columns["best"] == outcome.logbook.select("best")
    hall = cache.table(f"{outcome.name}/hall_of_fame").columns
    assert hall["fitness"] == [one.estimates[0].mean for one in outcome.hall]
    assert hall["x0 (m)"] == [one[0] for one in outcome.hall]
    with Cache(path) as cache:
        redone = search(fake_problem(), FakeEvaluator(quiet_bowl), cache, settings)
    assert (redone.evaluations, list(redone.logbook), redone.name) == (0, list(outcome.logbook), outcome.name)
    assert verify(path).ok


def test_longer_search_continues_a_shorter_one(path):
    short = run(path, generations=3)
    longer = run(path, generations=6)
    assert longer.name == short.name
    assert list(longer.logbook)[:4] == list(short.logbook)
    assert longer.evaluations == 3 * 14
    assert run(path, generations=6, seed=2).name != short.name
    noisy = FakeEvaluator(bowl)
    first = run(path, noisy, generations=6, seed=3)
    confirmed = run(path, noisy, generations=6, seed=3, ensemble=ONE.model_copy(update={"confirm": 2}))
    assert (confirmed.name, confirmed.evaluations) == (first.name, 2 + 6 * 2), (
        "a look at two designs, and fresh"
    )


def test_the_file_belongs_to_the_search_before_the_first_run(path):
    outcome = run(path, FakeEvaluator(interrupt_after=0))
    assert Cache(path).table(outcome.name).attrs["stopped"] == "interrupted"
    with pytest.raises(RunError, match="in the middle"):
        run(path, FakeEvaluator(_fail), seed=2)
    assert len(searches(Cache(path))) == 2


def test_best_designs_are_reported_from_held_out_seeds(path):
    """After the search the candidates get further starts, by which the best are chosen, and then held-out
    seeds."""
    settings = EnsembleSettings(min_starts=3, select=5, confirm=10)
    evaluator = FakeEvaluator(lambda design, seed: bowl(design, seed + int(1e9 * design["x0"]), noise=0.3))
    outcome = run(path, evaluator, generations=3, ensemble=settings)
    designs = [outcome.problem.genome.decode(individual) for individual in outcome.hall]
    fresh = [[start_seed(1, FRESH + k, design) for k in range(10)] for design in designs]
    *before, more, last = evaluator.calls
    assert {scene.seed for call in before for scene in call} == {start_seed(1, k) for k in range(3)}
    assert {scene.seed for scene in more} == {start_seed(1, k) for k in range(3, 8)}
    assert {scene.seed for scene in last} == {seed for seeds in fresh for seed in seeds}
    for individual, design, seeds in zip(outcome.hall, designs, fresh, strict=True):
        values = [evaluator.function(design, seed) for seed in seeds]
        assert individual.confirmed[0].starts == 10
        assert individual.confirmed[0].mean == pytest.approx(np.mean(values), rel=1e-12)
        assert individual.estimates[0].starts in (3, 8)
    columns = Cache(path).table(f"{outcome.name}/hall_of_fame").columns
    assert columns["fitness, fresh starts"] == [individual.confirmed[0].mean for individual in outcome.hall]
    assert columns["95 % low, fresh starts"] == [individual.confirmed[0].low for individual in outcome.hall]


@pytest.mark.parametrize("budget", [60, 200, 600])
def test_the_budget_includes_the_held_out_seeds(tmp_path, budget):
    outcome = run(
        tmp_path / "b.h5", FakeEvaluator(bowl), generations=1000, max_evaluations=budget, ensemble={}
    )
    assert budget - 16 < outcome.evaluations <= budget
    assert all(individual.confirmed for individual in outcome.hall)


def test_a_search_stops_at_a_target_only_with_confidence(tmp_path):
    """With noise 0.3 many means of two starts are below 0.5, the true minimum, but no true cost is below
    0.5."""
    evaluator = FakeEvaluator(lambda design, seed: bowl(design, seed + int(1e9 * design["x0"]), noise=0.3))
    few = {"options": {"population": 12, "parents": 4}, "ensemble": {}}
    never = run(tmp_path / "a.h5", evaluator, generations=4, target=0.49, **few)
    assert min(never.logbook.select("best")) < 0.45
    assert never.stopped == "generations"
    met = run(tmp_path / "b.h5", evaluator, generations=30, target=0.9, **few)
    assert met.stopped == "target"
    assert all(individual.confirmed for individual in met.hall)
    assert met.hall[0].confirmed[0].mean < 0.9


def test_a_function_without_noise_is_run_once(tmp_path):
    outcome = run(tmp_path / "a.h5", generations=5, ensemble={})
    assert {individual.estimates[0].starts for individual in outcome.hall} == {1}
    assert outcome.evaluations == sum(outcome.logbook.select("designs")) + 2
    assert outcome.designs[0].intervals["fitness"] == (outcome.designs[0].values["fitness"],) * 2


def test_equal_runs_leave_an_interval_for_rare_outcomes(tmp_path):
    """A few equal runs do not exclude other outcomes, and neither do many runs with two common starts."""
    evaluator = FakeEvaluator(quiet_bowl, leaves_state=False)
    for runs, common in ((40, False), (200, True)):
        settings = {"max_evaluations": runs, "ensemble": {"common_starts": common}}
        outcome = run(tmp_path / f"{runs}.h5", evaluator, **settings)
        (low, high), value = outcome.designs[0].intervals["fitness"], outcome.designs[0].values["fitness"]
        assert low < value < high


def test_unfit_operators_are_refused_before_anything_runs(path):
    evaluator = FakeEvaluator()
    with pytest.raises(InputError, match="fit for real-valued individuals"):
        run(path, evaluator, method="genetic", options={"mate": GeneticOperator(name="cxOrdered")})
    assert evaluator.digests == []


def test_full_disk_ends_the_search_clearly(path, monkeypatch):
    class Filling(FakeEvaluator):
        def evaluate(self, scenes, progress):
            for number, pair in enumerate(super().evaluate(scenes, progress)):
                if number == 5:
                    monkeypatch.setattr("tisim.files.atomic.os.pwrite", _full)
                yield pair

    with pytest.raises(RunError, match="could not be written: No space left on device"):
        run(path, Filling(quiet_bowl))
    monkeypatch.undo()
    assert len(Cache(path)) == 5


def _fail(design, seed):
    raise RunError("in the middle of it all")


def _full(handle, data, offset):
    raise OSError(28, "No space left on device")


def test_designs_that_fail_from_further_starts_are_not_reported(tmp_path):
    """One start in three fails, so every design fails in one of the starts used to choose the best."""

    def function(design, seed):
        return "lost" if (seed + int(1e9 * design["x0"])) % 3 == 0 else bowl(design, seed, noise=0.01)

    outcome = run(tmp_path / "a.h5", FakeEvaluator(function), generations=1, ensemble={"min_starts": 1})
    assert outcome.logbook.select("failed")[0] < 20
    assert all(math.isfinite(individual.fitness.values[0]) for individual in outcome.hall)
    assert all(not individual.failed for individual in outcome.hall)
    assert not set(outcome.estimates) & set(outcome.failures)
