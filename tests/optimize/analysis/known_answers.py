"""Parameter recovery with the physics of the package: parameters of small scenes are found from measurements.

Each scene is run at a true design, and normal errors with the given uncertainties are added to its
quantities. A search with the default method finds the design, and ``calibration`` gives its intervals.

    PYTHONPATH=. python tests/optimize/analysis/known_answers.py [DATA_SETS [NAME ...]]
"""

import sys
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

import tisim
from tests.optimize.analysis.granular_experiment import GENES as GRANULAR_GENES
from tests.scenes import by_id, scene
from tisim import Material, optimize
from tisim.effects import (
    DipoleDipole,
    Granular,
    Gravity,
    HertzMaterial,
    Impact,
    InducedMoment,
    MindlinForce,
    RestitutionDamping,
    RollingEPSD,
    Walls,
)
from tisim.geometry import Plane
from tisim.optimize import Gene, Genome, Misfit, Objective, Problem
from tisim.optimize.evaluation.executors import evaluator_named
from tisim.optimize.search import search
from tisim.optimize.settings import Settings
from tisim.optimize.storage.cache import Cache
from tisim.sources import MagneticField

RUNS = 60
"""The budget of a search."""


@dataclass(frozen=True)
class Experiment:
    """genes : the unknown parameters. scene : function of a design. quantities : function of a run, in the
    units of ``uncertainty``, which contains the standard deviations of the measurements.
    """

    genes: tuple[Gene, ...]
    scene: Callable
    quantities: Callable
    uncertainty: tuple[float, ...]


def slide_roll_and_bounce(design, seed):
    """Three grains of 1 m and 1 kg: one slides on the floor until it rolls, one rolls, and one hits a
    wall."""
    speed, rolling, bounce = 12.0, 3.0, 1.0
    planes = (
        Plane(point=(0.0, 0.0, 0.0), normal=(0.0, 0.0, 1.0)),
        Plane(point=(100.0, 0.0, 0.0), normal=(-1.0, 0.0, 0.0)),
    )
    law = Granular(
        normal=HertzMaterial(), damping=RestitutionDamping(), tangential=MindlinForce(), rolling=RollingEPSD()
    )
    sunk = 1.2e-4  # m, about the depth to which the weight presses a grain into the floor
    return scene(
        [[0, 0, 1 - sunk], [0, 10, 1 - sunk], [98.95, 20, 50]],
        [[speed, 0, 0], [rolling, 0, 0], [bounce, 0, 0]],
        (law, Walls(planes=planes), Gravity(acceleration=(0.0, 0.0, -10.0))),
        radius=1.0,
        mass=1.0,
        quantities={"spin": [[0, 0, 0], [0, rolling, 0], [0, 0, 0]]},
        materials={"grain": Material(young=1e7, poisson=0.3, **design)},
        dt=2e-4,
        steps=1200,
    )


def speeds_and_spins(result):
    """Speed and spin of the sliding grain, and speeds of the rolling and the bouncing grain."""
    state = by_id(result)
    velocity, spin = state["velocity"][:, 0], state["spin"][:, 1]
    return velocity[0], spin[0], velocity[1], -velocity[2]


def drawn_together(design, seed):
    """Two magnetisable grains of 1 mm radius fly side by side through a field along x."""
    law = (
        MagneticField(constant=(design["flux"], 0.0, 0.0)),
        InducedMoment(susceptibility=3.0),
        DipoleDipole(),
    )
    velocity = [[0.0, 0.0, design["speed"]]] * 2
    return scene([[-1.5e-3, 0, 0], [1.5e-3, 0, 0]], velocity, law, dt=5e-5, steps=160)


def gap_and_way(result):
    """Distance between the centres (mm) and distance flown (mm)."""
    position = 1e3 * by_id(result)["position"]
    return position[1, 0] - position[0, 0], position[:, 2].mean()


