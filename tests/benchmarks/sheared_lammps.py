"""Grains in simple shear beside LAMMPS: a table of the differences, and the stress of a steady flow.

    python -m pip install ".[bench]"
    python tests/benchmarks/sheared_lammps.py

512 grains of two sizes, at a volume fraction of 0.56, in a periodic box: ``ShearedBox`` in tisim, ``fix
deform`` with ``xy erate`` and ``remap v`` in LAMMPS, and the law of granular_lammps.py. LAMMPS moves the box
at the end of a step, so its forces use the image positions of the step before. This lag, and the lever arms
of granular_lammps.py, are options of the NumPy reference. With them the reference agrees with LAMMPS to
rounding; without them it agrees with the package to rounding.

The stress is the virial of the grain contacts, without friction and with it, averaged over a strain of 4 in
steady flow; errors are the errors of the means of eight parts of it.
"""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.benchmarks import lammps_peer  # noqa: E402
from tests.benchmarks.granular_lammps import FIELDS, SIDE, STEP, end_of, start  # noqa: E402
from tests.benchmarks.lammps_peer import State  # noqa: E402
from tests.effects.contact.grains import HERTZ_MINDLIN  # noqa: E402
from tests.effects.contact.sheared import ALONG, ShearedGrains, inside  # noqa: E402
from tisim import (  # noqa: E402
    Material,
    Particles,
    Scene,
    ShearedBox,
    Simulation,
)
from tisim.effects import Virial  # noqa: E402
from tisim.steppers import FixedStep, Verlet  # noqa: E402

RATE, FRICTION, EVERY = 0.5, 0.3, 50
"""1/s, in the grain-by-grain comparison; steps between samples of the stress."""
LAW = {"young": 1e5, "poisson": 0.3, "restitution": 0.6}
BEFORE, MEASURED, PARTS = 4.0, 4.0, 8
"""Strain until steady flow, strain over which the stress is averaged, and number of parts of that."""
VOLUME = float(SIDE**3)


def scene(friction: float = FRICTION, spinning: float = 3.0) -> Scene:
    """Grains that overlap, with velocities relative to the flow and spins."""
    at = start(spinning)
    velocity = at["velocity"] + np.outer(RATE * (at["position"][:, 1] - SIDE / 2), np.eye(3)[ALONG])
    box = ShearedBox(low=(0, 0, 0), high=(SIDE,) * 3, rate=RATE)
    position = at["position"] % SIDE
    return Scene(
        particles=Particles(
            position=position, velocity=velocity, radius=at["radius"], mass=at["mass"],
            quantities={"spin": at["spin"]},
        ),
        effects=(HERTZ_MINDLIN,),
        materials={"grain": Material(**LAW, friction=friction)},
        domain=box,
        stepper=Verlet(control=FixedStep(dt=STEP)),
        duration=1e3,
    )  # fmt: skip


def by_numpy(made: Scene, steps: int, levers: str = "contact", lag: float = 0.0) -> State:
    """The state of the NumPy reference after some steps."""
    grains = ShearedGrains(made, levers, lag)
    grains.run(steps, STEP)
    place, velocity = inside(made.domain, grains.x, grains.v, steps * STEP - lag)
    return dict(zip(FIELDS, (grains.force, grains.torque, place, velocity, grains.w), strict=True))


def by_lammps(made: Scene, steps: int) -> State:
    """The state of LAMMPS in the same box, and its virial every EVERY steps, Pa: xx, yy, zz, xy."""
    start = made.particles.arrays(made.domain, made.seed)
    end = lammps_peer.apart(__file__, friction=made.materials["grain"].friction, steps=steps, **start)
    # Grains outside the box are wrapped with LAMMPS's image vectors.
    end["position"], end["velocity"] = inside(
        made.domain, end["position"], end["velocity"], (steps - 1) * STEP
    )
    return end


