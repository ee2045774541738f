"""Avalanches without a field beside LAMMPS: the final slope, from the same random starts (seeds) in both.

    python -m pip install ".[bench]"
    python tests/benchmarks/avalanche_lammps.py [--starts 10]

300 grains of the case avalanche fall into a column between a wall and a gate, in a cell that is periodic
across, settle, and run out over the floor when the gate opens. Both programs have the law: Hertz, Mindlin,
restitution, and rolling SDS, without cohesion. Grain trajectories are chaotic and the lever arms of the two
programs differ (granular_lammps.py), so means over starts are compared. Printed are both means and the mean
difference, with the half widths of their 95 % intervals; and the time per particle and step of both programs,
on one thread each, from the first step to the last, without compilation.
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.benchmarks import lammps_peer  # noqa: E402
from tests.benchmarks.granular_lammps import composed, lammps_model  # noqa: E402
from tests.benchmarks.lammps_peer import State  # noqa: E402
from tests.effects.contact.granular_reference import ReferenceLaw  # noqa: E402
from tisim.cases.avalanche.measures import grains_volume, heap_volume, repose  # noqa: E402
from tisim.cases.avalanche.scene import (  # noqa: E402
    DIAMETERS,
    GRAVITY,
    IRON_DESIGN,
    POISSON,
    RESTITUTION,
    STIFFNESS,
    Cell,
    scene,
    step,
    time_unit,
    young,
)

if TYPE_CHECKING:
    from tisim import Scene

D = DIAMETERS[0]
CELL = Cell(number=300, column=8.0, width=4.0, length=40.0, height=20.0)
OPENS, DURATION = 25.0, 50.0
"""Times at which the gate opens and at which the slope is measured, in sqrt(d/g)."""
LAW = ReferenceLaw(
    (
        {
            **{"young": young(D), "poisson": POISSON, "restitution": RESTITUTION},
            **{"friction": IRON_DESIGN["friction"], "rolling_friction": IRON_DESIGN["rolling_friction"]},
            **{"rolling_stiffness": 50.0, "rolling_damping": 0.05},
        },
    ),
    rolling="rolling_sds",
)
"""Iron. The rolling stiffness, N/m, is about equal to the stiffness of rolling_epsd under a few grain
weights."""


def scenes(seeds: Sequence[int]) -> list[Scene]:
    """The avalanches of the package."""
    from tisim import Material
    from tisim.effects import Granular

    made = []
    for seed in seeds:
        one = scene(CELL, field=0.0, seed=seed, opens=OPENS, duration=DURATION)
        effects = tuple(composed(LAW) if isinstance(e, Granular) else e for e in one.effects)
        materials = {"iron": Material(**LAW.materials[0])}
        made.append(one.model_copy(update={"effects": effects, "materials": materials}))
    return made


def by_package(seeds: Sequence[int]) -> tuple[list[State], float]:
    """The final state of each start, and the time per particle and step, s."""
    from tisim import Simulation

    made = scenes(seeds)
    simulation = Simulation(made[0], len(made))
    simulation.load(made)
    simulation.run()
    # Without the compilation of lists that grow.
    lasted = simulation.wall_s
    results = simulation.results()
    simulation.close()
    for result in results:
        assert result.status.ok, result.status.reason
    return [result.state for result in results], lasted / (len(made) * particle_steps())


def particle_steps() -> float:
    """Steps of an avalanche, times its particles."""
    return CELL.number * DURATION * time_unit(D) / step(D, STIFFNESS)


def by_lammps(seeds: Sequence[int]) -> tuple[list[State], float]:
    """The same in LAMMPS, in a separate process."""
    places = np.stack([one.start()["position"] for one in scenes(seeds)])
    mass = scenes(seeds[:1])[0].start()["mass"][0]
    found = lammps_peer.apart(__file__, law=lammps_model(LAW), position=places, mass=mass)
    states = [{"position": at, "radius": np.full(len(at), D / 2)} for at in found["position"]]
    return states, float(found["lasted"]) / (len(states) * particle_steps())


def worker(folder: Path) -> None:
    """Run LAMMPS on each start of in.npz of a folder, and write out.npz."""
    with np.load(folder / "in.npz") as given:
        model, starts, mass = str(given["law"]), given["position"], float(given["mass"])
    n, dt, unit = starts.shape[1], step(D, STIFFNESS), time_unit(D)
    density = mass / (np.pi / 6 * D**3)
    length, width = CELL.length * D, CELL.width * D
    found, lasted = [], 0.0
    for places in starts:
        box = [(-D, length + D), (0, width), (-D, 2 * CELL.height * D)]
        rows = np.column_stack([np.full(n, D), np.full(n, density), places])
        lammps_peer.write_data(folder / "data", box, rows)
        machine = lammps_peer.begin()
        wall = f"all wall/gran granular {model}"
        opens, ends = (round(time * unit / dt) for time in (OPENS, DURATION))
        machine.commands_list(
            [
                "units si", "atom_style sphere", "boundary f p f", "atom_modify map array", "newton off",
                "comm_modify vel yes", f"read_data {folder / 'data'}", "pair_style granular",
                f"pair_coeff * * {model}", f"neighbor {0.2 * D} bin", "neigh_modify every 1 delay 0",
                f"timestep {dt}", f"fix floor {wall} zplane 0 NULL", f"fix ends {wall} xplane 0 {length}",
                f"fix gate {wall} xplane NULL {CELL.column * D}",
                f"fix down all gravity {GRAVITY} vector 0 0 -1", "fix move all nve/sphere",
                "run 0",
            ]
        )  # fmt: skip
        began = time.perf_counter()
        machine.commands_list([f"run {opens}", "unfix gate", f"run {ends - opens}"])
        lasted += time.perf_counter() - began
        found.append(np.array(machine.gather_atoms("x", 1, 3)).reshape(n, 3))
        machine.close()
    np.savez(folder / "out.npz", position=np.array(found), lasted=lasted)


def statistics(state: State) -> dict[str, float]:
    """The compared statistics of one slope."""
    return {
        "angle of repose, degrees": repose(state),
        "volume of the heap over that of its grains": heap_volume(state, CELL.width * D)
        / grains_volume(state),
        "height of the centre of mass, d": float(state["position"][:, 2].mean() / D),
        "mean distance from the end, d": float(state["position"][:, 0].mean() / D),
    }


def table(states: list[State]) -> dict[str, np.ndarray]:
    """Each statistic of every start."""
    each = [statistics(state) for state in states]
    return lammps_peer.columns(each)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--starts", type=int, default=10)
    options = parser.parse_args()
    seeds = range(options.starts)
    import tisim

    tisim.init(threads=1)
    (here, our_time), (there, their_time) = by_package(seeds), by_lammps(seeds)
    lammps_peer.print_beside(table(here), table(there))
    lammps_peer.print_times(our_time, their_time)


if __name__ == "__main__":
    lammps_peer.start(main, worker)
