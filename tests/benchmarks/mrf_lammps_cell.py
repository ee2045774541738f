"""The sheared cell of mrf_lammps.py in LAMMPS: reads in.npz of a folder, runs, and writes out.npz."""

from __future__ import annotations

import sys
import time
from pathlib import Path
from typing import Any

import numpy as np
from scipy.constants import mu_0

sys.path.insert(0, str(Path(__file__).parents[2]))

from tests.benchmarks import lammps_peer
from tests.benchmarks.lammps_peer import State


def worker(folder: Path) -> None:
    """Find the forces on grains in each state, and the result of an experiment."""
    with np.load(folder / "in.npz") as given:
        at = dict(given)
    found: dict[str, list[Any]] = {"force": [], "position": [], "raft_force": []}
    lasted = 0.0
    for place, velocity in zip(at["position"], at["velocity"], strict=True):
        machine = cell(folder, at, place, velocity)
        found["force"].append(vectors(machine, "f"))
        if at["steps"].any():
            began = time.perf_counter()
            found["raft_force"].append(shear(machine, at))
            lasted += time.perf_counter() - began
        found["position"].append(vectors(machine, "x"))
        machine.close()
    np.savez(folder / "out.npz", lasted=lasted, **found)


def vectors(machine: Any, name: str) -> np.ndarray:
    """A quantity of each particle, in the order of ids."""
    return np.array(machine.gather_atoms(name, 1, 3)).reshape(-1, 3)


def cell(folder: Path, at: State, place: np.ndarray, velocity: np.ndarray) -> Any:
    """A LAMMPS with grains at the given positions, in the oil, between the plates; forces are computed."""
    machine = lammps_peer.begin()
    machine.commands_list(["units si", "atom_style hybrid sphere dipole", "boundary p p f"])
    # The constant of LAMMPS's Coulomb's law, J m / C^2: with it, electric dipoles attract as these magnetic
    # ones do.
    coulomb = machine.extract_global("qqr2e")
    moment = at["moment"] * np.sqrt(mu_0 / (4 * np.pi * coulomb))
    d, (x, y, z) = at["diameter"], at["sides"]
    density = at["mass"] / (np.pi / 6 * d**3)
    rows = np.column_stack([place, np.tile([d, density, 0.0, 0.0, 0.0, moment], (len(place), 1))])
    moving = np.column_stack([velocity, np.zeros_like(velocity)])
    lammps_peer.write_data(folder / "data", [(0, x), (0, y), (-d, z + d)], rows, moving)
    model = str(at["law"])
    machine.commands_list(
        [
            "atom_modify map array", "newton off", "comm_modify vel yes", f"neighbor {0.1 * d} bin",
            "neigh_modify every 1 delay 0", f"read_data {folder / 'data'}",
            f"pair_style hybrid/overlay granular lj/cut/dipole/cut {d} {at['reach']:.17g}",
            f"pair_coeff * * granular {model}", f"pair_coeff * * lj/cut/dipole/cut 0.0 {d}",
            f"timestep {at['dt']:.17g}", f"fix plates all wall/gran granular {model} zplane 0 {z}",
            oil("all", at),
            # LAMMPS must not rotate grains, on which its dipoles exert torques.
            "fix move all nve", "run 0",
        ]
    )  # fmt: skip
    return machine


def oil(group: str, at: State) -> str:
    """The command by which oil at rest drags a group of grains."""
    return f"fix oil {group} viscous {3 * np.pi * at['viscosity'] * at['diameter']:.17g}"


def shear(machine: Any, at: State) -> tuple[float, float]:
    """Run the whole experiment; return the mean force along x on the lower and on the upper raft, N."""
    joins, begins, ends = (int(one) for one in at["steps"])
    bottom, top = at["raft"], at["sides"][2] - at["raft"]
    speed = at["rate"] * (top - bottom) / 2
    machine.commands_list(
        [
            f"run {joins}", "unfix move", "unfix oil",
            f"region below block INF INF INF INF INF {bottom}",
            f"region above block INF INF INF INF {top} INF",
            "group lower region below", "group upper region above", "group rafts union lower upper",
            "group free subtract all rafts", oil("free", at), "fix move free nve",
            f"velocity lower set {-speed} 0 0", f"velocity upper set {speed} 0 0",
            f"fix lower lower move linear {-speed} 0 0", f"fix upper upper move linear {speed} 0 0",
            # Frozen grains have infinite mass in impacts, as held grains in tisim; their forces are stored
            # before.
            "fix borne rafts store/force", "fix heavy rafts freeze",
            f"run {begins - joins}",
            "compute lower lower reduce sum f_borne[1]", "compute upper upper reduce sum f_borne[1]",
            "fix mean all ave/time 1 1 1 c_lower c_upper ave running",
            # The mean is over forces at the beginnings of steps.
            f"run {ends - begins - 1}",
        ]
    )  # fmt: skip
    lower, upper = (machine.extract_fix("mean", 0, 1, nrow=k) for k in range(2))
    machine.command("run 1")
    return lower, upper


if __name__ == "__main__":
    worker(Path(sys.argv[2]))
