"""Memory and time over many scenes of changing structure: compilation for each, and the memory that remains.

    python tests/benchmarks/changing_structure.py --scenes 1000

Each scene has exponents of its law and a number of particles that hardly any scene before it had, so nearly
all are compiled. A line for each hundred scenes has the seconds per scene, the memory of the process, and the
number of field trees made and of starts of Taichi to that point.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Iterator
from pathlib import Path

import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

import tisim
from tisim import Particles, Scene
from tisim.backend import memory, runtime
from tisim.effects import NearField
from tisim.steppers import FixedStep, Verlet

PAGE = 4096


def resident() -> float:
    """Memory of this process, MB."""
    return int(Path("/proc/self/statm").read_text().split()[1]) * PAGE / 1e6


def scenes(number: int, seed: int = 1) -> Iterator[Scene]:
    """Small scenes, most of them with a structure of their own. Forces are weak: no step is too long."""
    draw = np.random.Generator(np.random.Philox(seed))
    for _ in range(number):
        n, near, far = (int(k) for k in (draw.integers(2, 40), draw.integers(1, 20), draw.integers(21, 40)))
        yield Scene(
            particles=Particles(
                position=draw.uniform(size=(n, 3)), velocity=np.zeros((n, 3)), radius=0.01, mass=1.0
            ),
            effects=(NearField(alpha1=1e-40, beta1=near, alpha2=0.0, beta2=far),),
            stepper=Verlet(control=FixedStep(dt=0.5)),
            duration=1.0,
        )


def soak(number: int, every: int) -> Iterator[tuple[int, float, float]]:
    """Run ``number`` scenes; after each ``every`` of them, yield the number of scenes, seconds per scene, and
    memory in MB."""
    began = time.perf_counter()
    for count, scene in enumerate(scenes(number), 1):
        assert tisim.run(scene).status.ok
        if count % every == 0:
            yield count, (time.perf_counter() - began) / every, resident()
            began = time.perf_counter()


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--scenes", type=int, default=1000)
    parser.add_argument("--every", type=int, default=100)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument(
        "--trees", type=int, default=memory.MAX_TREES_PER_START, help="trees after which Taichi starts anew"
    )
    options = parser.parse_args()
    memory.MAX_TREES_PER_START = options.trees
    runtime.init(threads=options.threads)
    print(f"{runtime.backend()}\n{'scenes':>8}{'s each':>9}{'MB':>8}{'trees':>8}{'starts':>8}")
    for count, seconds, size in soak(options.scenes, options.every):
        number_of_trees, starts = memory.tree_count(), runtime.generation()
        print(f"{count:8d}{seconds:9.2f}{size:8.0f}{number_of_trees:8d}{starts:8d}", flush=True)


if __name__ == "__main__":
    main()
