"""CPU time of two versions of the code, side by side.

    python tests/benchmarks/versions.py BEFORE AFTER [--pairs 7] [--only NAME ...]

BEFORE and AFTER are folders of two checkouts (git worktree). Each measurement is a process of its own with
one thread; processes of the two versions alternate. CPU time is less sensitive to other programs than wall
time. Printed are the medians of both versions, and median, smallest and largest of their ratios. Kernels are
compiled before the measurement; TISIM_BACKEND names the kernel compiler.

- single: 2000 charged particles in a magnetic field and drag, without interaction, implicit with adaptive
  steps of their own;
- coupled: 300 charges that repel each other, implicit with adaptive steps of the world;
- pairs: 1000 charges, all pairs, Verlet;
- grains: 4000 grains in contact under gravity on a floor, with friction and contact history, Verlet;
- first result: a process that runs a small scene of all of these laws, with a warm cache of kernels;
- import: a process that imports tisim.
"""

import argparse
import os
import resource
import subprocess
import sys
import time
from pathlib import Path
from typing import Any

import numpy as np

REPEATS = 5
"""Repetitions of a measurement within a process, of which the smallest CPU time counts."""
NAMES = {
    **dict.fromkeys(("single", "coupled", "pairs", "grains"), "ms a step"),
    **dict.fromkeys(("first result", "import"), "s"),
}
"""The measurements, with their units."""


def lattice(number: int, spacing: float) -> np.ndarray:
    """Positions on a cubic lattice, slightly disturbed, shape (number, 3)."""
    draw, side = np.random.default_rng(0), int(np.ceil(number ** (1 / 3)))
    places = np.stack(np.meshgrid(*[np.arange(side)] * 3, indexing="ij"), -1).reshape(-1, 3)[:number]
    return spacing * (places + 1.0 + draw.uniform(-1e-3, 1e-3, (number, 3)))


def charges(number: int, velocity: float) -> Any:
    """Particles with random charges, 1 apart."""
    from tisim import Particles

    draw = np.random.default_rng(1)
    return Particles(
        position=lattice(number, 1.0),
        velocity=velocity * draw.normal(size=(number, 3)),
        radius=0.05,
        mass=1.0,
        density=None,
        quantities={"charge": draw.uniform(0.5, 1.5, number)},
    )


def scenes() -> dict[str, Any]:
    """The scenes by name, with the number of steps of a measurement; None for a whole run."""
    from tisim import Material, Particles, Scene
    from tisim.effects import (
        Granular,
        Gravity,
        Lorentz,
        MindlinForce,
        NearField,
        RestitutionDamping,
        StokesDrag,
        Walls,
    )
    from tisim.geometry import Plane
    from tisim.sources import MagneticField
    from tisim.steppers import ErrorControl, FixedStep, IterationControl, Trapezoid, Verlet

    grain = Material(young=1e6, poisson=0.3, restitution=0.5, friction=0.5)
    floor = Plane(point=(0, 0, 0.5), normal=(0, 0, 1))
    single = IterationControl(first=1e-4, longest=2e-3, tolerance=1e-6)
    coupled = ErrorControl(first=1e-4, longest=1e-1, error=1e-5, tolerance=1e-6)
    repulsion = NearField(alpha2=1.0, strength="charge")
    return {
        "single": (
            Scene(
                particles=charges(2000, 1.0),
                effects=(
                    MagneticField(constant=(1.0, 0.0, 0.0)),
                    Lorentz(),
                    StokesDrag(viscosity=0.1),
                ),
                stepper=Trapezoid(control=single),
                duration=1.0,
            ),
            None,
        ),
        "coupled": (
            Scene(
                particles=charges(300, 0.1),
                effects=(repulsion,),
                stepper=Trapezoid(control=coupled),
                duration=1.0,
            ),
            None,
        ),
        "pairs": (
            Scene(
                particles=charges(1000, 0.1),
                effects=(repulsion,),
                stepper=Verlet(control=FixedStep(dt=1e-4)),
                duration=1.0,
            ),
            400,
        ),
        "grains": (
            Scene(
                particles=Particles(
                    position=lattice(4000, 0.998), velocity=np.zeros((4000, 3)), radius=0.5, density=1.0
                ),
                materials={"grain": grain},
                effects=(
                    Granular(damping=RestitutionDamping(), tangential=MindlinForce()),
                    Walls(planes=(floor,)),
                    Gravity(acceleration=(0.0, 0.0, -1.0)),
                ),
                stepper=Verlet(control=FixedStep(dt=1e-4)),
                duration=1e3,
            ),
            300,
        ),
    }


