"""The core time of a grain and step of mrf_shear, in L21's own cells, beside L21's.

    python tests/benchmarks/mrf_cost.py [--sizes l21 ...] [--steps 300] [--repeats 5] [--one-sweep]

L21 section 2.4.3 prints the wall time of a step, the number of cores, of grains and of neighbours of a grain
for six simulations; the sizes l21, l21_monodisperse, l21_volume and l21_bidisperse have the cells of four of
them. Each is run from its random start, before grains form chains, on one thread. After a tenth of the steps,
which are not timed, the CPU time of ``steps`` steps is taken ``repeats`` times, and the median is printed
with the least and the largest value: other programs on the processor take wall time, not CPU time. Neighbours
are counted at the start, within the sum of the radii and 8 um, the range over which grains magnetise and
attract each other. Placing the grains of l21_bidisperse takes some minutes.

L21 takes one sweep of the moments in a step. tisim takes more in steps in which a moment changes by more than
1 %, such as the first of equal grains; with --one-sweep it takes one, too.
"""

from __future__ import annotations

import argparse
import sys
import time
from contextlib import closing
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.spatial import cKDTree

import tisim
from tisim import Scene, Simulation
from tisim.backend import runtime
from tisim.cases.mrf_shear import published
from tisim.cases.mrf_shear.scene import SIZES, scene

LARGEST_CHANGE = "effects.mutual_induced_moment.largest_change"
"""The setting for the change of a moment, over its value, from which a step has more sweeps."""
ONE_SWEEP = 2.0
"""Its value with which every step has one sweep."""
MODELS = tuple(name for name in published.COSTS if name in SIZES)


def neighbours(scene: Scene, gap: float = published.NEIGHBOUR_GAP) -> float:
    """Return the mean number of grains whose surface is within a gap (m) of that of a grain, in a cell that
    is periodic along x and y."""
    start = scene.start()
    place, radius = start["position"], start["radius"]
    low, high = np.array(scene.domain.low), np.array(scene.domain.high)
    # Without images along z: a period beyond the reach.
    period = high - low + np.array([0.0, 0.0, 2 * (gap + 2 * radius.max())])
    tree = cKDTree(place - low, boxsize=period)
    number = 0
    # Larger grains first, so that the reach shrinks; each pair is found from its larger grain.
    for i in np.argsort(-radius, kind="stable"):
        others = np.array(tree.query_ball_point(place[i] - low, 2 * radius[i] + gap))
        apart = place[others] - place[i]
        apart[:, :2] -= period[:2] * np.round(apart[:, :2] / period[:2])
        near = np.linalg.norm(apart, axis=1) <= radius[i] + radius[others] + gap
        smaller = (radius[others] < radius[i]) | ((radius[others] == radius[i]) & (others > i))
        number += int((near & smaller).sum())
    return 2 * number / len(place)


def core_times(scene: Scene, steps: int, repeats: int) -> tuple[np.ndarray, float]:
    """Return the CPU time of a grain and step (s), of each repeat, and the sweeps of a step."""
    times = []
    with closing(Simulation(scene)) as simulation:
        simulation.load([scene])
        simulation.run(steps=max(steps // 10, 2))
        for _ in range(repeats):
            began = time.process_time()
            simulation.run(steps=steps)
            times.append(time.process_time() - began)
        simulation.results()[0].check()
        result = simulation.results()[0]
        number, work = len(result.state["mass"]), result.work
    return np.array(times) / (steps * number), work["mutual_sweeps"] / work["steps"]


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n\n")[0])
    parser.add_argument("--sizes", nargs="+", choices=MODELS, default=["l21", "l21_monodisperse"])
    parser.add_argument("--steps", type=int, default=300)
    parser.add_argument("--repeats", type=int, default=5)
    parser.add_argument("--one-sweep", action="store_true", help="one sweep of the moments in each step")
    options = parser.parse_args()
    tisim.init(threads=1)
    print(f"{runtime.backend()}, one thread; core time of a grain and step in us, of neighbours in ns")
    for size in options.sizes:
        made, theirs = scene(**SIZES[size].scene), published.COSTS[size]
        if options.one_sweep:
            made = made.replace({LARGEST_CHANGE: ONE_SWEEP})
        near = neighbours(made)
        times, sweeps = core_times(made, options.steps, options.repeats)
        each = 1e6 * times
        median, printed = np.median(each), 1e6 * theirs.core_time
        print(
            f"{size}: {median:.3g} ({each.min():.3g} .. {each.max():.3g}), L21 {printed:.3g}, "
            f"over ours {printed / median:.3g}; {sweeps:.3g} sweeps of a step; "
            f"{len(made.start()['mass'])} grains, L21 {theirs.grains}; "
            f"{near:.0f} neighbours, L21 {theirs.neighbours}; "
            f"a neighbour {1e3 * median / near:.3g}, L21 {1e3 * printed / theirs.neighbours:.3g}",
            flush=True,
        )


if __name__ == "__main__":
    main()
