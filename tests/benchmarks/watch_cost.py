"""Processor time of ``tisim watch`` while a run writes frames and a browser asks for them.

    python tests/benchmarks/watch_cost.py [--sizes 1000 10000 100000] [--rate 2] [--search] [--seconds 120]

A process writes RATE frames a second of particles that move, and this one asks as a page does, every 2 s. The
table has the processor time of the watcher, from /proc (Linux): of its start with all imports, of the first
page, of an answer without a new frame, and of all answers during SECONDS as a share of one core; and the
frames that were shown, of those that were written.

With ``--search`` there is a search of 20 runs a second instead, and the last column has the designs on the
last page, of those at the end.

With ``--slowdown`` the watcher is asked for BLOCK seconds, left alone for BLOCK seconds, and so on, while a
search computes without a pause. Printed are the processor time of the search for a run with the watcher asked
over that without, the mean of pairs of successive blocks with its 95 % interval, the same of a trimmed mean,
and the processor time of the watcher as a share of all cores.
"""

import argparse
import itertools
import json
import os
import re
import subprocess
import sys
import tempfile
import threading
import time
import urllib.parse
import urllib.request
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.stats.mstats import trimmed_mean_ci

from tests.watch.conftest import Growing
from tisim import optimize
from tisim.analysis import Mean
from tisim.optimize.report.search_data import read_search
from tisim.watch.run import POLL

EARLIER = 20
"""Number of frames before the watcher begins."""
QUIET_ASKS = 50
"""Number of requests without a new frame."""


def processor_time(pid: int) -> float:
    """Processor time of a process, s."""
    fields = Path(f"/proc/{pid}/stat").read_text().rpartition(")")[2].split()
    return sum(map(int, fields[11:13])) / os.sysconf("SC_CLK_TCK")


def answer(address: str) -> bytes:
    with urllib.request.urlopen(address, timeout=600) as reply:
        return bytes(reply.read())


def write(folder: Path, number: int, rate: float) -> None:
    """Write frames until the process is killed."""
    run = Growing(folder, n=number, duration=1e6)
    run.write(EARLIER)
    print("ready", flush=True)
    sys.stdin.readline()
    while True:
        run.write()
        time.sleep(1 / rate)


def throw(design: dict[str, float]) -> float:
    time.sleep(0.05)
    return (design["height"] - 1.5) ** 2 + design["width"] ** 2


def search(folder: Path) -> None:
    """Search until the process is killed."""
    genes = [optimize.Gene("height", "m", 1.0, 2.0), optimize.Gene("width", "m", 0.0, 1.0)]
    problem = optimize.Problem.of_function(throw, genes, name="throw")
    print("ready", flush=True)
    optimize.run(problem, out=folder, method="random", generations=10_000)


def computed(design: dict[str, float]) -> float:
    """Compute for some 30 ms, and tell the time and the processor time of this process, s."""
    values = np.linspace(0.0, design["height"], 100_000)
    for _ in range(20):
        values = np.sin(values) + design["width"]
    sys.stdout.write(f"{time.monotonic()} {time.process_time()}\n")
    sys.stdout.flush()
    return float(values.mean())


def compute(folder: Path) -> None:
    """Search without a pause until the process is killed."""
    genes = [optimize.Gene("height", "m", 1.0, 2.0), optimize.Gene("width", "m", 0.0, 1.0)]
    problem = optimize.Problem.of_function(computed, genes, name="throw")
    print("ready", flush=True)
    optimize.run(problem, out=folder, method="random", generations=1_000_000)


def ask(address: str, state: dict[str, Any]) -> None:
    """Ask once as a page does, and for the page if it has changed."""
    one = json.loads(answer(f"{address}news?{urllib.parse.urlencode(state)}"))
    if one.get("changed"):
        state["version"] = facts_of(answer(address))["version"]


