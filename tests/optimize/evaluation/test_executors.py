"""All executors give the same bits; a killed worker costs time and nothing else."""

import concurrent.futures as cf
import contextlib
import json
import os
import re
import shutil
import signal
import subprocess
import sys
import time
from contextlib import closing
from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import pytest

from tests.compare import same_result
from tests.optimize.cache_files import worker
from tests.optimize.drift_case import problem, scene
from tests.optimize.evaluation import light_worker
from tests.own_files import LAW
from tisim import Cloud, InputError, RunError, Scene, __version__
from tisim.backend import runtime
from tisim.effects import Impact
from tisim.files import python_file
from tisim.optimize.evaluation import executors
from tisim.optimize.evaluation.evaluator import BatchEvaluator
from tisim.optimize.evaluation.executors import dask_cluster, handshake
from tisim.optimize.evaluation.executors import worker as working
from tisim.optimize.evaluation.executors.processes import Processes
from tisim.optimize.evaluation.executors.remote import Lost, Remote, units
from tisim.optimize.evaluation.executors.worker import Answer, WorkerSettings
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.optimize.storage.maintenance import verify

ROOT = Path(__file__).parents[3]
SCENES = [scene({"speed": 3.0 + k, "rise": 5.0}, seed=k) for k in range(9)]
LONG = [s.model_copy(update={"duration": 150.0}) for s in SCENES]
"""The same scenes with 150,000 steps, which take seconds instead of milliseconds."""
CROWDED = SCENES[0].model_copy(update={"particles": Cloud(number=4, radius=0.2, density=1.0)})
"""Cannot be pickled."""


@pytest.fixture(scope="module")
def cluster():
    """A real Dask cluster of two processes."""
    distributed = pytest.importorskip("distributed")
    with distributed.LocalCluster(
        2, threads_per_worker=1, processes=True, dashboard_address=":0"
    ) as local_cluster:
        yield local_cluster


@pytest.fixture(scope="module", params=["processes", "dask"])
def away(request):
    """An evaluator in other processes, and a function that returns their ids."""
    if request.param == "dask":
        cluster = request.getfixturevalue("cluster")
        evaluator = executors.evaluator_named(f"dask://{cluster.scheduler_address.removeprefix('tcp://')}")
        pids = lambda: list(evaluator.pool._client.run(os.getpid).values())  # noqa: E731
    else:
        evaluator = executors.evaluator_named("processes:2")
        crew = evaluator.pool._crew
        pids = lambda: [one.process.pid for one in crew if one.process.is_alive()]  # noqa: E731
    with closing(evaluator):
        yield evaluator, pids


@pytest.fixture(scope="module")
def here():
    """Results of this process."""
    with closing(BatchEvaluator()) as evaluator:
        return dict(evaluator.evaluate([*SCENES, CROWDED])), dict(evaluator.evaluate(LONG))


def same(results, others):
    assert sorted(results) == sorted(others)
    for index, result in results.items():
        other = others[index]
        same_result(result, other)
        assert result.measures == other.measures
        assert result.scene == other.scene


@pytest.mark.long
def test_results_and_failures_equal_one_process_to_the_bit(away, here):
    evaluator, pids = away
    fractions = []
    results = list(evaluator.evaluate([*SCENES, CROWDED], fractions.append))
    assert len(results) == 10, "each once"
    same(dict(results), here[0])
    assert not dict(results)[9].status.ok
    assert fractions == sorted(fractions)
    assert fractions[-1] == 1.0
    assert len(pids()) == 2
    assert os.getpid() not in pids()
    assert evaluator.settings == {**runtime.current().settings, "backend": runtime.backend()}


@pytest.mark.slow
def test_effects_of_the_users_own_act_in_workers(away, own_file):
    """Each worker receives the file; a worker that has another version of it loads the new one."""
    evaluator, _ = away
    for factor in ("", "2.0 * "):
        law = python_file.load(own_file("own_law.py", LAW.replace("-self", f"-{factor}self")))
        scenes = [s.model_copy(update={"effects": (law.Pull(strength=1e-9),)}) for s in SCENES[:2]]
        with closing(BatchEvaluator()) as local:
            same(
                dict(Remote(evaluator.pool, WorkerSettings()).evaluate(scenes)), dict(local.evaluate(scenes))
            )


