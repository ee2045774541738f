"""Time per particle-step and memory per particle, from a thousand grains to a million and over worlds.

    python tests/benchmarks/scale.py [--grains 1000 ... 1000000] [--worlds 1 ... 4096] [--threads 2]
        [--turns 3] [--picture docs/scale.png]

Beds of grains at rest within walls (Hertz, Mindlin, contact history), in f64, lists and walls included: a
thousand spheres come to rest in a box ten diameters wide, and a larger bed is many such boxes side by side,
without the walls between them. Batches of worlds with 100 grains each that agglomerate (Zohdi 2004), from
their start. A time is the median of a few turns, wall time over the steps of all particles; memory is the
memory of fields and lists. An option without numbers leaves its part out. Takes some minutes in all.
"""

import argparse
import platform
import resource
import sys
import time
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import granular_bed
import numpy as np
from matplotlib.axes import Axes

import tisim
from tisim.backend import memory, runtime
from tisim.cases.agglomeration.scene import BEST
from tisim.cases.agglomeration.scene import scene as agglomeration
from tisim.effects import Gravity, Walls
from tisim.geometry import Plane
from tisim.plotting.style import empty, letters, plain
from tisim.steppers import FixedStep, Verlet

TILE, WIDTH = 1000, 10.0
"""Grains of a box that come to rest, and its width in diameters."""
PER_WORLD = 100
"""Grains of an agglomerating world."""
STEPS = 1e7
"""Approximate number of particle-steps of a turn."""
BED, BATCH = "#0072b2", "#d55e00"


@dataclass(frozen=True)
class Point:
    """The measurement for one size.

    number : number of grains, or of worlds. seconds : time of a particle-step, in each turn. bytes : memory
    per particle, fields and lists.
    """

    number: int
    seconds: tuple[float, ...]
    bytes: float

    def line(self, what: str) -> str:
        nanoseconds = 1e9 * np.array(self.seconds)
        spread = f"({nanoseconds.min():.0f} .. {nanoseconds.max():.0f})"
        held = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1e6
        return (
            f"{self.number:9d} {what:7s} {np.median(nanoseconds):7.1f} {spread:15s} ns a particle and step; "
            f"{self.bytes:6.0f} bytes a particle; process at most {held:.2f} GB"
        )


def bed(n: int, tile: np.ndarray) -> tisim.Scene:
    """Grains at rest in the necessary number of boxes, side by side, in an arrangement as square as
    possible."""
    boxes = -(-n // TILE)
    across = max(k for k in range(1, int(boxes**0.5) + 1) if boxes % k == 0)
    corners = np.array([(WIDTH * (k % across), WIDTH * (k // across), 0.0) for k in range(boxes)])
    place = (corners[:, None, :] + tile).reshape(-1, 3)[:n]
    x, y = WIDTH * across, WIDTH * (boxes // across)
    walls = (((0, 0, 0), (1, 0, 0)), ((x, 0, 0), (-1, 0, 0)), ((0, 0, 0), (0, 1, 0)))
    walls += (((0, y, 0), (0, -1, 0)), ((0, 0, 0), (0, 0, 1)))
    return tisim.Scene(
        particles=tisim.Particles(
            position=place, velocity=np.zeros_like(place), radius=0.5, mass=granular_bed.MASS
        ),
        materials=granular_bed.MATERIALS,
        effects=(
            granular_bed.LAW,
            Walls(planes=tuple(Plane(point=point, normal=normal) for point, normal in walls)),
            Gravity(acceleration=(0.0, 0.0, -1.0)),
        ),
        stepper=Verlet(control=FixedStep(dt=granular_bed.STEP)),
        duration=1e3,
    )


def measure(scenes: Sequence[tisim.Scene], number: int, turns: int, again: bool) -> Point:
    """Run scenes of one structure side by side, for some turns; ``again`` : each from the start."""
    simulation = tisim.Simulation(scenes[0], worlds=len(scenes))
    simulation.load(scenes)
    particles = sum(len(start["mass"]) for start in simulation.starts)
    steps, seconds = max(4, int(STEPS / particles)), []
    simulation.run(steps=4)
    for _ in range(turns):
        if again:
            simulation.load(scenes)
        before, began = simulation.s.read("particle_steps").sum(), time.perf_counter()
        simulation.run(steps=steps)
        taken = time.perf_counter() - began
        seconds.append(taken / float(simulation.s.read("particle_steps").sum() - before))
    for result in simulation.results():
        assert result.status.ok or result.status.reason == "running", result.status.reason
    held = sum(tree.bytes for tree in memory.in_use() if tree in simulation.trees)
    simulation.close()
    return Point(number, tuple(seconds), held / particles)


def draw(axis: Axes, beds: Sequence[Point], batches: Sequence[Point], what: str) -> None:
    """Draw time or memory over the number of particles."""
    for points, per, colour, marker, label in (
        (beds, 1, BED, "o", "one bed of grains"),
        (batches, PER_WORLD, BATCH, "s", f"worlds of {PER_WORLD} that agglomerate"),
    ):
        x = [point.number * per for point in points]
        if what == "time":
            middle = np.array([1e9 * np.median(point.seconds) for point in points])
            ends = np.array([[1e9 * min(point.seconds), 1e9 * max(point.seconds)] for point in points])
            spread = np.abs(ends.reshape(-1, 2).T - middle)
            axis.errorbar(x, middle, yerr=spread, color=colour, marker=marker, ms=4, capsize=2, label=label)
        else:
            axis.plot(x, [point.bytes for point in points], color=colour, marker=marker, ms=4, label=label)
    axis.set(xscale="log", yscale="log", xlabel="particles")
    plain(axis)


def picture(beds: Sequence[Point], batches: Sequence[Point], path: Path) -> None:
    """Draw time per particle-step and memory per particle over the number of particles."""
    figure = empty(8.5, 3.4)
    axes = figure.subplots(1, 2)
    draw(axes[0], beds, batches, "time")
    draw(axes[1], beds, batches, "memory")
    axes[0].set(ylabel="wall time (ns)", title="a step of a particle", ylim=(10, 3000))
    axes[1].set(ylabel="bytes", title="fields and lists of a particle", ylim=(100, 10_000))
    axes[0].legend(frameon=False, fontsize=8, loc="lower left")
    letters(axes)
    figure.savefig(path, dpi=100)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0] if __doc__ else None)
    parser.add_argument("--grains", type=int, nargs="*", default=[1000, 10_000, 100_000, 1_000_000])
    parser.add_argument("--worlds", type=int, nargs="*", default=[1, 8, 64, 512, 4096])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--turns", type=int, default=3)
    parser.add_argument("--picture", type=Path)
    options = parser.parse_args()
    tisim.init(threads=options.threads)
    print(f"{runtime.backend()}, {options.threads} threads, {platform.processor() or platform.machine()}")
    beds, batches = [], []
    if options.grains:
        granular_bed.GRAVITY = (0.0, 0.0, -1.0)
        tile = granular_bed.settled(TILE, WIDTH)
        for n in options.grains:
            beds.append(measure([bed(n, tile)], n, options.turns, again=False))
            print(beds[-1].line("grains"), flush=True)
    for worlds in options.worlds:
        scenes = [agglomeration(BEST, seed, grains=PER_WORLD) for seed in range(worlds)]
        batches.append(measure(scenes, worlds, options.turns, again=True))
        print(batches[-1].line("worlds"), flush=True)
    if options.picture:
        picture(beds, batches, options.picture)


if __name__ == "__main__":
    main()
