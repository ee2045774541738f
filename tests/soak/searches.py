"""Searches killed at random moments and restarted until they end, compared with an undisturbed search."""

from __future__ import annotations

import contextlib
import os
import random
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Iterator
from concurrent.futures import ThreadPoolExecutor
from dataclasses import dataclass
from pathlib import Path

from tests.soak.counts import Counts
from tisim.backend.kernel_cache import LOCKS
from tisim.backend.runtime import cores
from tisim.backend.taichi import BACKEND
from tisim.optimize.storage.cache import Cache, existing
from tisim.optimize.storage.maintenance import verify

WORKER = Path(__file__).parents[1] / "optimize" / "cache_worker.py"
SEARCH = ("optimize", "drift", "--generations", "3", "--seed", "3")
SIGNALS = (signal.SIGKILL, signal.SIGTERM, signal.SIGHUP, signal.SIGINT)
KILLS = 4
"""Number of kills of each kind, at full share."""
PIPE = 4096
"""Bytes that a search may write before they are read, so that it cannot end before the kill."""
HUNG_S = 600.0
"""Time (s) after which a process counts as hung."""


@dataclass(frozen=True)
class Kind:
    """The signal and its target: the searching process alone, its whole group, or one of its workers."""

    number: signal.Signals
    whom: str = "search"
    executor: str = "batch"

    @property
    def name(self) -> str:
        """A row of the table."""
        whom = {"search": "search", "all": "search and workers", "worker": "a worker"}[self.whom]
        return f"{self.number.name} to {whom} ({self.executor})"


KINDS = (
    *(Kind(number) for number in SIGNALS),
    *(Kind(number, "search", "processes:2") for number in (signal.SIGKILL, signal.SIGTERM)),
    *(Kind(number, "all", "processes:2") for number in SIGNALS),
    *(Kind(number, "worker", "processes:2") for number in (signal.SIGKILL, signal.SIGTERM)),
)


def soak(seed: int, share: float, folder: Path) -> Iterator[Counts]:
    """Counts of every kind of kill."""
    for number in SIGNALS[1:]:
        if signal.getsignal(number) is signal.SIG_IGN:  # as in the background; searches would inherit it
            signal.signal(number, lambda *_: None)
    alone = _Search(folder / "alone" / "0", "batch")
    assert alone.wait() == 0, alone.stderr_text()
    expected = contents(folder / "alone" / "0")

    def one(kind: Kind) -> Counts:
        rng = random.Random(f"{seed} {kind.name}")
        return killed(kind, max(1, round(share * KILLS)), expected, rng, folder / kind.name.replace(" ", "-"))

    with ThreadPoolExecutor(cores()) as side_by_side:
        yield from side_by_side.map(one, KINDS)


def killed(kind: Kind, kills: int, expected: dict, rng: random.Random, folder: Path) -> Counts:
    """Kill a given number of times; whenever a search ends anyway, compare it and begin another one."""
    counts = Counts(kind.name)
    round_, acknowledged = 0, set()
    while True:
        place = folder / str(round_)
        search = _Search(place, kind.executor)
        shot = counts.trials < kills and shoot(search, kind, rng)
        code = search.wait()
        counts.trials += shot
        counts.hung += search.hung
        stopped = {0, 128 + kind.number, -kind.number} if shot and kind.whom != "worker" else {0}
        counts.tracebacks += not search.hung and ("Traceback" in search.stderr_text() or code not in stopped)
        acknowledged |= search.stored
        counts.lost += len(acknowledged - keys(place))
        if code == 0:
            counts.wrong += contents(place) != expected
            counts.doubled += verify(place / "search.h5").duplicates
            if counts.trials == kills:
                return counts
            round_, acknowledged = round_ + 1, set()
        elif search.hung or code not in stopped:
            return counts  # it would only fail again