def test_a_missing_module_in_a_worker_is_reported_in_a_line(own_file):
    law = python_file.load(own_file("own_law.py", LAW))
    pickled = working.pack_scenes([SCENES[0].model_copy(update={"effects": (law.Pull(strength=1e-9),)})])
    here = WorkerSettings()
    python_file.unload("own_law")
    with pytest.raises(
        InputError, match=r"^worker \(process .* must be able to import .* --plugin\); received No"
    ):
        working._unpack_scenes(pickled, WorkerSettings())
    (file,) = here.files
    broken = replace(here, files=(replace(file, text=b"import no_such_module"),))
    with pytest.raises(
        InputError, match=r"^worker \(process .*own_law.py must be .* line 1: ModuleNotFoundError"
    ):
        working._unpack_scenes(pickled, broken)
    (scene,) = working._unpack_scenes(pickled, here)
    assert scene.effects[0].strength == 1e-9


def test_scenes_that_cannot_be_sent_are_reported_in_a_line():
    class Hidden(Scene):
        pass

    with pytest.raises(InputError, match="scene must be made of classes that a worker can import; received"):
        working.pack_scenes([Hidden(**dict(SCENES[0]))])


@pytest.mark.long
@pytest.mark.parametrize("away", ["processes", pytest.param("dask", marks=pytest.mark.slow)], indirect=True)
def test_killed_worker_loses_nothing(away, here):
    evaluator, pids = away
    dict(evaluator.evaluate(SCENES))  # all workers have started and compiled
    killed, results = [], []

    def progress(fraction):
        if not killed:
            killed.append(pids()[0])
            os.kill(killed[0], signal.SIGKILL)

    for pair in evaluator.evaluate(LONG, progress):
        results.append(pair)
    assert killed
    assert killed[0] not in pids()
    assert sorted(index for index, _ in results) == list(range(9)), "each once"
    same(dict(results), here[1])


@pytest.mark.slow
@pytest.mark.parametrize("away", ["dask"], indirect=True)
def test_search_is_the_same_though_a_worker_is_killed(away, tmp_path):
    evaluator, pids = away
    settings = Settings(seed=2, method="zohdi", generations=2, options={"population": 8, "parents": 2})

    def records_of(path, runner, on_progress=None):
        with Cache(path) as cache:
            outcome = search(problem("default", ""), runner, cache, settings, on_progress=on_progress)
        records = {record.key: (record.values, record.seed) for record in Cache(path).records()}
        return outcome, records

    def kill(where):
        if where.evaluations == 20:
            os.kill(pids()[-1], signal.SIGKILL)

    there, records = records_of(tmp_path / "there.h5", evaluator, kill)
    with closing(BatchEvaluator()) as local:
        here, expected = records_of(tmp_path / "here.h5", local)
    assert records == expected
    assert there.evaluations == here.evaluations == len(records)
    assert repr(list(there.logbook)) == repr(list(here.logbook))
    assert [list(one) for one in there.hall] == [list(one) for one in here.hall]
    report = verify(tmp_path / "there.h5")
    assert (report.ok, report.duplicates) == (True, 0)


@pytest.mark.slow
@pytest.mark.parametrize("away", ["processes"], indirect=True)
def test_an_idle_worker_is_killed(away, here):
    evaluator, pids = away
    dict(evaluator.evaluate(SCENES))
    for pid in pids():
        os.kill(pid, signal.SIGKILL)
    while pids():
        time.sleep(0.01)
    same(dict(evaluator.evaluate([*SCENES, CROWDED])), here[0])


@pytest.mark.long
def test_a_stopped_evaluator_leaves_no_process():
    evaluator = executors.evaluator_named("processes:2")
    with closing(evaluator):
        dict(evaluator.evaluate(SCENES))
        children = [one.process for one in evaluator.pool._crew]

        def ctrl_c(fraction):
            raise KeyboardInterrupt

        with pytest.raises(KeyboardInterrupt):
            list(evaluator.evaluate([s.model_copy(update={"duration": 1e6}) for s in SCENES], ctrl_c))
        assert all(child.is_alive() for child in children)
    assert len(children) == 2
    assert not any(child.is_alive() for child in children)


