"""Clouds that collapse by their own gravity beside LAMMPS, from the same random starts (seeds) in both.

    python -m pip install ".[bench]"
    python tests/benchmarks/coalescence_lammps.py [--starts 10]

This is the case coalescence without magnetisation: a seed grain and 180 grains with velocities, spins and a
rotation become a rubble pile, under Hertz, Mindlin, restitution and rolling SDS. There is no cohesion,
because LAMMPS does not combine it with restitution. Gravity in LAMMPS is its Coulomb's law, with charges of
G^1/2 m and a dielectric constant of -1. Grain trajectories are chaotic and the lever arms of the two programs
differ (granular_lammps.py), so means over starts are compared. Printed are both means and the mean
difference, with the half widths of their 95 % intervals; the largest difference; and the time per particle
and step of both programs, on one thread each, from the first step to the last, without compilation: for tisim
of a batch of all starts, for LAMMPS of one start after another.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
from scipy.constants import G

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.benchmarks import lammps_peer  # noqa: E402
from tests.benchmarks.granular_lammps import composed, lammps_model  # noqa: E402
from tests.benchmarks.lammps_peer import State  # noqa: E402
from tests.effects.contact.granular_reference import ReferenceLaw  # noqa: E402
from tisim import Scene, Simulation  # noqa: E402
from tisim.cases.coalescence import scene as cloud  # noqa: E402
from tisim.cases.coalescence.runs import Gathering  # noqa: E402
from tisim.cases.common.rubble_pile import Asteroid, Conserved  # noqa: E402
from tisim.cases.common.runs import sound  # noqa: E402
from tisim.effects import SelfGravity  # noqa: E402

LOOKS = (5000.0, 10_000.0)
"""Times of comparison, s: during the collapse and at the end."""
SIDE = 400.0
"""The side of LAMMPS's box, m, which contains all grains; no pair is beyond its cut-off."""
LAW = ReferenceLaw(
    (cloud.rubble(cloud.scale_of(cloud.DEFAULT["number"])).model_dump(exclude_none=True),),
    rolling="rolling_sds",
)
FIELDS = {"position": "x", "velocity": "v", "spin": "omega"}
KEPT = ("radius", "mass")


def scenes(seeds: Sequence[int]) -> list[Scene]:
    """The clouds of the package."""
    laws = {"effects": (composed(LAW), SelfGravity())}
    made = (cloud.scene(**cloud.DEFAULT, magnetisation=0.0, seed=seed) for seed in seeds)
    return [one.model_copy(update=laws) for one in made]


def particle_steps(made: Sequence[Scene]) -> float:
    """Steps of some clouds, times their particles."""
    return sum(len(one.start()["mass"]) * LOOKS[-1] / one.stepper.control.dt for one in made)


def by_package(made: Sequence[Scene]) -> tuple[list[list[State]], float]:
    """The states of each start at LOOKS, and the time per particle and step, s."""
    simulation = Simulation(made[0], len(made))
    simulation.load(list(made))
    found: list[list[State]] = [[] for _ in made]
    for look in LOOKS:
        simulation.run(until=look)
        for states, result in zip(found, sound(simulation.results()), strict=True):
            states.append(result.state)
    lasted = simulation.wall_s
    simulation.close()
    return found, lasted / particle_steps(made)


def by_lammps(made: Sequence[Scene]) -> tuple[list[list[State]], float]:
    """The same in LAMMPS, in a separate process."""
    steps = [round(look / made[0].stepper.control.dt) for look in LOOKS]
    states, lasted = apart(__file__, made, law=lammps_model(LAW), steps=steps)
    return states, lasted / particle_steps(made)


def apart(script: str, made: Sequence[Scene], **given: Any) -> tuple[list[list[State]], float]:
    """The results of a script's ``worker`` from the initial states of some scenes, time by time, and the
    seconds of its steps."""
    starts = [one.start() for one in made]
    stacked = {name: np.stack([at[name] for at in starts]) for name in (*FIELDS, *KEPT)}
    found = lammps_peer.apart(script, dt=made[0].stepper.control.dt, **given, **stacked)
    states = [
        [
            {**{name: found[name][w, k] for name in FIELDS}, **{name: at[name] for name in KEPT}}
            for k in range(found["position"].shape[1])
        ]
        for w, at in enumerate(starts)
    ]
    return states, float(found["lasted"])


