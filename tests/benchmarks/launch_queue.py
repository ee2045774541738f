"""Compare two ways to launch the kernels of a step on a device, side by side.

    python tests/benchmarks/launch_queue.py [--device cuda] [--precision f64] [--pairs 3] [--limit 200]

Queued: the launches of up to eight steps are queued, and then the progress of the worlds is read. Asking: the
progress is read after each launch, as on a CPU, so that no launch finds all worlds waiting. The table has the
medians of alternating runs. Scenes that would begin after the limit (s) are skipped.
"""

import argparse
import statistics
import sys
import time
from pathlib import Path
from typing import Any

sys.path.insert(0, str(Path(__file__).parents[2]))

from scaling import bed, described, timed

import tisim
from tisim.cases.agglomeration.scene import BEST
from tisim.cases.agglomeration.scene import scene as agglomeration
from tisim.program.launched_program import LaunchedProgram

asking = False
made = LaunchedProgram.__init__


def choosing(program: LaunchedProgram, *arguments: Any, **named: Any) -> None:
    """Make a program that launches in the way that is to be timed."""
    made(program, *arguments, **named)
    program.asks = asking


def worlds(number: int) -> list[tisim.Scene]:
    """Worlds of 60 grains that agglomerate."""
    return [agglomeration(BEST, seed, 60) for seed in range(number)]


def main() -> None:
    global asking
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--device", default="cuda")
    parser.add_argument("--precision", default="f64")
    parser.add_argument("--pairs", type=int, default=3)
    parser.add_argument("--limit", type=float, default=200.0)
    options = parser.parse_args()
    tisim.init(options.device, options.precision)
    LaunchedProgram.__init__ = choosing  # type: ignore[method-assign]
    print(described(options.device))
    print("| scene | queued, ns/particle-step | asking | asking / queued |\n|---|---|---|---|")
    begun = time.perf_counter()
    for name, scenes in {
        "bed of 100 grains": [bed(100)],
        "bed of 1,000": [bed(1000)],
        "bed of 10,000": [bed(10_000)],
        "16 worlds of 60 that agglomerate": worlds(16),
        "1,024 worlds of 60": worlds(1024),
    }.items():
        if time.perf_counter() - begun > options.limit:
            break
        taken: dict[bool, list[float]] = {False: [], True: []}
        for _ in range(options.pairs):
            for asking in (False, True):
                taken[asking].append(timed(scenes)[0])
        queued, asked = (statistics.median(taken[one]) for one in (False, True))
        print(f"| {name} | {queued:.4g} | {asked:.4g} | {asked / queued:.2f} |", flush=True)


if __name__ == "__main__":
    main()