@pytest.fixture
def light(monkeypatch):
    """Processes that obey commands and compile nothing; see light_worker.py."""
    monkeypatch.setattr("tisim.optimize.evaluation.executors.worker.serve", light_worker.serve)
    with closing(Remote(Processes(2), WorkerSettings())) as evaluator:
        yield evaluator.pool


def test_process_that_ends_takes_only_its_own_work_with_it(light):
    doomed, other = light.submit("end", None), light.submit("echo", None)
    with pytest.raises(Lost, match="worker process has ended with exit code 3"):
        light.outcome(doomed)
    assert light.outcome(other) == "echo"
    assert light.outcome(light.submit("echo", None)) == "echo"
    cut = light.submit("answer in part", None)
    with pytest.raises(Lost, match="ended with exit code 4"):
        light.outcome(cut)
    assert [light.outcome(f) for f in [light.submit("echo", None) for _ in range(4)]] == ["echo"] * 4


def test_a_killed_idle_process_is_noticed_at_the_next_task(light):
    os.kill(light.outcome(light.submit("pid", None)), signal.SIGKILL)
    (killed,) = light._crew
    killed.process.join()
    with pytest.raises(Lost, match="ended with exit code -9"):
        light.outcome(light.submit("echo", None))
    assert light.outcome(light.submit("echo", None)) == "echo"


def test_ctrl_c_is_for_the_searching_process(light):
    first = light.submit("pid", None)
    os.kill(light.outcome(first), signal.SIGINT)
    assert light.outcome(light.submit("echo", None)) == "echo"


def test_process_that_cannot_be_started_is_a_message(light, monkeypatch):
    def none_left(process):
        raise BlockingIOError(11, "Resource temporarily unavailable")

    monkeypatch.setattr("multiprocessing.process.BaseProcess.start", none_left)
    with pytest.raises(RunError, match=r"worker process could not be started: .*temporarily unavailable"):
        light.outcome(light.submit("echo", None))


@pytest.mark.long
@pytest.mark.parametrize("away", ["processes"], indirect=True)
def test_error_of_the_program_in_a_worker_is_raised_here(away):
    """The message gives the place in the worker, and the worker continues."""
    evaluator, pids = away
    dict(evaluator.evaluate(SCENES))
    before = pids()
    with pytest.raises(ValueError, match="invalid literal for int") as error_info:
        evaluator._results(evaluator.pool.outcome(evaluator.pool.submit([Unreadable()], WorkerSettings())))
    assert "in _run_pickled" in error_info.value.__notes__[0]
    dict(evaluator.evaluate(SCENES))
    assert pids() == before


class Unreadable:
    """A scene that a worker cannot unpickle."""

    def __reduce__(self):
        return int, ("x",)


@pytest.mark.long
def test_workers_end_with_the_searching_process():
    """The parent is killed, so it cannot tell its workers to stop."""
    with worker("asleep", start_new_session=True) as process:
        assert process.stdout.readline() == "2 at work\n"
        assert len(alive(process.pid)) >= 3
        process.kill()
    await_end(process.pid)


class Doomed:
    """Workers that die on every task."""

    workers = 2

    def __init__(self):
        self.units = []

    def submit(self, scenes, worker_settings):
        self.units.append(tuple(scene.seed for scene in scenes))
        future = cf.Future()
        future.set_result([])
        return future

    def outcome(self, future):
        raise Lost("killed")

    def check_workers(self):
        pass


def test_workers_that_die_of_everything_end_the_search():
    doomed = Doomed()
    with pytest.raises(RunError, match=r"killed; it was the worker number 3 to be lost with the same work"):
        list(Remote(doomed, WorkerSettings()).evaluate(SCENES))
    assert max(doomed.units.count(unit) for unit in doomed.units) == 3


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
        (
            "processes:0",
            "executor must be processes:N with N >= 1 and of at most 4 digits; received 'processes:0'",
        ),
        (
            "processes:two",
            "executor must be processes:N with N >= 1 and of at most 4 digits; received 'processes:two'",
        ),
        ("batch:2", "executor must be batch, processes:N or dask"),
        ("dask:localhost", "executor must be batch, processes:N or dask"),
    ],
)
def test_unknown_executors_are_refused(name, message):
    with pytest.raises(InputError, match=message):
        executors.evaluator_named(name)
    with pytest.raises(InputError, match="precision must be"):
        executors.evaluator_named("processes:2", precision="f16")


