"""The field and gradient of many magnetised fibres at many particles: time and error of each way to sum.

    python tests/benchmarks/many_fibres.py [--points 10000] [--fibres 10 100 300] [--repeats 3]

Fibres of L/D 10 (B16 chapter 7: 0.4 mm by 4 mm) at random in a cube, at a volume fraction of 0.3. Each way
gives field and gradient at particles, one by one as in a run, and by tiles of 16 points as in
``tisim.sources.sample``; magpylib has no gradient, so it computes the field alone. Runs are interleaved, and
the fastest of each counts. Times are CPU time, and the time to compile is left out. Errors are the largest
over the mean magnitude, of the field and of the gradient.
"""

import argparse
import sys
import time
from pathlib import Path

import magpylib
import numpy as np
from scipy.spatial.transform import Rotation

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.sources import Cylinder, MagneticCylinders, magnetise
from tisim.sources.magnetic.cell_sum import cell_row
from tisim.sources.sampling import TILE_POINTS
from tisim.state.bound import connected
from tisim.state.parameter_table import ParameterTable

RADIUS, LENGTH, FRACTION, SATURATION, APPLIED = 2e-4, 4e-3, 0.3, 985e3, (0.95, 0.0, 0.0)
WAYS = {
    "one by one": (None, None), "one by one, table of 3 digits": (3, None),
    "cells, 2 digits": (None, 2), "cells, 3 digits": (None, 3), "cells and table, 3 digits": (3, 3),
    "cells, 4 digits": (None, 4),
}  # fmt: skip


@in_taichi_thread
@ti.kernel
def singly(source: ti.template(), r: ti.types.ndarray(), out: ti.types.ndarray()):
    for i in range(r.shape[0]):
        b, slope = source.value_and_gradient(0, ti.Vector([r[i, 0], r[i, 1], r[i, 2]]), 0.0)
        for a in ti.static(range(3)):
            out[i, 0, a] = b[a]
            for c in ti.static(range(3)):
                out[i, 1 + c, a] = slope[a, c]


@in_taichi_thread
@ti.kernel
def by_tiles(source: ti.template(), r: ti.types.ndarray(), out: ti.types.ndarray()):
    for first in range(r.shape[0] // TILE_POINTS):
        place = [ti.Vector([0.0] * TILE_POINTS) for _ in ti.static(range(3))]
        value = [ti.Vector([0.0] * TILE_POINTS) for _ in ti.static(range(3))]
        gradient = [ti.Vector([0.0] * TILE_POINTS) for _ in ti.static(range(9))]
        for lane in range(TILE_POINTS):
            for a in ti.static(range(3)):
                place[a][lane] = r[first * TILE_POINTS + lane, a]
        source.add_tile(0, place, 0.0, value, gradient)
        for lane in range(TILE_POINTS):
            for a in ti.static(range(3)):
                out[first * TILE_POINTS + lane, 0, a] = value[a][lane]
                for c in ti.static(range(3)):
                    out[first * TILE_POINTS + lane, 1 + c, a] = gradient[3 * a + c][lane]


def packing(rng, n):
    """Magnetised fibres in a cube, and the side of the cube (m)."""
    side = (n * np.pi * RADIUS**2 * LENGTH / FRACTION) ** (1 / 3)
    centres, axes = rng.uniform(-side / 2, side / 2, (n, 3)), rng.normal(size=(n, 3))
    bare = [
        Cylinder(centre=r, axis=e, radius=RADIUS, length=LENGTH) for r, e in zip(centres, axes, strict=True)
    ]
    return magnetise(bare, APPLIED, SATURATION), side


def bound(cylinders, table_digits, sum_digits):
    source = MagneticCylinders(cylinders=cylinders, table_digits=table_digits, sum_digits=sum_digits)
    table = ParameterTable([source], 1, runtime.current().real)
    (magnets,) = connected([table.bind(source)])
    table.write([[source]])
    # With the table, whose memory must live equally long.
    return table, magnets


def by_magpylib(cylinders, r):
    total = np.zeros_like(r)
    for one in cylinders:
        turned = Rotation.align_vectors([one.axis], [[0, 0, 1]])[0]
        magnet = magpylib.magnet.Cylinder(
            magnetization=turned.inv().apply(one.magnetisation), dimension=(2 * one.radius, one.length),
            position=one.centre, orientation=turned,
        )  # fmt: skip
        total += magnet.getB(r)
    return total


def compare(n, points, repeats):
    rng = np.random.default_rng(0)
    cylinders, side = packing(rng, n)
    r = rng.uniform(-side / 2, side / 2, (points // TILE_POINTS * TILE_POINTS, 3))
    runs, out, built = {}, {}, {}
    for name, (table_digits, sum_digits) in WAYS.items():
        began = time.process_time()
        if sum_digits:
            cell_row(cylinders, sum_digits)
        built[name] = time.process_time() - began
        table, source = bound(cylinders, table_digits, sum_digits)
        for how, kernel in (("", singly), (", tiles", by_tiles)):
            out[name + how] = np.zeros((len(r), 4, 3))
            runs[name + how] = lambda k=kernel, s=source, o=out[name + how], _=table: k(s, r, o)
    runs["magpylib, field alone"] = lambda: by_magpylib(cylinders, r)
    best = dict.fromkeys(runs, np.inf)
    for turn in range(repeats + 1):
        for name, run in runs.items():
            began = time.process_time()
            run()
            if turn:
                best[name] = min(best[name], time.process_time() - began)
    expected = out["one by one"]
    size = np.linalg.norm(expected[:, 0], axis=1).mean(), np.linalg.norm(expected[:, 1:], axis=(1, 2)).mean()
    print(f"{n} fibres", " " * 20, "ns per particle     relative   error of B, gradient   to prepare")
    for name, seconds in best.items():
        error = ""
        if name in out and name != "one by one":
            off = out[name] - expected
            error = f"{np.linalg.norm(off[:, 0], axis=1).max() / size[0]:8.1e}"
            error += f" {np.linalg.norm(off[:, 1:], axis=(1, 2)).max() / size[1]:8.1e}"
        prepared = f"{built[name]:.1f} s" if built.get(name, 0) > 0.05 else ""
        speed = best["one by one"] / seconds
        print(f"{name:40s} {1e9 * seconds / len(r):9.0f} {speed:8.1f} x   {error:20s} {prepared}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--points", type=int, default=10_000)
    parser.add_argument("--fibres", type=int, nargs="+", default=[10, 100, 300])
    parser.add_argument("--repeats", type=int, default=3)
    options = parser.parse_args()
    runtime.init(device="cpu", threads=1)
    print(runtime.backend(), "magpylib", magpylib.__version__)
    for number in options.fibres:
        compare(number, options.points, options.repeats)
