"""Time of one sum of the forces between dipoles over all pairs, beside a numba loop.

    python tests/benchmarks/dipole_dipole.py [--number 1000] [--precision f64] [--threads 1] [--repeats 9]
        [--arithmetic strict]

Random moments on a disturbed lattice. For tisim the time of a whole step is measured, for numba the time of
the sum alone. Tries alternate; the ratio is the median over them. TISIM_BACKEND names the kernel compiler.
"""

import argparse
import os
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))
os.environ.setdefault("NUMBA_THREADING_LAYER_PRIORITY", "omp workqueue tbb")

import numba
import numpy as np

from tests.benchmarks.turns import rest, spread
from tisim import Particles, Scene, Simulation
from tisim.backend import runtime
from tisim.effects import DipoleDipole
from tisim.steppers import FixedStep, Verlet


@numba.njit(parallel=True, fastmath=True, error_model="numpy")
def forces(x, y, z, a, b, c, scale, fx, fy, fz):
    """B16 (6.23) for moments (a, b, c); all of one type."""
    one = x.dtype.type(1)
    five = x.dtype.type(5)
    for i in numba.prange(len(x)):
        xi, yi, zi, ai, bi, ci = x[i], y[i], z[i], a[i], b[i], c[i]
        sx = sy = sz = one - one
        for j in range(len(x)):
            dx, dy, dz = x[j] - xi, y[j] - yi, z[j] - zi
            square = dx * dx + dy * dy + dz * dz
            # Particle i itself adds nothing.
            mask = one if j != i else one - one
            square = square if j != i else one
            v = one / np.sqrt(square)
            nx, ny, nz = dx * v, dy * v, dz * v
            p = ai * nx + bi * ny + ci * nz
            q = a[j] * nx + b[j] * ny + c[j] * nz
            along = ai * a[j] + bi * b[j] + ci * c[j] - five * p * q
            size = mask * v * v * v * v
            sx += size * (p * a[j] + q * ai + along * nx)
            sy += size * (p * b[j] + q * bi + along * ny)
            sz += size * (p * c[j] + q * ci + along * nz)
        fx[i], fy[i], fz[i] = scale * sx, scale * sy, scale * sz


def scene(n: int) -> Scene:
    """``n`` dipoles of random directions on a disturbed lattice."""
    draw, side = np.random.default_rng(0), int(np.ceil(n ** (1 / 3)))
    place = np.argwhere(np.ones((side,) * 3))[:n] + draw.uniform(-0.2, 0.2, (n, 3))
    moment = 1e3 * draw.normal(size=(n, 3))
    return Scene(
        particles=Particles(
            position=place, velocity=0 * place, radius=0.1, mass=1.0, quantities={"moment": moment}
        ),
        effects=(DipoleDipole(),),
        stepper=Verlet(control=FixedStep(dt=1e-12)),
        duration=1.0,
    )


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--number", type=int, default=1000)
    parser.add_argument("--precision", choices=("f64", "f32"), default="f64")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--arithmetic", choices=runtime.ARITHMETICS, default="strict")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--steps", type=int, default=50, help="of each try")
    options = parser.parse_args()
    settings = runtime.init(
        precision=options.precision, threads=options.threads, arithmetic=options.arithmetic
    ).settings
    numba.set_num_threads(options.threads)
    n, setup = options.number, scene(options.number)
    place, moment = setup.start()["position"], setup.start()["moment"]
    simulation = Simulation(setup)
    simulation.load([setup])
    real = np.float64 if options.precision == "f64" else np.float32
    columns = [np.ascontiguousarray(column, real) for column in (*place.T, *moment.T)]
    out = [np.empty(n, real) for _ in range(3)]

    def peer(steps: int) -> None:
        for _ in range(steps):
            forces(*columns, real(-3e-7), *out)

    ways = {"tisim": simulation.program.advance, "numba": peer}
    times: dict[str, list[float]] = {name: [] for name in ways}
    for way in ways.values():
        way(2)
    off = np.abs(simulation.s.read("force")[0] - np.stack(out, axis=1)).max() / np.abs(out).max()
    for _ in range(options.repeats):
        for name, way in ways.items():
            rest()
            began = time.perf_counter()
            way(options.steps)
            times[name].append((time.perf_counter() - began) / options.steps)
    ratio = np.array(times["numba"]) / np.array(times["tisim"])
    print(f"{n} dipoles, {settings}; forces agree to {off:.1e}")
    for name, seconds in times.items():
        print(f"{name}: {1e3 * np.median(seconds):.3f} ms, {n * (n - 1) / np.median(seconds):.3g} pairs/s")
    print(f"numba's time over tisim's {spread(ratio)}")


if __name__ == "__main__":
    main()
