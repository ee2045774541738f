"""Processor time of ``tisim watch`` while a run writes frames and a browser asks for them.

    python tests/benchmarks/watch_cost.py [--sizes 1000 10000 100000] [--rate 2] [--seconds 60]

A process writes RATE frames a second of grains that move, and this one asks as a page does, every 2 s. The
table has the processor time of the watcher, from /proc (Linux): of its start with all imports, of the first
page, of an answer without a new frame, and of all answers during SECONDS as a share of one core; and the
frames that were shown, of those that were written.
"""

import argparse
import json
import os
import re
import subprocess
import sys
import tempfile
import time
import urllib.request
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.watch.conftest import Growing
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


def measure(number: int, rate: float, seconds: float) -> list[str]:
    with tempfile.TemporaryDirectory() as name:
        order = [sys.executable, __file__, "--write", name, "--sizes", str(number), "--rate", str(rate)]
        writer = subprocess.Popen(order, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True)
        assert writer.stdin
        assert writer.stdout
        writer.stdout.readline()
        order = [sys.executable, "-m", "tisim", "watch", name, "--no-open"]
        watcher = subprocess.Popen(order, stdout=subprocess.PIPE, stderr=subprocess.DEVNULL, text=True)
        assert watcher.stdout
        try:
            address = watcher.stdout.readline().strip()
            used = [processor_time(watcher.pid)]
            page = answer(address).decode()
            used.append(processor_time(watcher.pid))
            found = re.search(r'id="facts">(.*?)</script>', page, re.S)
            assert found
            live = json.loads(found[1])["live"]
            ask = f"{address}news?key={live['key']}&after="
            for _ in range(QUIET_ASKS):
                answer(f"{ask}{live['after']}")
            used.append(processor_time(watcher.pid))
            writer.stdin.write("\n")
            writer.stdin.flush()
            after, shown, began = live["after"], 0, time.monotonic()
            while time.monotonic() < began + seconds:
                news = json.loads(answer(f"{ask}{after}"))
                after, shown = news.get("after", after), shown + news.get("shown", 0)
                time.sleep(POLL)
            elapsed = time.monotonic() - began
            used.append(processor_time(watcher.pid))
        finally:
            for process in (watcher, writer):
                process.kill()
                process.wait()
    start, first, quiet, watched = used[0], used[1] - used[0], used[2] - used[1], used[3] - used[2]
    return [
        f"{number:,}", f"{start:.2f} s", f"{first:.2f} s", f"{1000 * quiet / QUIET_ASKS:.1f} ms",
        f"{100 * watched / elapsed:.2f} %", f"{shown} of {after - live['after']}",
    ]  # fmt: skip


def main() -> None:
    options = argparse.ArgumentParser(description=__doc__)
    options.add_argument("--sizes", nargs="+", type=int, default=[1000, 10_000, 100_000])
    options.add_argument("--rate", type=float, default=2.0)
    options.add_argument("--seconds", type=float, default=60.0)
    options.add_argument("--write", type=Path)
    given = options.parse_args()
    if given.write:
        write(given.write, given.sizes[0], given.rate)
    print("| particles | start | first page | answer without news | share of a core | frames shown |")
    print("|---|---|---|---|---|---|")
    for number in given.sizes:
        print(f"| {' | '.join(measure(number, given.rate, given.seconds))} |", flush=True)


if __name__ == "__main__":
    main()
