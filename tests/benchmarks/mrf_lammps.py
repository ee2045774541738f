"""A sheared magnetorheological fluid beside LAMMPS: forces to rounding, and the shear stress.

    python -m pip install ".[bench]"
    python tests/benchmarks/mrf_lammps.py [--starts 4]

This is the case mrf_shear in the cell of a search, in oil at rest: a field draws grains into chains; then the
grains at the bottom and at the top are frozen into rafts, which are driven in opposite directions. Grains in
LAMMPS do not magnetise each other, so in both programs each grain has the moment of an isolated grain in the
field. The dipoles of LAMMPS (lj/cut/dipole/cut, of epsilon 0) are electric. With moments m (mu_0 / (4 pi
C))^(1/2), where C is the constant of LAMMPS's Coulomb's law, they attract each other as magnetic ones do.
Their torques turn grains in LAMMPS, but a soft moment turns inside its grain. Therefore grains have no
friction, rolling resistance or cohesion in either program, and LAMMPS rotates no grains (fix nve).

A short experiment from one start (seed) is compared grain by grain: the forces in its final state, and the
final positions. They differ by the kicks of half a step when rafts are frozen, which use the forces before or
after freezing. In the whole experiment single trajectories may diverge, so statistics of the fluid are
compared over random starts. Printed are both means and the mean difference, with the half widths of their 95
% intervals; the largest difference; and the time per particle and step of both programs, on one thread each,
from the first step to the last, without compilation.
"""

from __future__ import annotations

import argparse
import sys
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np

ROOT = Path(__file__).parents[2]
sys.path.insert(0, str(ROOT))

from tests.benchmarks import lammps_peer  # noqa: E402
from tests.benchmarks.granular_lammps import composed, lammps_model  # noqa: E402
from tests.benchmarks.lammps_peer import State  # noqa: E402
from tests.effects.contact.granular_reference import ReferenceLaw  # noqa: E402
from tisim.cases.common.magnetorheological_fluid import TABLE_2_1  # noqa: E402
from tisim.cases.common.runs import sound  # noqa: E402
from tisim.cases.mrf_shear import published  # noqa: E402
from tisim.cases.mrf_shear.measures import (  # noqa: E402
    magnetisation,
    order,
    shear_stress,
)
from tisim.cases.mrf_shear.scene import (  # noqa: E402
    BEFORE,
    CUT,
    LARGE_RADIUS,
    SEARCHED,
    STRAIN,
    SUSCEPTIBILITY,
    scene,
)

if TYPE_CHECKING:
    from tisim import Scene

D = 2 * LARGE_RADIUS
SETTINGS = {**SEARCHED, "before": BEFORE, "strain": STRAIN, "still": True, "dt": 4e-9}
"""Settings of the case, with a time step (s) of which all times are whole multiples."""
SHORT = {"magnetising": 8e-6, "before": 0.01, "strain": 0.03}
"""Settings of a short experiment, in which trajectories have not yet diverged but grains have met."""
LAW = ReferenceLaw(
    (
        {
            "young": published.YOUNG,
            "poisson": TABLE_2_1["poisson"],
            "restitution": TABLE_2_1["restitution"],
        },
    ),
    tangential=None,
)
"""Hertz and restitution, for grains and plates."""


class Sheared(NamedTuple):
    """The result of a sheared cell: its final state, in the order of ids, and the shear stress, Pa."""

    state: State
    stress: float


def scenes(seeds: Sequence[int], **settings: float) -> list[Scene]:
    """The cells of the package. settings : those that differ from SETTINGS."""
    from tisim import Material
    from tisim.effects import Granular, InducedMoment, MutualInducedMoment

    put = {MutualInducedMoment: InducedMoment(susceptibility=SUSCEPTIBILITY), Granular: composed(LAW)}
    made = []
    for seed in seeds:
        one = scene(**{**SETTINGS, **settings}, seed=seed)
        effects = tuple(put.get(type(effect), effect) for effect in one.effects)
        materials = {name: Material(**LAW.materials[0]) for name in one.materials}
        made.append(one.model_copy(update={"effects": effects, "materials": materials}))
    return made


def by_package(made: Sequence[Scene]) -> tuple[list[Sheared], float]:
    """The result of each cell, and the time per particle and step, s."""
    from tisim import Simulation

    simulation = Simulation(made[0], len(made))
    simulation.load(made)
    simulation.run()
    # Without the compilation of lists that grow.
    lasted = simulation.wall_s
    results = sound(simulation.results())
    simulation.close()
    found = []
    for one in results:
        by_id = np.argsort(one.state["id"])
        state = {name: values[by_id] for name, values in one.state.items()}
        found.append(Sheared(state, shear_stress(one)))
    return found, lasted / particle_steps(made)


