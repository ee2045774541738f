"""The field of a magnetised cylinder beside magpylib: error, and points per second on one core, in one run.

    python tests/benchmarks/cylinder_field.py [--points 100000] [--repeats 7] [--arithmetic strict]

Field, or field and gradient, exact or from tables. magpylib has no gradient, so it computes six more fields
for central differences. Runs are interleaved, and the fastest of each counts. Points lie around a cylinder
of L/D 5/3 (B16 6.3), outside it and within three diameters, like particles about to be captured. Errors are
relative to magpylib's values. The error of a gradient is at least the error of its field over the step of the
differences, 1e-5 radii.
"""

import argparse
import sys
import time
from pathlib import Path

import magpylib
import numpy as np

sys.path.insert(0, str(Path(__file__).parents[2]))

from tisim.backend import runtime
from tisim.backend.taichi import ti
from tisim.backend.thread import in_taichi_thread
from tisim.sources import Cylinder, MagneticCylinders
from tisim.sources.sampling import TILE_POINTS
from tisim.state.bound import connected
from tisim.state.parameter_table import ParameterTable

RADIUS, LENGTH, M = 300e-6, 1000e-6, (985e3 * 0.6, 0.0, 985e3 * 0.8)


@in_taichi_thread
@ti.kernel
def sample(source: ti.template(), slopes: ti.template(), r: ti.types.ndarray(), out: ti.types.ndarray()):
    """As tisim.sources.sample, but without gradients if ``slopes`` is off."""
    points = r.shape[0]
    for first in range((points + TILE_POINTS - 1) // TILE_POINTS):
        place = [ti.Vector([0.0] * TILE_POINTS) for _ in ti.static(range(3))]
        value = [ti.Vector([0.0] * TILE_POINTS) for _ in ti.static(range(3))]
        gradient = [ti.Vector([0.0] * TILE_POINTS) for _ in ti.static(range(9 * slopes))]
        for lane in range(TILE_POINTS):
            for a in ti.static(range(3)):
                place[a][lane] = r[ti.min(first * TILE_POINTS + lane, points - 1), a]
        source.add_tile(0, place, 0.0, value, gradient)
        for lane in range(ti.min(TILE_POINTS, points - first * TILE_POINTS)):
            for a in ti.static(range(3)):
                out[first * TILE_POINTS + lane, 0, a] = value[a][lane]
                for c in ti.static(range(3 * slopes)):
                    out[first * TILE_POINTS + lane, 1 + c, a] = gradient[3 * a + c][lane]


def bound(digits):
    source = MagneticCylinders(
        cylinders=[Cylinder(radius=RADIUS, length=LENGTH, magnetisation=M)], table_digits=digits
    )
    table = ParameterTable([source], 1, runtime.current().real)
    (magnets,) = connected([table.bind(source)])
    table.write([[source]])
    # With the table, whose memory must live equally long.
    return table, magnets


def relative(values, expected):
    """Largest and median error relative to the expected vector or matrix of each point."""
    axes = tuple(range(1, values.ndim))
    off = np.sqrt(((values - expected) ** 2).sum(axes) / (expected**2).sum(axes))
    return f"  {off.max():9.1e} {np.median(off):8.1e}"


def compare(points, repeats):
    magnet = magpylib.magnet.Cylinder(magnetization=M, dimension=(2 * RADIUS, LENGTH))
    step = 1e-5 * RADIUS

    def around(r):
        steps = [s * step * np.eye(3)[c] for c in range(3) for s in (1, -1)]
        return magnet.getB(r), [magnet.getB(r + d) for d in steps]

    rng = np.random.default_rng(0)
    r = rng.uniform(-6 * RADIUS, 6 * RADIUS, (points, 3))
    r = np.ascontiguousarray(r[(np.hypot(*r.T[:2]) > RADIUS) | (np.abs(r[:, 2]) > LENGTH / 2)])
    runs = {"magpylib, field": lambda: magnet.getB(r), "magpylib, and gradient": lambda: around(r)}
    out = {}
    for name, digits in (("exact", None), ("4 digits", 4), ("3 digits", 3)):
        table, source = bound(digits)
        for label, slopes in (("field", 0), ("field and gradient", 1)):
            out[f"{name}, {label}"] = np.zeros((len(r), 4, 3))
            runs[f"{name}, {label}"] = lambda k=slopes, s=source, o=out[f"{name}, {label}"], _=table: sample(
                s, k, r, o
            )
    for run in runs.values():
        run()
    best = dict.fromkeys(runs, np.inf)
    for _ in range(repeats):
        for name, run in runs.items():
            began = time.perf_counter()
            run()
            best[name] = min(best[name], time.perf_counter() - began)
    b, beside = around(r)
    gradient = (np.stack(beside[::2], axis=1) - np.stack(beside[1::2], axis=1)) / (2 * step)
    print(f"{'':69s}  of B, largest error and median; of its gradient")
    for name, seconds in best.items():
        peer = best["magpylib, and gradient" if "gradient" in name else "magpylib, field"]
        error = ""
        if name in out:
            error = relative(out[name][:, 0], b)
            if "gradient" in name:
                error += relative(out[name][:, 1:], gradient)
        rate = len(r) / seconds
        print(f"{name:28s} {rate:10.3g} points/s  {1e9 / rate:6.0f} ns  {peer / seconds:6.1f} x{error}")


if __name__ == "__main__":
    parser = argparse.ArgumentParser()
    parser.add_argument("--points", type=int, default=100_000)
    parser.add_argument("--repeats", type=int, default=7)
    parser.add_argument("--arithmetic", choices=runtime.ARITHMETICS, default="strict")
    options = parser.parse_args()
    runtime.init(device="cpu", threads=1, arithmetic=options.arithmetic)
    print(runtime.backend(), options.arithmetic, "magpylib", magpylib.__version__)
    compare(options.points, options.repeats)