def test_an_address_without_a_scheduler_is_refused(monkeypatch):
    pytest.importorskip("distributed")
    monkeypatch.setattr("tisim.optimize.evaluation.executors.dask_cluster.CONNECT_S", 0.3)
    with pytest.raises(InputError, match="must be the address of a running Dask scheduler; received '127"):
        executors.evaluator_named("dask://127.0.0.1:9")


@pytest.mark.parametrize(
    ("address", "message"),
    [
        (
            "udp://h:1",
            "scheme of the Dask scheduler's address must be one of tcp, ws, tls, wss; received 'udp'",
        ),
        ("tls://h", r"address of a running Dask scheduler; received 'tls://h' \(missing port number"),
        ("h", r"address of a running Dask scheduler; received 'h' \(missing port number"),
        ("tls://h:1", "received 'tls://h:1' .there are no certificates in Dask's configuration"),
        ("wss://h:1", "received 'wss://h:1' .there are no certificates in Dask's configuration"),
    ],
)
def test_invalid_addresses_are_refused(monkeypatch, address, message):
    distributed = pytest.importorskip("distributed")
    monkeypatch.setattr(distributed, "Client", lambda *a, **k: pytest.fail("nobody is to be asked"))
    with pytest.raises(InputError, match=message):
        executors.evaluator_named(f"dask://{address}")


@pytest.fixture
def encrypted():
    """A Dask cluster with TLS in this process: its address, and the security settings of a client."""
    pytest.importorskip("cryptography")
    distributed = pytest.importorskip("distributed")
    lets_in = distributed.Security.temporary()
    settings = {
        "distributed.comm.tls.ca-file": lets_in.tls_ca_file,
        "distributed.comm.tls.client.cert": lets_in.tls_client_cert,
        "distributed.comm.tls.client.key": lets_in.tls_client_key,
    }
    with distributed.LocalCluster(
        1, threads_per_worker=1, processes=False, dashboard_address=":0", protocol="tls", security=lets_in
    ) as local_cluster:
        yield local_cluster.scheduler_address, settings


def test_dask_cluster_with_tls(encrypted):
    """During the connection the worker is asked for its program version."""
    import dask

    address, settings = encrypted
    assert address.startswith("tls://")
    with dask.config.set(settings), closing(executors.evaluator_named(f"dask://{address}")) as evaluator:
        assert evaluator.pool.workers == 1
    strangers = {**settings, "distributed.comm.tls.ca-file": "/nowhere/ca.pem"}
    with dask.config.set(strangers), pytest.raises(InputError, match=r"\(\[Errno 2\] No such file"):
        executors.evaluator_named(f"dask://{address}")


def test_dask_is_optional(monkeypatch):
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(InputError, match=r"one that is installed \(pip install 'tisim\[dask\]'\)"):
        executors.evaluator_named("dask://127.0.0.1:9")


class Other:
    """Workers that give preset answers."""

    workers = 1

    def __init__(self, answer):
        self.answer = answer

    def submit(self, scenes, worker_settings):
        future = cf.Future()
        future.set_result(self.answer)
        return future

    def outcome(self, future):
        return future.result()

    def check_workers(self):
        pass


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("tisim", "0.0.9"),
        ("physics", "0"),
        ("code", "0123456789ab"),
        ("backend", "other 1.0.0"),
        ("NumPy", "2.0.0"),
        ("Python", "3.10"),
        ("machine", "other"),
        ("precision", "f32"),
        ("device", "cuda"),
    ],
)
def test_worker_of_another_program_is_refused(name, value):
    """Its results may differ in the last bits, but the cache would treat them as equal."""
    worker_settings = WorkerSettings()
    made_by = {**worker_settings.made_by, name: value}
    message = (
        f"of {name} {re.escape(worker_settings.made_by[name])}, as the search is; received '{name} {value}'"
    )
    with pytest.raises(InputError, match=message):
        list(Remote(Other(Answer(made_by, [])), worker_settings).evaluate(SCENES[:1]))


