"""The speed of a filter by the number of its fibres: particle-steps a second of a whole scene.

    python tests/benchmarks/filter_speed.py [--fibres 10 100 300] [--colloids 2000] [--repeats 3]

Static separation among some fibres and images of the default size of packed_filter, which are nearest to the
middle of the matrix: colloids diffuse, are drawn to fibres and captured. The field is summed fibre by fibre,
with closed forms and with a table, and by cells. Times are CPU time of one thread, the least of the repeats;
the time to compile, to build the octree and to pack is left out.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

import tisim
from tisim.backend import runtime
from tisim.backend.processor import processor
from tisim.cases.packed_filter.scene import filter_of
from tisim.sources import MagneticCylinders
from tisim.sources.magnetic.cell_sum import cell_row

WAYS = {
    "one by one": (None, None),
    "one by one, table of 3 digits": (3, None),
    "cells, 2 digits": (None, 2),
    "cells, 3 digits": (None, 3),
}
DURATION = 5.0
"""Simulated time of a run, s."""


def scenes(fibres, colloids):
    """The scene of some of the fibres, for each way to sum their field."""
    made = filter_of("default", "static", number=colloids, duration=DURATION)
    magnets = made.magnets()
    centre = np.array([one.centre for one in magnets])
    nearest = np.argsort(np.linalg.norm(centre - (0.0, 0.0, made.matrix.depth / 2), axis=1))
    chosen = tuple(magnets[k] for k in nearest[:fibres])
    scene = made.scene_about(chosen, chosen, made.box(), 0)
    for name, way in WAYS.items():
        effects = tuple(
            one.with_digits(*way) if isinstance(one, MagneticCylinders) else one for one in scene.effects
        )
        yield name, scene.model_copy(update={"effects": effects}), chosen, way[1]


def main(options):
    runtime.init(threads=1)
    print(f"{processor().get('model name', 'processor')}, CPU time of one thread")
    print(f"{'fibres':>6} {'sum':32} {'us a particle-step':>18} {'particle-steps/s':>18} {'octree (s)':>10}")
    for fibres in options.fibres:
        for name, scene, magnets, digits in scenes(fibres, options.colloids):
            begun = time.process_time()
            if digits is not None:
                cell_row(magnets, digits)
            octree, best, steps = time.process_time() - begun, np.inf, 0
            tisim.run(scene)
            for _ in range(options.repeats):
                begun = time.process_time()
                steps = tisim.run(scene).work["particle_steps"]
                best = min(best, time.process_time() - begun)
            each = best / steps
            print(f"{fibres:6d} {name:32} {1e6 * each:18.2f} {1 / each:18.3g} {octree:10.1f}", flush=True)


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--fibres", type=int, nargs="+", default=[10, 100, 300])
    parser.add_argument("--colloids", type=int, default=2000)
    parser.add_argument("--repeats", type=int, default=3)
    main(parser.parse_args())