def run_each(folder: Path, run: Callable[[Any, State, State], tuple[list[State], float]]) -> None:
    """Run LAMMPS on each start of in.npz of a folder, and write out.npz.

    run : takes a LAMMPS with a cloud, the start, and all given arrays; returns the states at the times of
    comparison and the seconds of its steps.
    """
    with np.load(folder / "in.npz") as given:
        at = dict(given)
    states, lasted = [], 0.0
    for w in range(len(at["radius"])):
        start = {name: at[name][w] for name in (*FIELDS, *KEPT)}
        machine = machine_of(start, folder, str(at["law"]))
        machine.command(f"timestep {float(at['dt'])}")
        looks, seconds = run(machine, start, at)
        machine.close()
        states.append(looks)
        lasted += seconds
    columns = {name: np.array([[look[name] for look in looks] for looks in states]) for name in FIELDS}
    np.savez(folder / "out.npz", lasted=lasted, **columns)


def state_of(machine: Any) -> State:
    """Positions, velocities and spins of the grains in LAMMPS."""
    return {
        name: np.array(machine.gather_atoms(theirs, 1, 3)).reshape(-1, 3) for name, theirs in FIELDS.items()
    }


def fall_together(machine: Any, start: State, at: State) -> tuple[list[State], float]:
    """Let a cloud of LAMMPS collapse; see ``run_each``."""
    machine.command("run 0")
    looks, lasted, done = [], 0.0, 0
    for steps in at["steps"]:
        began = time.perf_counter()
        machine.command(f"run {steps - done} pre no post no")
        lasted += time.perf_counter() - began
        done = steps
        looks.append(state_of(machine))
    return looks, lasted


def worker(folder: Path) -> None:
    """Run LAMMPS for ``apart``."""
    run_each(folder, fall_together)


def machine_of(at: State, folder: Path, model: str) -> Any:
    """LAMMPS with a cloud."""
    radius, mass, n = at["radius"], at["mass"], len(at["mass"])
    density = mass / (4 / 3 * np.pi * radius**3)
    rows = np.column_stack([at["position"], G**0.5 * mass, 2 * radius, density])
    moving = np.column_stack([at["velocity"], at["spin"]])
    lammps_peer.write_data(folder / "data", 3 * [(-SIDE / 2, SIDE / 2)], rows, moving)
    machine = lammps_peer.begin()
    machine.commands_list(
        [
            "units lj", "atom_style hybrid charge sphere", "boundary f f f",
            "atom_modify map array", "newton off", "comm_modify vel yes", f"read_data {folder / 'data'}",
            "dielectric -1.0",
            f"pair_style hybrid/overlay granular coul/cut {2 * SIDE}", f"pair_coeff * * granular {model}",
            "pair_coeff * * coul/cut", "neighbor 1.0 bin",
            f"neigh_modify every 1 delay 0 one {n} page {20 * n}", "fix move all nve/sphere",
        ]
    )  # fmt: skip
    return machine


def statistics(states: list[State]) -> dict[str, float]:
    """The compared statistics of one cloud."""
    way, end = states
    mass, place = end["mass"], end["position"]
    away = ((place - np.average(place, axis=0, weights=mass)) ** 2).sum(axis=1)
    pile = Asteroid.of(end)
    before, after = Conserved.of(way), Conserved.of(end)
    return {
        "part bound on the way": Gathering.of(way).bound,
        "part of the asteroid on the way": Gathering.of(way).coalesced,
        "part of the asteroid": Gathering.of(end).coalesced,
        "radius of gyration, m": float(np.sqrt(np.average(away, weights=mass))),
        "energy of gravity, J": after.gravity,
        "kinetic energy on the way, J": before.kinetic,
        "density of the hull, kg/m^3": float(pile.grains["mass"].sum() / pile.volume),
        "longest axis over shortest": pile.elongation,
        "spin about z, urad/s": 1e6 * float(pile.spin[2]),
    }


def table(clouds: Sequence[list[State]]) -> dict[str, np.ndarray]:
    """Each statistic of every start."""
    return lammps_peer.columns([statistics(states) for states in clouds])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--starts", type=int, default=10)
    options = parser.parse_args()
    import tisim

    tisim.init(threads=1)
    made = scenes(range(options.starts))
    (here, our_time), (there, their_time) = by_package(made), by_lammps(made)
    lammps_peer.print_beside(table(here), table(there))
    lammps_peer.print_times(our_time, their_time)


if __name__ == "__main__":
    lammps_peer.start(main, worker)