def test_one_edited_source_file_makes_another_program(tmp_path, monkeypatch):
    for name in ("tisim", "optimize", "cases"):
        shutil.copytree(ROOT / name, tmp_path / name, ignore=shutil.ignore_patterns("__pycache__"))
    ours = handshake.source.__wrapped__()

    folders = tuple(tmp_path / name for name in ("tisim", "optimize", "cases"))
    monkeypatch.setattr(handshake, "own_folders", lambda: folders)
    assert handshake.source.__wrapped__() == ours
    with (tmp_path / "tisim" / "effects" / "drag.py").open("a") as file:
        file.write("\n")
    assert handshake.source.__wrapped__() != ours


def elsewhere(address, folder):
    """A Dask worker that imports its packages from a folder."""
    command = [sys.executable, "-m", "distributed.cli.dask_worker", address]
    options = ["--no-nanny", "--no-dashboard", "--nthreads", "1", "--local-directory", str(folder)]
    return subprocess.Popen(
        [*command, *options], env={**os.environ, "PYTHONPATH": str(folder)}, cwd=folder,
        stderr=subprocess.DEVNULL, start_new_session=True,
    )  # fmt: skip


@pytest.fixture
def join(cluster, tmp_path):
    """Adds a worker with other packages to the cluster."""
    joined = []

    def start():
        before = len(cluster.scheduler_info["workers"])
        joined.append(elsewhere(cluster.scheduler_address, tmp_path))
        while len(cluster.scheduler_info["workers"]) == before:
            assert joined[-1].poll() is None
            time.sleep(0.05)

    yield start
    for process in joined:
        process.kill()
        process.wait()
    while len(cluster.scheduler_info["workers"]) > 2:
        time.sleep(0.05)


def without(folder, *names):
    """Packages of another version: some modules are missing, and the version number differs."""
    for name in ("tisim", "optimize", "cases"):
        shutil.copytree(ROOT / name, folder / name, ignore=shutil.ignore_patterns("__pycache__", *names))
    text = folder / "tisim" / "version.py"
    text.write_text(text.read_text().replace(f'"{__version__}"', '"0.0.9"'))


def connected(cluster):
    return executors.evaluator_named(f"dask://{cluster.scheduler_address.removeprefix('tcp://')}")


@pytest.mark.long
def test_dask_worker_of_another_version_is_refused_before_anything_runs(cluster, join, tmp_path):
    without(tmp_path)
    join()
    message = (
        rf"^worker tcp://\S+ of the Dask cluster must be of tisim {__version__}, code \w+, as the search is; "
    )
    with pytest.raises(InputError, match=message + r"received 'tisim 0\.0\.9, code \w+'$"):
        connected(cluster)


@pytest.mark.slow
def test_dask_worker_that_does_not_know_its_version_is_refused(cluster, join, tmp_path):
    without(tmp_path, "handshake.py")
    join()
    message = rf"must be one with the program of the search \(tisim {__version__}, .*; received .*handshake"
    with pytest.raises(InputError, match=message):
        connected(cluster)


@pytest.mark.slow
def test_dask_worker_of_another_version_that_comes_later_is_refused(cluster, join, tmp_path):
    without(tmp_path)
    with closing(connected(cluster)) as evaluator:
        join()
        many = [s.model_copy(update={"seed": k}) for k, s in enumerate(SCENES * 20)]
        with pytest.raises(InputError, match=r"received 'tisim 0\.0\.9, code \w+'"):
            list(evaluator.evaluate(many))


def test_dask_futures_without_an_answer_give_messages():
    distributed = pytest.importorskip("distributed")
    for answer, error, message in (
        ([], InputError, r"one with the program of the search \(tisim .*\); received \[\]"),
        (AttributeError("WorkerSettings"), InputError, r"received AttributeError\('WorkerSettings'\)"),
        (
            distributed.KilledWorker("run", SimpleNamespace(address="tcp://a"), 4),
            RunError,
            "were lost again and again",
        ),
        (OSError("closed"), RunError, r"were lost again and again \(closed\)"),
    ):
        future = cf.Future()
        (future.set_exception if isinstance(answer, BaseException) else future.set_result)(answer)
        with pytest.raises(error, match=message):
            dask_cluster.DaskCluster.outcome(None, future)
    cancelled = cf.Future()
    cancelled.cancel()
    with pytest.raises(RunError, match="Dask scheduler was lost"):
        dask_cluster.DaskCluster.outcome(None, cancelled)


