"""Time of a particle-step on a device, by the number of particles and of worlds: a dated record.

    python tests/benchmarks/scaling.py [--device cpu] [--precision f64] [--most 1000000] [--worlds 4096]
        [--limit 240]

Bed: a lattice of grains (Hertz and Mindlin, five walls) that collapses, lists included. Worlds: 60 grains
that agglomerate, side by side. Near field, dipoles: all pairs. Blast: particles without interaction.
Captures: worlds of 100 Brownian particles in the field of a cylinder. Each is compiled, run for a moment, and
timed for about a second. Measurements that would begin after the limit (s) are skipped.
"""

import argparse
import platform
import shutil
import subprocess
import sys
import time
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import dipole_dipole
import granular_bed
import near_field
import numpy as np

import tisim
from tisim.backend import runtime
from tisim.cases.agglomeration import CASE as AGGLOMERATION
from tisim.cases.blast.scene import scene as blast
from tisim.cases.capture.scene import scene as capture

SECONDS = 1.0
"""Approximate length of a measurement."""
QUERIES = {
    "cuda": ["nvidia-smi", "--query-gpu=name,driver_version", "--format=csv,noheader"],
    "vulkan": ["vulkaninfo", "--summary"],
}
"""Commands that describe a device; the second prints the names of device and driver."""


def described(device: str) -> str:
    """Name and driver of a device, if a command tells them."""
    query = QUERIES.get(device, [])
    if not query or not shutil.which(query[0]):
        return platform.processor() or platform.machine()
    lines = subprocess.run(query, capture_output=True, text=True, check=False).stdout.splitlines()
    named = [line.split("=", 1)[-1].strip() for line in lines if "deviceName" in line or "driverInfo" in line]
    return "; ".join(named or lines)


def bed(n: int) -> tisim.Scene:
    """A lattice of ``n`` grains, above the floor."""
    width = granular_bed.WIDTH * (n / 8000) ** 0.5
    position = granular_bed.lattice(n, width)
    return granular_bed.scene(position, np.zeros_like(position), width)


def near(n: int) -> tisim.Scene:
    """``n`` charges that interact at any distance."""
    return near_field.scene(*near_field.start(n))


def timed(scenes: list[tisim.Scene]) -> tuple[float, float]:
    """Time of a particle-step, ns, and of compilation, s."""
    began = time.perf_counter()
    simulation = tisim.Simulation(scenes[0], worlds=len(scenes))
    simulation.load(scenes)
    simulation.run(steps=2)
    compiling = time.perf_counter() - began
    steps, taken, done = 4, 0.0, -sum(result.work["particle_steps"] for result in simulation.results())
    while taken < SECONDS / 2 and len(simulation.ended()) < len(scenes):
        steps *= 2
        began = time.perf_counter()
        simulation.run(steps=steps)
        taken += time.perf_counter() - began
    done += sum(result.work["particle_steps"] for result in simulation.results())
    simulation.close()
    return taken / max(done, 1) * 1e9, compiling


def sizes(most: int, first: int) -> Iterator[int]:
    """Powers of ten times the first, up to ``most``."""
    while first <= most:
        yield first
        first *= 10


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--device", default="cpu", choices=runtime.DEVICES)
    parser.add_argument("--precision", default="f64", choices=runtime.PRECISIONS)
    parser.add_argument("--most", type=int, default=10**6)
    parser.add_argument("--worlds", type=int, default=4096)
    parser.add_argument("--limit", type=float, default=240.0)
    options = parser.parse_args()
    tisim.init(device=options.device, precision=options.precision)
    print(f"{datetime.now(UTC):%Y-%m-%d}, {options.device}: {described(options.device)}; {runtime.backend()}")
    print(f"tisim {tisim.__version__}, python {platform.python_version()}, {options.precision}\n")
    print(f"{'work':14}{'worlds':>8}{'particles':>11}{'ns/particle-step':>18}{'compiling, s':>14}")
    grains = AGGLOMERATION.scene(next(iter(AGGLOMERATION.sizes)), 0)
    captured = capture(75, 0.0, 20.0, duration=500.0)
    rows: list[tuple[str, int, Callable[[int], list[tisim.Scene]]]] = [
        *(("bed", n, lambda n: [bed(n)]) for n in sizes(options.most, 1000)),
        *(("worlds", n, lambda n: [grains] * n) for n in (1, 16, 256, 4096) if n <= options.worlds),
        *(("near field", n, lambda n: [near(n)]) for n in (1000, 4000) if n <= options.most),
        *(("blast", n, lambda n: [blast(number=n)]) for n in sizes(options.most // 10, 1000)),
        *(("dipoles", n, lambda n: [dipole_dipole.scene(n)]) for n in (1000, 4000) if n <= options.most),
        *(("captures", n, lambda n: [captured] * n) for n in (1, 256) if n <= options.worlds),
    ]
    end = time.perf_counter() + options.limit
    for work, n, make in rows:
        if time.perf_counter() > end:
            print(f"{work:14}{n:>8} left out: over the limit", flush=True)
            continue
        scenes = make(n)
        each, compiling = timed(scenes)
        particles = sum(scene.capacity() for scene in scenes)
        print(f"{work:14}{len(scenes):>8}{particles:>11}{each:>18.1f}{compiling:>14.1f}", flush=True)


if __name__ == "__main__":
    main()
