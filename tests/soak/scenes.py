"""Hostile scenes: plain data, files and settings are accepted or refused in one line, within a second.

Scenes that are accepted although their numbers are extreme run for some steps.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Iterator
from pathlib import Path
from random import Random

from tests import extremes, hostile
from tests.judged import ACCEPTED, check_file, check_message, command, nothing_runs
from tests.soak.apart import Apart, Outcome
from tests.soak.counts import Counts
from tests.soak.running import RAN, REFUSED, Runs
from tisim import InputError, Scene

TRIALS = 1000
"""Number of trials of each kind."""
OF_ONE = 50
"""Runs of one scene with different numbers; compiling it takes as long as several hundred of them."""
SECOND = 1.0
"""Processor time (s) of one trial, which does not depend on the load of the machine."""
PATIENCE = 120.0
"""Wall time (s) after which a trial without an answer is ended from outside."""


def plain_data(random: Random, folder: Path) -> None:
    """A scene from plain data, as a program makes it."""
    try:
        accepted = Scene.from_dict(hostile.mutated(random))
    except InputError as fault:
        check_message(str(fault))
    else:
        check_file(accepted, folder / "again.toml")


def files(random: Random, folder: Path) -> None:
    """The command ``run`` with a scene file."""
    path = folder / "scene.toml"
    path.write_bytes(hostile.mutated_toml(random))
    _command(["run", str(path)], folder)


def settings(random: Random, folder: Path) -> None:
    """The command ``run`` with a good file and --set."""
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


def reader(folder: Path) -> Callable[[tuple[str, int]], str]:
    """In a separate process: trials by (kind, seed)."""
    hostile.valid()

    def trial(call: tuple[str, int]) -> str:
        kind, seed = call
        began = time.thread_time()
        KINDS[kind](Random(seed), folder)
        if time.thread_time() - began > SECOND:
            raise TimeoutError(f"{time.thread_time() - began:.3g} s")
        return RAN

    return trial


def soak(seed: int, share: float, folder: Path) -> Iterator[Counts]:
    """Counts of each kind, as described in tests/soak/__main__.py."""
    number = max(1, round(share * TRIALS))
    worker = Apart(reader, folder)
    try:
        for k, kind in enumerate(KINDS):
            seeds = range((seed * len(KINDS) + k) * TRIALS, (seed * len(KINDS) + k) * TRIALS + number)
            yield _count(kind, ((f"seed {s}", worker.trial((kind, s), PATIENCE)) for s in seeds))
    finally:
        worker.end()
    runs, names = Runs(), list(extremes.scenes())
    try:
        seeds = range(seed * TRIALS, seed * TRIALS + number)
        draws = ((names[s // OF_ONE % len(names)], s) for s in seeds)
        yield _count("extreme scenes run", ((f"{name}, seed {s}", runs(name, s)) for name, s in draws))
    finally:
        runs.end()


def _count(kind: str, trials: Iterator[tuple[str, Outcome]]) -> Counts:
    """Counts of trials, each with a description; failures are printed."""
    counts = Counts(kind)
    for scene_name, (column, word) in trials:
        counts.trials += word != REFUSED
        if column:
            setattr(counts, column, getattr(counts, column) + 1)
            print(f"{kind}, {scene_name}: {column}: {word[-1500:]}", flush=True)
    return counts
