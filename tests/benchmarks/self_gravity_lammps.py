"""Self-gravity over all pairs beside LAMMPS: forces to rounding, and the time of a step side by side.

    python -m pip install ".[bench]"
    python tests/benchmarks/self_gravity_lammps.py [--numbers 300 1000 3000] [--repeats 9]

LAMMPS has no gravity between particles, but Coulomb's law: with charges of G^(1/2) m and a dielectric
constant of -1, like charges attract (pair_style coul/cut, with a cut-off larger than the cloud). Particles of
unlike masses fill a ball. Both programs run on one thread, LAMMPS in a separate process: first forces at the
same positions, and then steps of Verlet, whose time is a median over repeats.
"""

from __future__ import annotations

import argparse
import sys
import time
from pathlib import Path

import numpy as np
from scipy.constants import G

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.benchmarks import lammps_peer

RADIUS, HEAVIEST, STEP = 50.0, 2e3, 1e-3
"""Radius of the ball, m; mass of the heaviest particle, kg, while the lightest has a tenth of it; time step,
in which nothing moves far, s."""
SIZE = 0.2
"""The diameter of all particles, m; they do not touch."""
WARM = 5
"""Steps before the time is taken."""


def ball(number: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions (m) in a ball and masses (kg)."""
    draw = np.random.default_rng(number)
    away = draw.normal(size=(number, 3))
    away *= (RADIUS * draw.uniform(0, 1, number) ** (1 / 3) / np.linalg.norm(away, axis=1))[:, None]
    return away, draw.uniform(0.1 * HEAVIEST, HEAVIEST, number)


def steps_of(number: int) -> int:
    """The number of steps that are timed at once."""
    return max(5, 2_000_000 // number**2)


def by_package(place: np.ndarray, mass: np.ndarray, repeats: int) -> dict[str, np.ndarray]:
    """The forces (N), and the times of a step (s)."""
    from tisim import Particles, Scene, Simulation
    from tisim.effects import SelfGravity
    from tisim.steppers import FixedStep, Verlet

    scene = Scene(
        particles=Particles(position=place, velocity=np.zeros_like(place), radius=SIZE / 2, mass=mass),
        effects=(SelfGravity(),),
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=1e9,
    )
    simulation = Simulation(scene)
    simulation.load(scene)
    force = simulation.s.read("force")[0].astype(float)
    simulation.run(steps=WARM)
    steps, times = steps_of(len(mass)), []
    for _ in range(repeats):
        began = time.perf_counter()
        simulation.run(steps=steps)
        times.append((time.perf_counter() - began) / steps)
    simulation.close()
    return {"force": force, "times": np.array(times)}


def by_lammps(place: np.ndarray, mass: np.ndarray, repeats: int) -> dict[str, np.ndarray]:
    """The same in LAMMPS."""
    return lammps_peer.apart(__file__, place=place, mass=mass, repeats=repeats)


def worker(folder: Path) -> None:
    """Run LAMMPS on in.npz of a folder, and write out.npz."""
    with np.load(folder / "in.npz") as given:
        place, mass, repeats = given["place"], given["mass"], int(given["repeats"])
    n, side = len(mass), 2 * RADIUS
    density = mass / (np.pi / 6 * SIZE**3)
    rows = np.column_stack([place, G**0.5 * mass, np.full(n, SIZE), density])
    lammps_peer.write_data(folder / "data", 3 * [(-side, side)], rows)
    machine = lammps_peer.begin()
    machine.commands_list(
        [
            "units lj", "atom_style hybrid charge sphere", "boundary f f f", "atom_modify map array",
            f"read_data {folder / 'data'}", "dielectric -1.0", f"pair_style coul/cut {side}",
            "pair_coeff * *", "neighbor 1.0 bin", f"neigh_modify one {n} page {20 * n}",
            f"timestep {STEP}", "fix move all nve", "run 0",
        ]
    )  # fmt: skip
    force = np.array(machine.gather_atoms("f", 1, 3)).reshape(n, 3)
    machine.command(f"run {WARM}")
    steps, times = steps_of(n), []
    for _ in range(repeats):
        began = time.perf_counter()
        machine.command(f"run {steps} pre no post no")
        times.append((time.perf_counter() - began) / steps)
    machine.close()
    np.savez(folder / "out.npz", force=force, times=times)


def apart(ours: np.ndarray, theirs: np.ndarray) -> float:
    """The largest difference of the forces over the magnitude of that force."""
    off = np.linalg.norm(ours - theirs, axis=1) / np.linalg.norm(theirs, axis=1)
    return float(off.max())


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--numbers", type=int, nargs="+", default=[300, 1000, 3000])
    parser.add_argument("--repeats", type=int, default=9)
    options = parser.parse_args()
    import tisim

    tisim.init(threads=1)
    print("| particles | forces apart | tisim, us a particle and step | LAMMPS | LAMMPS over tisim |")
    print("|---|---|---|---|---|")
    for number in options.numbers:
        cloud = ball(number)
        ours, theirs = (by(*cloud, options.repeats) for by in (by_package, by_lammps))
        each = [1e6 * float(np.median(one["times"])) / number for one in (ours, theirs)]
        cells = (number, f"{apart(ours['force'], theirs['force']):.1e}", *(f"{one:.3g}" for one in each))
        print(f"| {' | '.join(map(str, cells))} | {each[1] / each[0]:.2f} |", flush=True)


if __name__ == "__main__":
    lammps_peer.start(main, worker)