@pytest.mark.slow
def test_dask_without_workers_ends_with_a_message(cluster, monkeypatch):
    """Simulated here; the next test kills real workers."""
    monkeypatch.setattr(dask_cluster, "SILENCE_S", 0.5)
    monkeypatch.setattr(dask_cluster, "WORKER_CHECK_S", 0.0)
    with closing(connected(cluster)) as evaluator:
        dict(evaluator.evaluate(SCENES))
        monkeypatch.setattr(dask_cluster.DaskCluster, "workers", 0)
        with (
            pytest.warns(RuntimeWarning, match=r"no worker of the Dask cluster answers; waiting for 0\.5 s"),
            pytest.raises(RunError, match=r"no worker of the Dask cluster has answered for 0\.5 s"),
        ):
            list(evaluator.evaluate([s.model_copy(update={"duration": 1e5}) for s in SCENES]))


def alive(group):
    """Command lines of the processes of a group that are still running."""
    processes = []
    for status in Path("/proc").glob("[0-9]*/stat"):
        with contextlib.suppress(OSError):
            state, _, of = status.read_text().rpartition(")")[2].split()[:3]
            if int(of) == group and state != "Z":
                processes.append(status.with_name("cmdline").read_text())
    return processes


def await_end(group):
    """Wait until no process of a group is left; busy workers finish their current kernel."""
    ends = time.monotonic() + 600
    while pids := alive(group):
        assert time.monotonic() < ends, pids
        time.sleep(0.02)


@pytest.mark.slow
@pytest.mark.parametrize(
    ("number", "all_of_them", "code"),
    [
        (signal.SIGINT, True, 130),  # as sent by a terminal
        (signal.SIGHUP, True, 129),
        (signal.SIGTERM, False, 143),
        (signal.SIGTERM, True, 143),
        (signal.SIGKILL, False, -9),
    ],
)
def test_a_stopped_command_stops_all_its_workers(tmp_path, number, all_of_them, code):
    command = ("optimize", "drift", "--generations", "5000")
    folder = tmp_path / "s"
    with worker(
        "tisim", *command, "--executor", "processes:2", "--out", folder,
        stderr=subprocess.PIPE, start_new_session=True,
    ) as process:  # fmt: skip
        for line in process.stderr:
            if line.startswith("generation   1"):
                break
        (os.killpg if all_of_them else os.kill)(process.pid, number)
        _, err = process.communicate()
    assert process.returncode == code
    assert number == signal.SIGKILL or "To go on, give the same command again" in " ".join(err.split())
    assert "Traceback" not in err
    await_end(process.pid)
    assert verify(folder / "search.h5").ok


@pytest.fixture
def grid(tmp_path):
    """A Dask scheduler and one worker that is not restarted: the processes, and the address."""
    file = tmp_path / "scheduler.json"
    options = ["--no-dashboard", "--scheduler-file", str(file)]
    command = [sys.executable, "-m", "distributed.cli.dask_scheduler", *options]
    scheduler = subprocess.Popen([*command, "--host", "127.0.0.1", "--port", "0"], stderr=subprocess.DEVNULL)
    while not (file.exists() and file.read_text().endswith("}")):
        assert scheduler.poll() is None
        time.sleep(0.05)
    address = json.loads(file.read_text())["address"]
    one = elsewhere(address, tmp_path)
    yield scheduler, one, f"dask://{address.removeprefix('tcp://')}"
    for process in (scheduler, one):
        process.kill()
        process.wait()


@pytest.mark.slow
@pytest.mark.parametrize("who", ["scheduler", "worker"])
def test_dask_that_is_lost_ends_the_search_with_a_message(grid, tmp_path, who):
    (tmp_path / "sitecustomize.py").write_text(f"import sys; sys.path += {sys.path!r}")
    scheduler, one, name = grid
    command = ("optimize", "drift", "--generations", "5000", "--executor", name, "--out", tmp_path / "s")
    with worker("tisim", *command, stderr=subprocess.PIPE) as process:
        for line in process.stderr:
            if line.startswith("generation   1"):
                break
        (scheduler if who == "scheduler" else one).kill()
        _, err = process.communicate()
    assert process.returncode == 1, err
    assert "Traceback" not in err
    last = (
        "Dask scheduler was lost" if who == "scheduler" else "no worker of the Dask cluster has answered for"
    )
    assert last in err.splitlines()[-1]
    assert verify(tmp_path / "s" / "search.h5").ok