def rebounds(design, seed):
    """Three pairs of grains collide head-on at 1, 2 and 3 m/s under Zohdi's impact law."""
    speeds = np.array([1.0, 2.0, 3.0])
    position = [[sign * 1.05e-3, 0.1 * k, 0] for k in range(3) for sign in (-1, 1)]
    velocity = [[-sign * v / 2, 0, 0] for v in speeds for sign in (-1, 1)]
    return scene(position, velocity, (Impact(hardness=design["hardness"]),), dt=1e-6, steps=200)


def rebound_speeds(result):
    """Relative speed of each pair after the impact, m/s."""
    velocity = by_id(result)["velocity"][:, 0]
    return tuple(velocity[1::2] - velocity[::2])


EXPERIMENTS = {
    "friction": Experiment(GRANULAR_GENES, slide_roll_and_bounce, speeds_and_spins, (0.05, 0.2, 0.03, 0.02)),
    "flux": Experiment(
        (Gene("flux", "T", 0.004, 0.02), Gene("speed", "m/s", 0.5, 2.0)),
        drawn_together, gap_and_way, (0.02, 0.3),
    ),
    "hardness": Experiment(
        (Gene("hardness", "Pa", 1e4, 1e6, "log"),), rebounds, rebound_speeds, (0.03, 0.03, 0.03)
    ),
}  # fmt: skip


class KnownAnswers:
    """Searches for the true designs of an experiment; all share one evaluator, which compiles once."""

    def __init__(self, name):
        self.name, self.experiment = name, EXPERIMENTS[name]
        self.genome = Genome(self.experiment.genes)
        self.evaluator = evaluator_named("batch", threads=1)

    def quantities(self, design):
        """The quantities of a run at a design."""
        ((_, result),) = self.evaluator.evaluate([self.experiment.scene(design, 0)])
        assert result.status.ok, result.status.reason
        return np.array(self.experiment.quantities(result))

    def outcome(self, seed, runs=RUNS):
        """(true design, outcome of the search for it)."""
        rng = np.random.default_rng(seed)
        truth = self.genome.decode(rng.uniform(0.25, 0.75, len(self.genome)))
        uncertainty = np.array(self.experiment.uncertainty)
        measured = self.quantities(truth) + uncertainty * rng.normal(size=len(uncertainty))

        names = [f"quantity {k}" for k in range(len(measured))]
        pairs = zip(measured, uncertainty, strict=True)
        statistic = Misfit(dict(zip(names, pairs, strict=True)))

        def quantities(result):
            return dict(zip(names, self.experiment.quantities(result), strict=True))

        problem = Problem(
            name=self.name,
            genome=self.genome,
            scene=self.experiment.scene,
            objective=(Objective("misfit", quantities, statistic=statistic),),
            code=f"{self.name} {seed}",
        )
        with tempfile.TemporaryDirectory() as folder, Cache(Path(folder) / "search.h5") as cache:
            settings = Settings(seed=seed, max_evaluations=runs, generations=10**6)
            return truth, search(problem, self.evaluator, cache, settings)

    def inside(self, seed, runs=RUNS):
        """For each gene, whether its interval contains the truth, and the width as a fraction of its
        range."""
        truth, outcome = self.outcome(seed, runs)
        found = optimize.calibration(outcome).genes
        assert found, "too few designs near the least misfit"
        return [(one.low <= truth[one.name] <= one.high, one.part) for one in found]


def coverage(name, data_sets, runs=RUNS):
    """Fraction of the intervals of each gene that contain the truth, and their median fraction of the
    range."""
    experiments = KnownAnswers(name)
    found = np.array([experiments.inside(seed, runs) for seed in range(data_sets)], dtype=float)
    return found[..., 0].mean(axis=0), np.median(found[..., 1], axis=0)


if __name__ == "__main__":
    number, *names = sys.argv[1:] or ["40"]
    tisim.init(threads=1)
    for name in names or EXPERIMENTS:
        inside, part = coverage(name, int(number))
        for gene, hits, width in zip(EXPERIMENTS[name].genes, inside, part, strict=True):
            print(
                f"{gene.name:17s} truth inside {hits:.3f}, interval {100 * width:.1f} % of its range",
                flush=True,
            )
