"""Hostile scenes: plain data, files and settings, each accepted or refused in a line, within a second."""

from __future__ import annotations

import multiprocessing
import time
from collections.abc import Iterator
from multiprocessing.connection import Connection
from pathlib import Path
from random import Random

from tests import hostile
from tests.judged import ACCEPTED, check_file, check_message, command, nothing_runs
from tests.soak.counts import Counts
from tisim import Scene
from tisim.errors import InputError

TRIALS = 1000
"""Of each kind."""
SECOND = 1.0
"""The work of one trial, s of the processor: what a loaded machine does not lengthen."""
PATIENCE = 120.0
"""The wall time, s, after which a trial that has not answered is ended from outside."""


def plain_data(random: Random, folder: Path) -> None:
    """A scene from plain data, as a program makes it."""
    try:
        accepted = Scene.from_dict(hostile.mutated(random))
    except InputError as fault:
        check_message(str(fault))
    else:
        check_file(accepted, folder / "again.toml")


def files(random: Random, folder: Path) -> None:
    """The command ``run`` of a scene file."""
    path = folder / "scene.toml"
    path.write_bytes(hostile.mutated_toml(random))
    _command(["run", str(path)], folder)


def settings(random: Random, folder: Path) -> None:
    """The command ``run`` of a good file with --set."""
    data, path = random.choice(hostile.valid()), folder / "scene.toml"
    path.write_text(Scene.from_dict(data).to_toml(), encoding="utf-8")
    _command(["run", str(path), "--set", hostile.assignment(data, random)], folder)


def _command(words: list[str], folder: Path) -> None:
    with nothing_runs() as scenes:
        code, err = command([*words, "--out", str(folder / "out")])
    if code == 2:
        check_message(err.strip())
    else:
        assert (code, err.strip()) == (1, ACCEPTED), err[-2000:]
        check_file(scenes[0], folder / "again.toml")


KINDS = {"hostile plain data": plain_data, "hostile scene files": files, "hostile settings": settings}


def work(calls: Connection, folder: Path) -> None:
    """Answer each (kind, seed) with what came of it: "", "wrong", "hung" or "traceback"."""
    hostile.valid()
    calls.send("ready")
    while True:
        kind, seed = calls.recv()
        began, came = time.thread_time(), ""
        try:
            KINDS[kind](Random(seed), folder)
        except AssertionError:
            came = "wrong"
        except BaseException:
            came = "traceback"
        calls.send("hung" if time.thread_time() - began > SECOND else came)


class Worker:
    """A process that makes trials, and another in its place when it dies or does not answer."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self._start()

    def _start(self) -> None:
        context = multiprocessing.get_context("spawn")
        self.calls, theirs = context.Pipe()
        self.process = context.Process(target=work, args=(theirs, self.folder), daemon=True)
        self.process.start()
        theirs.close()
        self.calls.recv()

    def trial(self, kind: str, seed: int) -> str:
        """What came of a trial."""
        self.calls.send((kind, seed))
        try:
            if self.calls.poll(PATIENCE):
                return str(self.calls.recv())
            came = "hung"
        except EOFError:
            came = "traceback"
        self.end()
        self._start()
        return came

    def end(self) -> None:
        """End the process."""
        self.process.kill()
        self.process.join()


def soak(seed: int, share: float, folder: Path) -> Iterator[Counts]:
    """Counts of each kind; tests/soak/__main__.py says what they are."""
    worker = Worker(folder)
    try:
        for number, kind in enumerate(KINDS):
            counts = Counts(kind)
            for k in range(max(1, round(share * TRIALS))):
                came = worker.trial(kind, (seed * len(KINDS) + number) * TRIALS + k)
                counts.tried += 1
                counts.wrong += came == "wrong"
                counts.hung += came == "hung"
                counts.tracebacks += came == "traceback"
                if came:
                    print(f"{kind}, seed {(seed * len(KINDS) + number) * TRIALS + k}: {came}")
            yield counts
    finally:
        worker.end()
