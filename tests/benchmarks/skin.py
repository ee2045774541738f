"""CPU time of whole runs with a given neighbour-list skin, over the time with the automatic one: grains that
slide down a slope (case avalanche, without a field), and dipoles in a sheared cell (case mrf_shear, size
small).

    python tests/benchmarks/skin.py [--skins 0.05 0.1 0.2 0.4] [--repeats 5]

Skins are in diameters of the largest grain. Runs of all skins take turns, on one thread; ratios are medians
over turns, with the smallest and the largest. TISIM_BACKEND names the kernel compiler.
"""

import argparse
import sys
import time
from contextlib import closing
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.benchmarks.turns import spread
from tisim import Scene, Simulation
from tisim.backend import runtime
from tisim.cases.avalanche import scene as avalanche
from tisim.cases.avalanche.scene import DEFAULT
from tisim.cases.mrf_shear import scene as mrf_shear

SCENES = {
    "avalanche": lambda: avalanche.scene(DEFAULT, field=0.0),
    "mrf_shear": lambda: mrf_shear.scene(**mrf_shear.SEARCHED),
}


def compare(scene: Scene, skins: list[float], repeats: int) -> None:
    """Print a row for each skin; the first is the automatic one."""
    with closing(Simulation(scene)) as simulation:
        diameter = 2 * float(scene.start()["radius"].max())
        made = {None: scene} | {skin: scene.replace({"skin": skin * diameter}) for skin in skins}
        times: dict[float | None, list[float]] = {skin: [] for skin in made}
        for one in made.values():
            simulation.load(one)
            simulation.run()
        for _ in range(repeats):
            for skin, one in made.items():
                simulation.load(one)
                began = time.process_time()
                simulation.run()
                times[skin].append(time.process_time() - began)
                (result,) = simulation.results()
                assert result.status.ok, result.status.reason
    for skin, seconds in times.items():
        ratio = spread(a / b for a, b in zip(seconds, times[None], strict=True))
        print(f"  {'chosen' if skin is None else skin}: {spread(seconds)} s, over chosen {ratio}", flush=True)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--skins", type=float, nargs="+", default=[0.05, 0.1, 0.2, 0.4])
    parser.add_argument("--repeats", type=int, default=5)
    options = parser.parse_args()
    runtime.init(threads=1)
    print(runtime.backend())
    for name, made in SCENES.items():
        print(name, flush=True)
        compare(made(), options.skins, options.repeats)


if __name__ == "__main__":
    main()