def cpu() -> float:
    """CPU time of this process, in user mode, s."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_utime


def measured(name: str) -> float:
    """CPU time (ms) of a step of a scene, in this process."""
    import tisim

    tisim.init("cpu", threads=1)
    scene, steps = scenes()[name]
    simulation, best = tisim.Simulation(scene), np.inf
    for _ in range(REPEATS + 1):
        simulation.load(scene)
        if steps:
            simulation.run(steps=20)
        began = cpu()
        simulation.run(steps=steps)
        (result,) = simulation.results()
        best = min(best, (cpu() - began) / (steps or result.work["steps"]))
    return 1e3 * best


def first_result() -> None:
    """Run small scenes of all kinds."""
    import tisim

    tisim.init("cpu", threads=1)
    for scene, _ in scenes().values():
        tisim.run(scene.model_copy(update={"duration": 2e-3}))


def of_process(folder: Path, code: list[str]) -> tuple[float, str]:
    """CPU time (s) of a process with the code of a folder, and its output."""
    before = resource.getrusage(resource.RUSAGE_CHILDREN)
    done = subprocess.run(
        [sys.executable, *code],
        env={**os.environ, "PYTHONPATH": str(folder)},
        cwd=folder,
        capture_output=True,
        text=True,
        check=False,
    )
    if done.returncode:
        raise SystemExit(f"{folder}: {done.stderr}")
    after = resource.getrusage(resource.RUSAGE_CHILDREN)
    return after.ru_utime - before.ru_utime, done.stdout


def once(folder: Path, name: str) -> float:
    """One measurement: ms a step of a scene, or s of a whole process."""
    if name == "import":
        return min(of_process(folder, ["-c", "import tisim"])[0] for _ in range(2 * REPEATS))
    seconds, out = of_process(folder, [__file__, "--worker", name])
    return seconds if name == "first result" else float(out.split()[-1])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("before", type=Path, nargs="?", help="folder of a checkout")
    parser.add_argument("after", type=Path, nargs="?", help="folder of another checkout")
    parser.add_argument("--pairs", type=int, default=7)
    parser.add_argument("--only", nargs="+", choices=NAMES, default=list(NAMES))
    parser.add_argument("--worker", choices=NAMES, help=argparse.SUPPRESS)
    args = parser.parse_args()
    if args.worker == "first result":
        first_result()
    elif args.worker:
        print(measured(args.worker))
    else:
        compare(args.before.resolve(), args.after.resolve(), args.pairs, args.only)


def compare(before: Path, after: Path, pairs: int, names: list[str]) -> None:
    """Print the CPU times of both versions, and their ratios."""
    began = time.monotonic()
    for name in names:
        for folder in (before, after):
            once(folder, name)  # Compiles kernels and modules.
        taken = np.array([[once(folder, name) for folder in (before, after)] for _ in range(pairs)])
        ratio, (old, new) = taken[:, 1] / taken[:, 0], np.median(taken, axis=0)
        print(
            f"{name}: {old:.4g} before, {new:.4g} after {NAMES[name]}; after/before {np.median(ratio):.3f} "
            f"({ratio.min():.3f} .. {ratio.max():.3f}), {pairs} pairs",
            flush=True,
        )
    print(f"{time.monotonic() - began:.0f} s")


if __name__ == "__main__":
    main()
