"""Grains that fall into a box and come to rest, beside LAMMPS: bulk statistics, for each law of both.

    python -m pip install ".[bench]"
    python tests/benchmarks/settled_lammps.py [--laws LAW ...] [--starts 16]

512 grains of two sizes fall onto a floor between four walls, in both programs from the same random starts
(seeds). Grain trajectories are chaotic and the lever arms of the two programs differ (granular_lammps.py), so
means over starts are compared: the final height of the centre of mass, the coordination number, the overlap,
the vertical part of the contact directions, and the kinetic energy during the fall. Printed are both means
and the mean difference, with the half widths of their 95 % intervals.
"""

from __future__ import annotations

import argparse
import sys
import time
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.benchmarks import lammps_peer  # noqa: E402
from tests.benchmarks.granular_lammps import LAWS, SIDE, composed, lammps_model  # noqa: E402
from tests.benchmarks.lammps_peer import State  # noqa: E402
from tests.effects.contact.granular_reference import ReferenceLaw  # noqa: E402

STEP, GRAVITY, LATTICE = 5e-4, 0.5, 1.12
"""s, m/s2, m between neighbouring positions at the start."""
TIMES = (4.0, 16.0)
"""s; energies are compared at the first time, during the fall; at the last, the bed is at rest."""
STIFFER = {
    **{"young": 1e7, "stiffness": 1e6, "damping": 3000.0},
    **{"rolling_stiffness": 4e5, "rolling_damping": 200.0},
    **{"twisting_stiffness": 4e4, "twisting_damping": 50.0},
}
"""A hundred times the stiffness of granular_lammps.py, because these grains carry others."""


def bulk_law(name: str) -> ReferenceLaw:
    """One of LAWS, for stiffer grains."""
    law = LAWS[name]
    given = law.materials[0]
    return replace(law, materials=({**given, **{key: STIFFER[key] for key in given if key in STIFFER}},))


def random_start(seed: int) -> State:
    """Grains on a wide lattice, in random order of sizes, with random velocities and spins."""
    draw = np.random.Generator(np.random.Philox(seed))
    across = int((SIDE - 1.1) / LATTICE) + 1
    places = np.stack(np.meshgrid(*3 * [np.arange(16)], indexing="ij"), axis=-1).reshape(-1, 3)
    places = places[(places[:, :2] < across).all(axis=1)]
    n = SIDE**3
    places = places[np.lexsort(places.T)][:n]
    radius = draw.choice([0.48, 0.54], n)
    return {
        "position": 0.58 + LATTICE * places + draw.uniform(-0.01, 0.01, (n, 3)),
        "velocity": draw.normal(scale=0.3, size=(n, 3)),
        "spin": draw.normal(scale=0.3, size=(n, 3)),
        "radius": radius,
        "mass": 4000 * radius**3,
    }


def by_package(law: ReferenceLaw, starts: list[State]) -> list[list[State]]:
    """Positions, velocities and spins of each start at TIMES, all starts side by side."""
    from tisim import Material, Particles, Scene, Simulation
    from tisim.effects import Gravity, Walls
    from tisim.geometry import Plane
    from tisim.steppers import FixedStep, Verlet

    planes = [Plane(point=(0, 0, 0), normal=tuple(axis)) for axis in np.eye(3)]
    planes += [Plane(point=(SIDE, SIDE, 0), normal=tuple(-axis)) for axis in np.eye(3)[:2]]
    scenes = [
        Scene(
            particles=Particles(
                **{name: values for name, values in at.items() if name != "spin"},
                quantities={"spin": at["spin"]},
            ),
            materials={"grain": Material(**law.materials[0])},
            effects=(composed(law), Walls(planes=planes), Gravity(acceleration=(0, 0, -GRAVITY))),
            stepper=Verlet(control=FixedStep(dt=STEP)),
            duration=2 * TIMES[-1],
        )
        for at in starts
    ]
    simulation = Simulation(scenes[0], len(scenes))
    simulation.load(scenes)
    found: list[list[State]] = [[] for _ in starts]
    done = 0
    for when in TIMES:
        steps = round(when / STEP)
        simulation.run(steps=steps - done)
        done = steps
        for kept, result in zip(found, simulation.results(), strict=True):
            assert result.status.reason in ("", "running"), result.status.reason
            order = np.argsort(result.state["id"])
            kept.append({name: result.state[name][order] for name in ("position", "velocity", "spin")})
    simulation.close()
    return found