def worker(folder: Path) -> None:
    """Run LAMMPS on in.npz of a folder, and write out.npz."""
    with np.load(folder / "in.npz") as given:
        at = dict(given)
    n, volumes, steps = len(at["radius"]), 4 / 3 * np.pi * at["radius"] ** 3, int(at["steps"])
    rows = np.column_stack([2 * at["radius"], at["mass"] / volumes, at["position"]])
    moving = np.column_stack([at["velocity"], at["spin"]])
    lammps_peer.write_data(folder / "data", 3 * [(0, SIDE)], rows, moving, tilted=True)
    aside = np.sqrt(2 * (1 - LAW["poisson"]) / (2 - LAW["poisson"]))
    model = (
        f"hertz/material {LAW['young']:.17g} {LAW['restitution']:.17g} {LAW['poisson']:.17g} tangential "
        f"mindlin_rescale/force NULL {aside:.17g} {float(at['friction']):.17g} damping coeff_restitution"
    )
    machine = lammps_peer.begin()
    machine.commands_list(
        [
            "units si", "atom_style sphere", "boundary p p p", "atom_modify map array", "newton off",
            "comm_modify vel yes", f"read_data {folder / 'data'}", "pair_style granular",
            f"pair_coeff * * {model}", "neighbor 0.2 bin", "neigh_modify every 1 delay 0",
            f"timestep {STEP}", "fix move all nve/sphere", f"fix shear all deform 1 xy erate {RATE} remap v",
            "compute p all pressure NULL virial",
            f"fix p all ave/time {EVERY} 1 {EVERY} c_p[1] c_p[2] c_p[3] c_p[4] file {folder / 'p'}",
            f"run {steps}",
        ]
    )  # fmt: skip
    found = {name: np.array(machine.gather_atoms(theirs, 1, 3)) for name, theirs in FIELDS.items()}
    end = {name: values.reshape(n, 3) for name, values in found.items()}
    np.savez(folder / "out.npz", pressure=np.loadtxt(folder / "p", ndmin=2), **end)
    machine.close()


def apart(a: State, b: State) -> dict[str, float]:
    """The largest difference of each quantity over its largest value; for positions, the distance of the
    nearest images."""
    off = {name: np.abs(a[name] - b[name]) for name in FIELDS}
    off["position"] = np.minimum(off["position"], SIDE - off["position"])
    return {name: float(off[name].max() / (np.abs(b[name]).max() or 1.0)) for name in FIELDS}


def stresses(made: Scene, steps: int) -> np.ndarray:
    """The virial of the package every EVERY steps, Pa: xx, yy, zz, xy."""
    made = made.model_copy(update={"effects": (*made.effects, Virial())})
    simulation = Simulation(made)
    simulation.load(made)
    rows = []
    for _ in range(steps // EVERY):
        simulation.run(steps=EVERY)
        (result,) = simulation.results()
        rows.append([result.measures[f"virial_{which}"] for which in ("xx", "yy", "zz", "xy")])
    simulation.close()
    return np.array(rows) / VOLUME


def mean(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Pressure and shear stress averaged over the last rows, Pa, and the errors of these means."""
    last = rows[-int(len(rows) * MEASURED / (BEFORE + MEASURED)) :]
    values = np.column_stack([last[:, :3].mean(axis=1), -last[:, 3]])
    parts = np.array([part.mean(axis=0) for part in np.array_split(values, PARTS)])
    return values.mean(axis=0), parts.std(axis=0, ddof=1) / np.sqrt(PARTS)


def main() -> None:
    """Print the tables."""
    print(f"| | steps | {' | '.join(FIELDS)} |\n|---{'|---' * (1 + len(FIELDS))}|")
    for steps in (1, 300):
        made = scene()
        there, here, reference = by_lammps(made, steps), end_of(made, steps), by_numpy(made, steps)
        as_theirs = by_numpy(made, steps, "radius", STEP)
        rows = {
            "package - LAMMPS": (here, there),
            "package - NumPy": (here, reference),
            "NumPy with LAMMPS's levers and images - LAMMPS": (as_theirs, there),
        }
        for name, (a, b) in rows.items():
            print(f"| {name} | {steps} | {' | '.join(f'{value:.1e}' for value in apart(a, b).values())} |")
    steps = round((BEFORE + MEASURED) / RATE / STEP)
    print("\n| | friction | pressure, Pa | shear stress, Pa |\n|---|---|---|---|")
    for friction in (0.0, FRICTION):
        made = scene(friction, 0.0)
        theirs = by_lammps(made, steps)["pressure"][:, 1:]
        for name, rows in {"package": stresses(made, steps), "LAMMPS": theirs}.items():
            (p, tau), (dp, dtau) = mean(rows)
            print(f"| {name} | {friction:g} | {p:.1f} +- {dp:.1f} | {tau:.2f} +- {dtau:.2f} |")


if __name__ == "__main__":
    lammps_peer.start(main, worker)
