"""Runs killed at random times, and disks that become full at random sizes, for all files that a run
writes."""

from __future__ import annotations

import json
import os
import select
import shutil
import subprocess
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import h5py
import numpy as np

from tests.soak import damage
from tests.soak.counts import Counts

KILLS = 20
"""Number of killed runs; each is resumed, and may be killed again, until it ends."""
SIZES = 20
"""Number of disk sizes for each command."""
PATIENCE = 900.0
"""Time (s) after which a trial counts as hung, many times its duration on a loaded machine."""
ROOT = Path(__file__).parents[2]
RUN = (
    "run", "agglomeration", "--size", "paper", "--set", "effects.impact.hardness=1e7", "--set",
    "duration=1e-3", "--seed", "4", "--frames", "60", "--out",
)  # fmt: skip


def begin(folder: Path, *more: str) -> subprocess.Popen[str]:
    """A run that saves checkpoints as often as possible."""
    return subprocess.Popen(
        [sys.executable, "-c", "from tisim.cli.main import main; main()", *RUN, str(folder), *more],
        env={**os.environ, "TISIM_CHECKPOINT_SECONDS": "0", "PYTHONPATH": str(ROOT)},
        cwd=ROOT, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE, text=True,
    )  # fmt: skip


def wait_for_end(running: subprocess.Popen[str]) -> str:
    """The error output of a run that fails; empty if it ends normally."""
    try:
        output = running.communicate(timeout=PATIENCE)[1]
    except subprocess.TimeoutExpired:
        running.kill()
        running.communicate()
        raise
    return output[-1500:] if running.returncode else ""


def soak(seed: int, share: float, folder: Path) -> Iterator[Counts]:
    """Counts of killed runs, and of each command on a full disk; failures are printed above them."""
    yield _kill_runs(np.random.default_rng(seed), max(round(KILLS * share), 1), folder / "kills")
    yield from _fill_disks(seed, max(round(SIZES * share), 1), folder / "crowded")


def _kill_runs(rng: np.random.Generator, number: int, folder: Path) -> Counts:
    counts = Counts("killed runs with frames")
    began = time.monotonic()
    assert not wait_for_end(begin(folder / "whole"))
    whole = {name: damage._frames(folder / "whole" / name) for name in ("trajectory.h5", "result.h5")}
    longest = time.monotonic() - began
    for k in range(number):
        counts.trials += 1
        try:
            why = _kill_one(folder / str(k), rng, longest, whole)
        except subprocess.TimeoutExpired:
            why = "hung", "no end"
        if why[0]:
            setattr(counts, why[0], getattr(counts, why[0]) + 1)
            print(f"killed runs: {why[0]}: {why[1]}", flush=True)
    return counts


def _kill_one(folder: Path, rng: np.random.Generator, longest: float, whole: dict) -> tuple[str, str]:
    """Kill a run at random times, resume it, and compare it with the uninterrupted run."""
    more: tuple[str, ...] = ()
    for _ in range(int(rng.integers(1, 4))):
        running = begin(folder, *more)
        _wait(running, folder / "trajectory.h5", rng, longest)
        running.kill()
        running.communicate()
        names = {path.name for path in folder.iterdir()} if folder.exists() else set()
        for name in whole.keys() & names:
            parts = damage._frames(folder / name)
            with h5py.File(folder / name):  # as any other program opens it
                pass
            if parts != whole[name][: len(parts)]:
                return "wrong", f"{name} of a killed run differs from that of a whole one"
        if "result.h5" in names:
            break
        more = ("--resume",) if "checkpoint.h5" in names else ("--overwrite",) if names else ()
    if "result.h5" not in names and (why := wait_for_end(begin(folder, *more))):
        return "tracebacks" if "Traceback" in why else "lost", why
    for name, frames in whole.items():
        if damage._frames(folder / name) != frames:
            return "wrong", f"{name} differs from that of a run that was not killed"
    shutil.rmtree(folder)
    return "", ""


def _wait(running: subprocess.Popen[str], file: Path, rng: np.random.Generator, longest: float) -> None:
    """Wait until a random instant, at most ``longest`` (s) from now or, in half of the cases, from the
    creation of the file."""
    if rng.random() < 0.5:
        while running.poll() is None and not file.exists():
            time.sleep(0.001)
    time.sleep(rng.uniform(0, longest) * rng.choice([0.01, 0.3, 1.0]))


def _fill_disks(seed: int, sizes: int, folder: Path) -> Iterator[Counts]:
    """Half of the sizes are sizes of a small file system, if one can be mounted."""
    mounts = subprocess.run(["unshare", "-rm", "true"], capture_output=True, check=False).returncode == 0
    counts: dict[str, Counts] = {}
    for kind, number in (
        (("limit", sizes - sizes // 2), ("tmpfs", sizes // 2)) if mounts else (("limit", sizes),)
    ):
        _trials(kind, seed, number, folder / kind, counts)
    yield from counts.values()


def _trials(kind: str, seed: int, sizes: int, folder: Path, counts: dict[str, Counts]) -> None:
    from tests.soak.crowded import TRIALS

    finished, number = 0, sizes * len(TRIALS)
    while finished < number:
        folder.mkdir(parents=True, exist_ok=True)
        for name, column, why in _process(kind, seed, finished, number, folder):
            finished += 1
            one = counts.setdefault(name, Counts(f"full disk: {name}"))
            one.trials += 1
            if column:
                setattr(one, column, getattr(one, column) + 1)
                print(f"full disk ({kind}), {name}: {column}: {why[-1500:]}", flush=True)
        shutil.rmtree(folder)


def _process(kind: str, seed: int, first: int, last: int, folder: Path) -> Iterator[tuple[str, str, str]]:
    """The trial reports of a process until it has finished them, crashes, or has to be ended."""
    alone = ("unshare", "-rm") if kind == "tmpfs" else ()
    command = [
        *alone,
        sys.executable,
        "-m",
        "tests.soak.crowded",
        kind,
        *map(str, (seed, first, last, folder)),
    ]
    environment = {**os.environ, "PYTHONPATH": str(ROOT)}
    with subprocess.Popen(command, stdout=subprocess.PIPE, bufsize=0, env=environment, cwd=ROOT) as process:
        name = ""
        while True:
            readable = select.select([process.stdout], [], [], PATIENCE)[0]
            line = process.stdout.readline() if readable and process.stdout else b""
            if not line:
                break
            answer = json.loads(line)
            if len(answer) == 1:
                name = answer[0]
            else:
                yield name, *answer
                name = ""
        if not readable:
            process.kill()
        process.wait()
        if name:
            yield name, "tracebacks" if readable else "hung", f"the process ended with {process.returncode}"
        elif process.returncode:
            raise RuntimeError(f"{command} ended with {process.returncode} before a trial")
