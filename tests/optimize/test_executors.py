"""The same results, bit for bit, wherever runs are made; a killed worker costs time and nothing else."""

import concurrent.futures as cf
import contextlib
import os
import signal
import subprocess
import sys
import time
from contextlib import closing
from pathlib import Path

import numpy as np
import pytest
from cache_files import worker
from drift_case import problem, scene

from optimize import executors
from optimize.cache import Cache, verify
from optimize.evaluator import Evaluator
from optimize.executors import remote
from optimize.executors.remote import Remote, units
from optimize.executors.worker import Wanted, run
from optimize.search import search
from optimize.settings import Settings
from tisim import Cloud, runtime
from tisim.effects.impact import Impact
from tisim.errors import InputError, RunError

SCENES = [scene({"speed": 3.0 + k, "rise": 5.0}, seed=k) for k in range(9)]
LONG = [s.model_copy(update={"duration": 150.0}) for s in SCENES]
"""The same for 150,000 steps: seconds rather than milliseconds."""
CROWDED = SCENES[0].model_copy(update={"particles": Cloud(number=4, radius=0.2, density=1.0)})
"""Cannot be packed."""


@pytest.fixture(scope="module")
def cluster():
    """A real Dask cluster of two processes."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(2, threads_per_worker=1, processes=True, dashboard_address=None) as made:
        yield made


@pytest.fixture(scope="module", params=["processes", "dask"])
def away(request):
    """An evaluator in other processes, and how to know their ids."""
    if request.param == "dask":
        cluster = request.getfixturevalue("cluster")
        evaluator = executors.made(f"dask://{cluster.scheduler_address.removeprefix('tcp://')}")
        pids = lambda: list(evaluator.pool._client.run(os.getpid).values())  # noqa: E731
    else:
        evaluator = executors.made("processes:2")
        pids = lambda: [child.pid for child in evaluator.pool._children if child.is_alive()]  # noqa: E731
    with closing(evaluator):
        yield evaluator, pids


@pytest.fixture(scope="module")
def here():
    """Results of this process."""
    with closing(Evaluator()) as evaluator:
        return dict(evaluator.evaluate([*SCENES, CROWDED])), dict(evaluator.evaluate(LONG))


def same(results, others):
    assert sorted(results) == sorted(others)
    for index, result in results.items():
        other = others[index]
        assert result.status == other.status
        assert (result.time, result.work, result.measures) == (other.time, other.work, other.measures)
        assert result.scene == other.scene
        assert set(result.state) == set(other.state)
        for name in result.state:
            np.testing.assert_array_equal(result.state[name], other.state[name])


@pytest.mark.long
def test_results_are_those_of_one_process_to_the_bit_and_so_are_failures(away, here):
    evaluator, pids = away
    seen = []
    found = list(evaluator.evaluate([*SCENES, CROWDED], seen.append))
    assert len(found) == 10, "each once"
    same(dict(found), here[0])
    assert not dict(found)[9].status.ok
    assert seen == sorted(seen)
    assert seen[-1] == 1.0
    assert len(pids()) == 2
    assert os.getpid() not in pids()
    assert evaluator.settings == {**runtime.current().settings, "backend": runtime.backend()}


@pytest.mark.long
def test_killed_worker_loses_nothing(away, here):
    evaluator, pids = away
    dict(evaluator.evaluate(SCENES))  # all have started and compiled
    killed, found = [], []

    def progress(fraction):
        if not killed:
            killed.append(pids()[0])
            os.kill(killed[0], signal.SIGKILL)

    for pair in evaluator.evaluate(LONG, progress):
        found.append(pair)
    assert killed
    assert killed[0] not in pids()
    assert sorted(index for index, _ in found) == list(range(9)), "each once"
    same(dict(found), here[1])


@pytest.mark.slow
@pytest.mark.parametrize("away", ["dask"], indirect=True)
def test_search_is_the_same_though_a_worker_is_killed(away, tmp_path):
    evaluator, pids = away
    settings = Settings(seed=2, generations=2, options={"population": 8, "parents": 2})

    def found(path, runner, on_progress=None):
        with Cache(path) as cache:
            outcome = search(problem("default", ""), runner, cache, settings, on_progress=on_progress)
        kept = {record.key: (record.fitness, record.seed) for record in Cache(path).records()}
        return outcome, kept

    def kill(where):
        if where.evaluations == 20:
            os.kill(pids()[-1], signal.SIGKILL)

    there, kept = found(tmp_path / "there.h5", evaluator, kill)
    with closing(Evaluator()) as local:
        here, expected = found(tmp_path / "here.h5", local)
    assert kept == expected
    assert there.evaluations == here.evaluations == len(kept)
    assert repr(list(there.logbook)) == repr(list(here.logbook))
    assert [list(s) for s in there.hall] == [list(s) for s in here.hall]
    report = verify(tmp_path / "there.h5")
    assert (report.ok, report.duplicates) == (True, 0)


@pytest.mark.long
def test_stopped_it_leaves_no_process(monkeypatch):
    evaluator = executors.made("processes:2")
    with closing(evaluator):
        dict(evaluator.evaluate(SCENES))
        children = list(evaluator.pool._children)

        def ctrl_c(fraction):
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            list(evaluator.evaluate([s.model_copy(update={"duration": 1e6}) for s in SCENES], ctrl_c))
        assert all(child.is_alive() for child in children)
    assert len(children) == 2
    assert not any(child.is_alive() for child in children)


class Doomed:
    """Workers that die of everything."""

    workers = 2

    def __init__(self):
        self.sent = 0

    def submit(self, scenes, wanted):
        self.sent += 1
        future = cf.Future()
        future.set_result([])
        return future

    def outcome(self, future):
        raise remote.Lost("killed")


def test_workers_that_die_of_everything_end_the_search():
    doomed = Doomed()
    with pytest.raises(RunError, match=r"lost 3 times in a row, with nothing finished \(killed\)"):
        list(Remote(doomed, Wanted()).evaluate(SCENES))
    assert doomed.sent == 3 * len(units(SCENES, 2))


def test_units_of_work():
    other = [s.model_copy(update={"effects": (Impact(hardness=2e5),)}) for s in SCENES[:3]]
    cut = units([*SCENES[:4], *other, *SCENES[4:]], 2)
    assert sorted(k for unit in cut for k in unit) == list(range(12))
    assert max(map(len, cut)) == 3
    assert all(len({(k in (4, 5, 6)) for k in unit}) == 1 for unit in cut), "one structure each"
    assert units(SCENES, 100) == [[k] for k in range(9)]
    assert units([], 2) == []


@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("threads:2", "executor must be batch, processes:N or dask://HOST:PORT; received 'threads:2'"),
        ("processes:0", "executor must be processes:N with N >= 1; received 'processes:0'"),
        ("processes:two", "executor must be processes:N with N >= 1; received 'processes:two'"),
        ("batch:2", "executor must be batch, processes:N or dask"),
        ("dask:localhost", "executor must be batch, processes:N or dask"),
    ],
)
def test_unknown_executors_are_refused(name, message):
    with pytest.raises(InputError, match=message):
        executors.made(name)
    with pytest.raises(InputError, match="precision must be"):
        executors.made("processes:2", precision="f16")


def test_nobody_at_the_address(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("optimize.executors.dask_cluster.CONNECT_S", 0.3)
    with pytest.raises(InputError, match="must be the address of a running Dask scheduler; received '127"):
        executors.made("dask://127.0.0.1:9")


def test_dask_is_optional(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"one that is installed \(pip install 'tisim\[dask\]'\)"):
        executors.made("dask://127.0.0.1:9")


def test_worker_with_another_compiler_is_refused():
    with pytest.raises(InputError, match=r"compiler of a worker must be other 1\.0\.0; received"):
        run(SCENES, Wanted(backend="other 1.0.0"), 1)


def alive(group):
    """Command lines of the processes of a group that have not ended."""
    found = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, of = status.read_text().rpartition(")")[2].split()[:3]
            if int(of) == group and state != "Z":
                found.append(status.with_name("cmdline").read_text())
    return found


@pytest.mark.slow
def test_ctrl_c_of_the_terminal_stops_the_command_and_all_its_workers(tmp_path):
    """SIGINT to the whole group, as a terminal sends it."""
    command = ("optimize", "drift", "--generations", "5000")
    folder = tmp_path / "s"
    with worker(
        "tisim", *command, "--executor", "processes:2", "--out", folder,
        stderr=subprocess.PIPE, start_new_session=True,
    ) as process:  # fmt: skip
        for line in process.stderr:
            if line.startswith("generation   1"):
                break
        os.killpg(process.pid, signal.SIGINT)
        _, err = process.communicate(timeout=60)
    assert process.returncode == 130
    assert "To go on, give the same command again" in " ".join(err.split())
    assert "Traceback" not in err
    ends = time.monotonic() + 10
    while (left := alive(process.pid)) and time.monotonic() < ends:
        time.sleep(0.1)  # Python's resource tracker goes when its parent has
    assert not left
    assert verify(folder / "search.h5").ok