def shoot(search: _Search, kind: Kind, rng: random.Random) -> bool:
    """Wait for a random number of evaluations and a little more, then send the signal; False if it had ended.

    Some of the kills come early: while Python starts, files are read, and kernels are compiled.
    """
    # Ctrl-C during the start of Python gives a traceback of its own.
    if kind.number != signal.SIGINT and rng.random() < 0.2:
        time.sleep(rng.uniform(0.0, 3.0))
    elif not search.follow(rng.randint(1, 40)):
        return False
    time.sleep(rng.uniform(0.0, 0.03))
    there = dict(living(search.process.pid))
    workers = [pid for pid, command in there.items() if "spawn_main" in command]
    alone = {"search": [search.process.pid], "worker": [rng.choice(workers)] if workers else [], "all": []}
    with contextlib.suppress(ProcessLookupError):  # it may just have ended
        if kind.whom == "all":
            os.killpg(search.process.pid, kind.number)
        for pid in alone[kind.whom]:
            os.kill(pid, kind.number)
    return bool(there if kind.whom == "all" else there.keys() & alone[kind.whom])


class _Search:
    """A search in its own process group. stored : keys of the evaluations that it has acknowledged."""

    def __init__(self, folder: Path, executor: str) -> None:
        self.hung, self.stored = False, set[str]()
        self._errors = folder.with_name(folder.name + ".stderr")
        self._errors.parent.mkdir(parents=True, exist_ok=True)
        command = [sys.executable, str(WORKER), "tisim", *SEARCH, "--executor", executor, "--out"]
        paths = os.pathsep.join(filter(None, sys.path))
        # A separate kernel cache, so that kills do not affect other processes on this machine.
        kernels = {LOCKS[BACKEND][0]: str(self._errors.parents[1] / "kernels")}
        with self._errors.open("w") as errors:
            self.process = subprocess.Popen(
                [*command, str(folder)], env={**os.environ, "PYTHONPATH": paths, **kernels},
                stdout=subprocess.PIPE, pipesize=PIPE, stderr=errors, text=True, start_new_session=True,
            )  # fmt: skip
        self._dog = threading.Timer(HUNG_S, self._end)
        self._dog.start()

    def follow(self, evaluations: int | None = None) -> bool:
        """Read until ``evaluations`` more are stored or all processes have ended; whether they are."""
        remaining = evaluations
        while remaining is None or remaining > 0:
            line = self.process.stdout.readline()
            if not line.endswith("\n"):
                return False
            if line.startswith("stored "):
                self.stored.add(line.split()[1])
                remaining = None if remaining is None else remaining - 1
        return True

    def wait(self) -> int:
        """The exit code, after all processes of the group have ended."""
        self.follow()
        code = self.process.wait()
        while living(self.process.pid):
            time.sleep(0.02)
        self._dog.cancel()
        return code

    def stderr_text(self) -> str:
        """The contents of its standard error."""
        return self._errors.read_text()

    def _end(self) -> None:
        self.hung = True
        for pid, _ in living(self.process.pid):
            os.kill(pid, signal.SIGKILL)


def living(group: int) -> list[tuple[int, str]]:
    """Ids and command lines of the running processes of a group."""
    command = ["ps", "-eo", "pid=,pgid=,stat=,args="]
    table = subprocess.run(command, capture_output=True, text=True, check=True).stdout
    rows = (line.split(maxsplit=3) for line in table.splitlines())
    return [(int(row[0]), row[3]) for row in rows if int(row[1]) == group and not row[2].startswith("Z")]


def keys(folder: Path) -> set[str]:
    """Keys of the evaluations in the file of a search, if there is one yet."""
    file = folder / "search.h5"
    if not (file.exists() or file.with_name("search.h5.journal").exists()):
        return set()
    return {record.key for record in existing(file).records()}


def contents(folder: Path) -> dict:
    """The contents of the folder of a search: evaluations, tables and best designs."""
    cache = Cache(folder / "search.h5")
    return {
        "records": {record.key: (record.values, record.seed, record.design) for record in cache.records()},
        "tables": {name: repr(cache.table(name).columns) for name in cache.tables()},
        "best": (folder / "best.csv").read_bytes(),
    }
