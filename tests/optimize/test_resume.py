import random

import pytest

from tests.optimize.cache_files import PIPE, worker
from tests.optimize.fake_runs import FakeEvaluator, fake_problem
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.maintenance import verify

SETTINGS = Settings(seed=2, generations=4, ensemble={"min_starts": 8})


def run(path, evaluator):
    with Cache(path) as cache:
        return search(fake_problem(3), evaluator, cache, SETTINGS)


def contents_of(outcome):
    return repr(list(outcome.logbook)), [(list(one), repr(one.estimates)) for one in outcome.hall]


@pytest.fixture(scope="module")
def uninterrupted(tmp_path_factory):
    return run(tmp_path_factory.mktemp("whole") / "cache.h5", FakeEvaluator())


@pytest.mark.parametrize("after", [0, 1, 30, 200, 400])
def test_resume_after_interrupt_equals_never_interrupted(path, uninterrupted, after):
    first = FakeEvaluator(interrupt_after=after)
    part = run(path, first)
    assert (part.stopped, part.interrupted) == ("interrupted", True)
    assert len(first.digests) == part.evaluations == after
    assert list(part.logbook) == list(uninterrupted.logbook)[: len(part.logbook)]
    assert Cache(path).table(part.name).attrs["stopped"] == "interrupted"
    second = FakeEvaluator()
    whole = run(path, second)
    assert contents_of(whole) == contents_of(uninterrupted)
    assert (whole.stopped, whole.interrupted) == ("generations", False)
    assert not set(first.digests) & set(second.digests), "nothing is evaluated twice"
    assert len(first.digests) + len(second.digests) == uninterrupted.evaluations


def test_resume_after_sigkill_equals_never_interrupted(path, uninterrupted):
    rng = random.Random(3)
    counts = []
    for _ in range(2):
        with worker("search", path, pipesize=PIPE) as process:
            for _ in range(rng.randint(1, 60)):
                assert process.stdout.readline().startswith("stored")
            process.kill()
        counts.append(len(Cache(path)))
        assert verify(path).ok
    assert counts == sorted(counts)
    assert 0 < counts[-1] < uninterrupted.evaluations
    evaluator = FakeEvaluator()
    outcome = run(path, evaluator)
    assert contents_of(outcome) == contents_of(uninterrupted)
    assert len(evaluator.digests) == uninterrupted.evaluations - counts[-1]
    assert verify(path).duplicates == 0