def by_lammps(law: ReferenceLaw, starts: list[State]) -> list[list[State]]:
    """The same in LAMMPS, in a separate process."""
    stacked = {name: np.stack([at[name] for at in starts]) for name in starts[0]}
    found = lammps_peer.apart(__file__, law=lammps_model(law), **stacked)
    return [
        [{name: values[w, k] for name, values in found.items()} for k in range(len(TIMES))]
        for w in range(len(starts))
    ]


def worker(folder: Path) -> None:
    """Run LAMMPS on each start of in.npz of a folder, and write out.npz."""
    with np.load(folder / "in.npz") as given:
        at = dict(given)
    model, n = str(at["law"]), at["radius"].shape[1]
    names = {"position": "x", "velocity": "v", "spin": "omega"}
    found: dict[str, list[list[np.ndarray]]] = {name: [] for name in names}
    for w in range(len(at["radius"])):
        radius, mass = at["radius"][w], at["mass"][w]
        rows = np.column_stack([2 * radius, mass / (4 / 3 * np.pi * radius**3), at["position"][w]])
        moving = np.column_stack([at["velocity"][w], at["spin"][w]])
        box = [(-1, SIDE + 1), (-1, SIDE + 1), (-1, 3 * SIDE)]
        lammps_peer.write_data(folder / "data", box, rows, moving)
        ends = {"x": SIDE, "y": SIDE, "z": "NULL"}
        walls = [
            f"fix {axis} all wall/gran granular {model} {axis}plane 0 {end}" for axis, end in ends.items()
        ]
        machine = lammps_peer.begin()
        machine.commands_list(
            [
                "units si", "atom_style sphere", "boundary f f f", "atom_modify map array", "newton off",
                "comm_modify vel yes", f"read_data {folder / 'data'}", "pair_style granular",
                f"pair_coeff * * {model}", "neighbor 0.1 bin", "neigh_modify every 1 delay 0",
                f"timestep {STEP}", *walls, f"fix down all gravity {GRAVITY} vector 0 0 -1",
                "fix move all nve/sphere",
            ]
        )  # fmt: skip
        for name in names:
            found[name].append([])
        done = 0
        for when in TIMES:
            machine.command(f"run {round(when / STEP) - done}")
            done = round(when / STEP)
            for name, theirs in names.items():
                found[name][-1].append(np.array(machine.gather_atoms(theirs, 1, 3)).reshape(n, 3))
        machine.close()
    np.savez(folder / "out.npz", **{name: np.array(values) for name, values in found.items()})


def statistics(start: State, states: list[State]) -> dict[str, float]:
    """The bulk statistics of one start: one number of each."""
    radius, mass = start["radius"], start["mass"]
    way, end = states
    position = end["position"]
    i, j = cKDTree(position).query_pairs(2 * radius.max(), output_type="ndarray").T
    apart = position[j] - position[i]
    distance = np.linalg.norm(apart, axis=1)
    depth = radius[i] + radius[j] - distance
    touching = depth > 0
    upright = apart[touching, 2] / distance[touching]
    moving = (mass * (way["velocity"] ** 2).sum(axis=1)).sum()
    turning = (0.4 * mass * radius**2 * (way["spin"] ** 2).sum(axis=1)).sum()
    return {
        "height of the centre of mass, m": float((mass * position[:, 2]).sum() / mass.sum()),
        "contacts of a grain": float(2 * touching.sum() / len(radius)),
        "mean overlap, mm": float(1e3 * depth[touching].mean()),
        "upright part of the contacts": float((upright**2).mean()),
        "kinetic energy on the way, J": float(0.5 * moving),
        "that of spin, J": float(0.5 * turning),
        "speed at the end, m/s": float(np.sqrt((end["velocity"] ** 2).sum(axis=1).mean())),
    }


def table(starts: list[State], found: list[list[State]]) -> dict[str, np.ndarray]:
    """Each statistic of every start."""
    each = [statistics(at, states) for at, states in zip(starts, found, strict=True)]
    return lammps_peer.columns(each)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--laws", nargs="+", default=list(LAWS), metavar="LAW", choices=list(LAWS))
    parser.add_argument("--starts", type=int, default=16)
    options = parser.parse_args()
    starts = [random_start(seed) for seed in range(options.starts)]
    for name in options.laws:
        law, began = bulk_law(name), time.perf_counter()
        ours = table(starts, by_package(law, starts))
        between = time.perf_counter()
        theirs = table(starts, by_lammps(law, starts))
        print(
            f"{name}: {between - began:.0f} s, compiling included, and {time.perf_counter() - between:.0f} s"
        )
        lammps_peer.print_beside(ours, theirs)


if __name__ == "__main__":
    lammps_peer.start(main, worker)