def slowdown(seconds: float, block: float) -> None:
    """Print the slowdown of a search by a watcher that is asked, and the watcher's share."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        searcher, _ = stack.enter_context(begun(__file__, "--compute", folder))
        lines: list[tuple[float, float]] = []

        def read() -> None:
            assert searcher.stdout
            for line in searcher.stdout:
                now, used = line.split()
                lines.append((float(now), float(used)))

        threading.Thread(target=read, daemon=True).start()
        while not any(Path(folder).glob("search.h5*")):
            time.sleep(0.1)
        watcher, address = stack.enter_context(begun("-m", "tisim", "watch", folder, "--no-open"))
        state = {"version": facts_of(answer(address))["version"]}
        ends, watched, asked = [time.monotonic()], [], []
        while ends[-1] < ends[0] + seconds or len(asked) % 4:
            # Asked, alone, alone, asked: a drift cancels.
            asked.append(len(asked) % 4 in (0, 3))
            before, end = processor_time(watcher.pid), ends[-1] + block
            while time.monotonic() < end:
                if asked[-1]:
                    ask(address, state)
                time.sleep(max(0.0, min(POLL, end - time.monotonic())))
            watched.append(processor_time(watcher.pid) - before)
            ends.append(time.monotonic())
    told, polled = np.array(lines), np.array(asked)
    inside = [told[(told[:, 0] >= a) & (told[:, 0] < b), 1] for a, b in itertools.pairwise(ends)]
    each = np.array([(used[-1] - used[0]) / (len(used) - 1) for used in inside])
    changes = 100 * (each[polled] / each[~polled] - 1)
    # Other programs on the machine disturb some blocks, which a trimmed mean leaves out.
    mean, (low, high) = Mean.of(changes), trimmed_mean_ci(changes, limits=(0.2, 0.2))
    count, share = sum(map(len, inside)), np.array(watched)[polled].sum() / np.diff(ends)[polled].sum()
    print(f"{polled.sum()} pairs of {block:g} s, {count} runs of {1000 * each[~polled].mean():.1f} ms")
    print(f"processor time of a run of the search, asked over alone: {mean.value:+.2f} +- {mean.half:.2f} %")
    print(f"without a fifth of the pairs at either end: {low:+.2f} to {high:+.2f} %")
    print(f"processor time of the watcher while asked: {100 * share / os.cpu_count():.2f} % of all cores")


def facts_of(page: bytes) -> dict[str, Any]:
    found = re.search(r'id="facts">(.*?)</script>', page.decode(), re.S)
    assert found
    return dict(json.loads(found[1])["live"])


@contextmanager
def begun(*order: str) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A process, with its first line."""
    pipes = {"stdin": subprocess.PIPE, "stdout": subprocess.PIPE, "stderr": subprocess.DEVNULL}
    process = subprocess.Popen([sys.executable, *order], text=True, **pipes)
    assert process.stdout
    try:
        yield process, process.stdout.readline().strip()
    finally:
        process.kill()
        process.wait()


def measure(number: int, rate: float, seconds: float) -> list[str]:
    """The row of the table for a run of this number of particles, or of a search if it is 0."""
    with ExitStack() as stack:
        folder = stack.enter_context(tempfile.TemporaryDirectory())
        what = ("--sizes", str(number), "--rate", str(rate))
        writer, _ = stack.enter_context(begun(__file__, "--write", folder, *what))
        while not number and not any(Path(folder).glob("search.h5*")):
            time.sleep(0.1)
        watcher, address = stack.enter_context(begun("-m", "tisim", "watch", folder, "--no-open"))
        used = [processor_time(watcher.pid)]
        live = facts_of(answer(address))
        used.append(processor_time(watcher.pid))
        state = {
            "key": live.get("key", ""),
            "after": live.get("after", 0),
            "version": live.get("version", ""),
        }

        def news() -> dict[str, Any]:
            return dict(json.loads(answer(f"{address}news?{urllib.parse.urlencode(state)}")))

        for _ in range(QUIET_ASKS):
            news()
        used.append(processor_time(watcher.pid))
        assert writer.stdin
        writer.stdin.write("\n")
        writer.stdin.flush()
        shown, first, began = 0, state["after"], time.monotonic()
        while time.monotonic() < began + seconds:
            one = news()
            state["after"], shown = one.get("after", state["after"]), shown + one.get("shown", 0)
            if one.get("changed"):
                live = facts_of(answer(address))
                state["version"] = live["version"]
            time.sleep(POLL)
        elapsed = time.monotonic() - began
        used.append(processor_time(watcher.pid))
        result = f"{shown} of {state['after'] - first}"
        if not number:
            writer.kill()
            writer.wait()
            result = f"{live['designs']} of {len(read_search(folder))}"
    start, page, quiet, watched = used[0], used[1] - used[0], used[2] - used[1], used[3] - used[2]
    return [
        f"{number:,}" if number else "a search", f"{start:.2f} s", f"{page:.2f} s",
        f"{1000 * quiet / QUIET_ASKS:.1f} ms", f"{100 * watched / elapsed:.2f} %", result,
    ]  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--sizes", nargs="+", type=int, default=[1000, 10_000, 100_000])
    options.add_argument("--rate", type=float, default=2.0)
    options.add_argument("--seconds", type=float, default=120.0)
    options.add_argument("--search", action="store_true")
    options.add_argument("--slowdown", action="store_true")
    options.add_argument("--block", type=float, default=10.0)
    options.add_argument("--write", type=Path)
    options.add_argument("--compute", type=Path)
    given = options.parse_args()
    sizes = [0] if given.search else given.sizes
    if given.write:
        write(given.write, sizes[0], given.rate) if sizes[0] else search(given.write)
    if given.compute:
        compute(given.compute)
    if given.slowdown:
        return slowdown(given.seconds, given.block)
    print("| particles | start | first page | answer without news | share of a core | shown |")
    print("|---|---|---|---|---|---|")
    for number in sizes:
        print(f"| {' | '.join(measure(number, given.rate, given.seconds))} |", flush=True)


if __name__ == "__main__":
    main()