def particle_steps(made: Sequence[Scene]) -> float:
    """Steps of some cells, times their particles."""
    return sum(one.particles.count() * steps(one)[-1] for one in made)


def steps(made: Scene) -> tuple[int, int, int]:
    """The steps at which rafts are frozen, the average of the stress begins, and the run ends."""
    from tisim.operators import JoinGroup, MeanForce

    joins = next(one.time for one in made.effects if isinstance(one, JoinGroup))
    begins = next(one.begin for one in made.effects if isinstance(one, MeanForce))
    joined, begun, ended = (round(one / made.stepper.control.dt) for one in (joins, begins, made.duration))
    return joined, begun, ended


def by_lammps(made: Sequence[Scene]) -> tuple[list[Sheared], float]:
    """The same in LAMMPS."""
    starts = [one.start() for one in made]
    found = lammps(starts, steps(made[0]))
    area = np.prod(SETTINGS["sides"][:2])
    ends = []
    for start, place, (lower, upper) in zip(starts, found["position"], found["raft_force"], strict=True):
        ends.append(Sheared({**start, "position": place}, float(lower - upper) / (2 * area)))
    return ends, float(found["lasted"]) / particle_steps(made)


def lammps(starts: Sequence[State], steps: tuple[int, int, int]) -> dict[str, np.ndarray]:
    """The results of LAMMPS from some states, in a separate process: forces in them, and the final states."""
    script = str(Path(__file__).with_name("mrf_lammps_cell.py"))
    stacked = {name: np.stack([at[name] for at in starts]) for name in ("position", "velocity")}
    moment = magnetisation(published.FLUX) * np.pi / 6 * D**3
    grain = {"mass": starts[0]["mass"][0], "diameter": D, "moment": moment, "law": lammps_model(LAW)}
    around = {name: SETTINGS[name] for name in ("sides", "raft", "rate", "dt")}
    reach = CUT["cutoff"] * D / 2 + CUT["gap"]
    return lammps_peer.apart(
        script, **stacked, **grain, **around, reach=reach, viscosity=published.OIL_VISCOSITY, steps=steps
    )


def forces(made: Scene, at: State) -> tuple[np.ndarray, np.ndarray]:
    """The forces (N) on all grains of a state, with no grain held, in the package and in LAMMPS."""
    from tisim import Particles, Simulation

    at = {name: at[name] for name in ("position", "velocity", "radius", "mass")}
    simulation = Simulation(made)
    simulation.load(made.model_copy(update={"particles": Particles(**at, material="iron")}))
    ours = simulation.s.read("force")[0].astype(float)
    simulation.close()
    return ours, lammps([at], (0, 0, 0))["force"][0]


def apart(made: Scene) -> dict[str, float]:
    """The largest differences of the two programs at the end of a cell."""
    from tisim.analysis import nearest_image, periodic_sides

    ((here,), _), ((there,), _) = by_package([made]), by_lammps([made])
    ours, theirs = forces(made, here.state)
    off = nearest_image(here.state["position"] - there.state["position"], periodic_sides(made.domain))
    return {
        "forces, over the largest": float(np.abs(ours - theirs).max() / np.abs(theirs).max()),
        "places, d": float(np.abs(off).max() / D),
        "stress, over itself": float(abs(here.stress / there.stress - 1)),
        "contacts of a grain there": order(here.state, made.domain).contacts,
    }


def statistics(cell: Sheared, made: Scene) -> dict[str, float]:
    """The compared statistics of one cell."""
    chains = order(cell.state, made.domain)
    return {
        "shear stress, kPa": 1e-3 * cell.stress,
        "contacts of a grain": chains.contacts,
        "order of contacts along the field": chains.alignment,
    }


def table(cells: Sequence[Sheared], made: Sequence[Scene]) -> dict[str, np.ndarray]:
    """Each statistic of every cell."""
    each = [statistics(*one) for one in zip(cells, made, strict=True)]
    return lammps_peer.columns(each)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--starts", type=int, default=4)
    options = parser.parse_args()
    import tisim

    tisim.init(threads=1)
    (short,) = scenes([0], **SHORT)
    print("| a short experiment | |\n|---|---|")
    for what, value in apart(short).items():
        print(f"| {what} | {value:.2g} |")
    made = scenes(range(options.starts))
    (here, our_time), (there, their_time) = by_package(made), by_lammps(made)
    print()
    lammps_peer.print_beside(table(here, made), table(there, made))
    lammps_peer.print_times(our_time, their_time)


if __name__ == "__main__":
    lammps_peer.start(main)
