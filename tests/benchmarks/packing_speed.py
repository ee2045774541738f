"""CPU time of packing steppers: an attempt by the number of bodies, a batch beside single runs, packings a
minute, superballs near the end of a packing, and FIRE beside LAMMPS: the tables in docs/packings.md.

    python tests/benchmarks/packing_speed.py [--parts PART ...] [--most 100000] [--turns 3] [--device cpu]
        [--threads 1]

CPU time on one thread; on several threads, or on a card, time on the clock. ``narrow_phase.py`` has the time
of a pair, beside coal.

attempts: of mechanical contraction, and of all steppers for rods, of bodies that start at random points at a
packing fraction of 0.5, after 200 steps. Steps are measured with the list
rebuilds they cause.

batch: 100 packings of 100 bodies each, from 0.2 to the end, in one batch and one after the other.

superballs: attempts of the packings of docs/packing_study.md, from attempt 40,000 on, when most pairs touch.

fire: the same spheres with the same springs at a packing fraction of 0.68, above jamming: U = 1/2 sum
(delta/D)^2, by ``min_style fire`` of LAMMPS, which is FIRE 2.0 too, with ``pair_style harmonic/cut``. The
times are of one evaluation; each program has its own lists. (LAMMPS has no rods or superquadrics that pack.)
"""

from __future__ import annotations

import argparse
import sys
import time
from collections.abc import Callable, Iterator
from functools import partial
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from tests.benchmarks import lammps_peer
from tests.benchmarks.turns import rest, spread
from tisim import Box, Particles, Scene, Simulation
from tisim.analysis.packings.gaps import near_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.backend import runtime
from tisim.backend.processor import processor
from tisim.cases.packing.scene import hard, of_shape, rod, spheroid, superball
from tisim.cases.packing.studies import plans
from tisim.shapes.particle_shape import ParticleShape
from tisim.steppers import EnergyMinimisation, MechanicalContraction, MonteCarloGrowth
from tisim.steppers.packing.packing_stepper import PackingStepper

DENSITY, START, JAMMED = 0.5, 0.2, 0.68
"""Packing fractions: of the bodies whose attempts are timed, of the start of a packing, and of spheres that
cannot be separated."""
SHAPES: dict[str, ParticleShape] = {
    "spheres": rod(1.0),
    "rods, L/D = 0.5": rod(1.5),
    "rods, L/D = 4": rod(5.0),
    "ellipsoids 1:1:2": spheroid(2.0),
    "superballs, exponent 5": superball(5.0),
}
ALL_STEPPERS = ("rods, L/D = 4",)
"""The bodies whose attempts are timed with each stepper, not with contraction alone."""
WARM, TIMED = 200, 50
"""Attempts before the measurement, and in it."""
PACKED = ("spheres", "rods, L/D = 0.5")
WORLDS, BODIES = 100, 100
"""The packings of a batch: bodies, number of packings, and bodies of each."""
EXPONENTS, NEAR_END, ATTEMPTS = (2.5, 3.0, 5.0), 40_000, 5000
"""The superballs whose attempts are timed near the end, the attempts before the measurement, and in it."""
EVALUATIONS = 400
"""Evaluations of FIRE that are timed."""


def at_random(
    shape: ParticleShape, number: int, fraction: float, stepper: PackingStepper, seed: int = 0, **more: float
) -> Scene:
    """Bodies at random points of a periodic cube; they may overlap."""
    side = float(np.cbrt(number * shape.volume() / fraction))
    particles = Particles(
        position=np.random.default_rng(seed).uniform(0, side, (number, 3)),
        velocity=np.zeros((number, 3)),
        mass=1.0,
        radius=shape.bounding_radius(),
    )
    return Scene(
        particles=particles,
        effects=[hard(shape)],
        domain=Box(low=(0, 0, 0), high=(side, side, side)),
        duration=more.get("duration", 1e9),
        stepper=stepper,
        seed=seed,
    )


def contraction(shape: ParticleShape, attempts: int = 200) -> MechanicalContraction:
    """The contraction that suits a shape."""
    method = "original" if shape.rod() else "revised"
    return MechanicalContraction(method=method, volume_step=2.0, attempts=attempts, halvings=3, motion=0.5)


clock: Callable[[], float] = time.process_time
"""CPU time (s) on one thread; time.perf_counter on several, or on a card."""


def used(work: Callable[[], object]) -> float:
    """Time of a call, s."""
    rest()
    begin = clock()
    work()
    return clock() - begin


def numbers(least: int, most: int) -> Iterator[int]:
    """Powers of ten times the least number, up to the largest."""
    while least <= most:
        yield least
        least *= 10


def attempts(most: int, turns: int) -> None:
    """Print the table of attempts."""
    sizes = list(numbers(100, most))
    print("| stepper | bodies | " + " | ".join(f"N = {n:,}" for n in sizes) + " |")
    print("|---|---|" + "---|" * len(sizes))
    for name, shape in SHAPES.items():
        steppers: list[PackingStepper] = [contraction(shape, 10**9)]
        if name in ALL_STEPPERS:
            steppers += [EnergyMinimisation(patience=10**9), MonteCarloGrowth(precision=1e-12)]
        for stepper in steppers:
            cells = [attempt(at_random(shape, n, DENSITY, stepper), turns) for n in sizes]
            print(f"| {stepper.kind()} | {name} | {' | '.join(cells)} |", flush=True)


def attempt(scene: Scene, turns: int) -> str:
    """Time of an attempt, us a body; empty if the box is narrower than two bodies are long."""
    if scene.domain.high[0] < 4.0 * float(np.max(scene.particles.radius)):
        return ""
    simulation = Simulation(scene, 1)
    simulation.load([scene])
    simulation.run(steps=WARM)
    times = [used(lambda: simulation.run(steps=TIMED)) for _ in range(turns)]
    simulation.close()
    return spread(1e6 * np.array(times) / TIMED / scene.capacity())


def batch(turns: int) -> None:
    """Print the table of batches."""
    print(f"{WORLDS} packings of {BODIES} bodies, time a packing, s")
    print("| stepper | bodies | one batch | one after the other | ratio | packings a minute |")
    print("|---|---|---|---|---|---|")
    for name, shape in SHAPES.items():
        if name not in PACKED:
            continue
        for stepper in (contraction(shape), EnergyMinimisation(precision=1e-2, patience=200)):
            scenes = [at_random(shape, BODIES, START, stepper, seed) for seed in range(WORLDS)]
            together, single = Simulation(scenes[0], WORLDS), Simulation(scenes[0], 1)
            for simulation in (together, single):
                simulation.load(scenes[: simulation.s.worlds])
                simulation.run(steps=1)

            def all_at_once(simulation: Simulation = together, scenes: list[Scene] = scenes) -> None:
                simulation.load(scenes)
                simulation.run()

            def one_by_one(simulation: Simulation = single, scenes: list[Scene] = scenes) -> None:
                for scene in scenes:
                    simulation.load([scene])
                    simulation.run()

            pairs = np.array([(used(all_at_once), used(one_by_one)) for _ in range(turns)]) / WORLDS
            cells = spread(pairs[:, 0]), spread(pairs[:, 1]), spread(pairs[:, 1] / pairs[:, 0])
            rate = 60 / np.median(pairs[:, 0])
            print(f"| {stepper.kind()} | {name} | {' | '.join(cells)} | {rate:.3g} |", flush=True)
            together.close()
            single.close()


def superballs(turns: int) -> None:
    """Print the table of superballs near the end of a packing."""
    print("an attempt of superballs near the end of a packing, CPU time, us a body")
    print("| exponent | contraction |")
    print("|---|---|")
    for exponent in EXPONENTS:
        (plan,) = (one for one in plans("superballs") if one.shape == exponent)
        scene = of_shape(plan.body(), "default", 0, **plan.options("default"))
        simulation = Simulation(scene, 1)
        simulation.load([scene])
        simulation.run(steps=NEAR_END)
        times = [used(partial(simulation.run, steps=ATTEMPTS)) for _ in range(turns)]
        simulation.close()
        print(f"| {exponent:g} | {spread(1e6 * np.array(times) / ATTEMPTS / scene.capacity())} |", flush=True)


def fire(most: int, turns: int) -> None:
    """Print the table of FIRE beside LAMMPS."""
    if not lammps_peer.installed():
        print("LAMMPS is not installed: python -m pip install '.[bench]'")
        return
    print("an evaluation of FIRE, CPU time, us a sphere")
    print("| N | tisim | LAMMPS | LAMMPS over tisim | energy a sphere: tisim | LAMMPS |")
    print("|---|---|---|---|---|---|")
    for n in numbers(100, most):
        # Neither balance nor patience ends the minimisation.
        stepper = EnergyMinimisation(patience=10**9, balance=1e-300)
        scene = at_random(rod(1.0), n, JAMMED, stepper)
        simulation = Simulation(scene, 1)
        simulation.load([scene])
        simulation.run(steps=EVALUATIONS)
        peer = fire_by_lammps(scene)
        command = f"minimize 0 0 {EVALUATIONS} {EVALUATIONS}"
        own, other = partial(simulation.run, steps=EVALUATIONS), partial(peer.command, command)
        pairs = np.array([(used(own), used(other)) for _ in range(turns)])
        ours, theirs = 1e6 / EVALUATIONS / n * pairs.T
        ways = np.array(simulation.state["position"]), np.array(peer.numpy.extract_atom("x")[:n])
        energies = [energy(scene, places) / n for places in ways]
        # LAMMPS may end a minimisation early.
        assert peer.get_thermo("step") == (turns + 1) * EVALUATIONS
        cells = spread(ours), spread(theirs), spread(theirs / ours), *(f"{one:.3g}" for one in energies)
        print(f"| {n:,} | {' | '.join(cells)} |", flush=True)
        simulation.close()
        peer.close()


def energy(scene: Scene, position: np.ndarray) -> float:
    """Energy of the overlaps of spheres, U = 1/2 sum (delta/D)^2."""
    bodies = PackedBodies.of(rod(1.0), position, (0, 0, 0), scene.domain.high)
    return float(0.5 * (near_gaps(bodies, 0.0).gap ** 2).sum())


def fire_by_lammps(scene: Scene):
    """A LAMMPS with the same spheres and springs, after as many evaluations."""
    side, places = scene.domain.high[0], scene.particles.position
    peer = lammps_peer.begin()
    commands = (
        "units lj", "atom_style atomic", "atom_modify map array", "boundary p p p",
        f"region box block 0 {side} 0 {side} 0 {side}", "create_box 1 box",
    )  # fmt: skip
    for command in commands:
        peer.command(command)
    peer.create_atoms(len(places), None, [1] * len(places), places.ravel().tolist())
    # E = k (r - r_c)^2, half of which is a spring of 1 for k = 0.5.
    for command in (
        "mass 1 1.0", "pair_style harmonic/cut", "pair_coeff 1 1 0.5 1.0", "neighbor 0.1 bin",
        "neigh_modify delay 0 every 1 check yes", "timestep 0.05", "min_style fire",
        f"minimize 0 0 {EVALUATIONS} {EVALUATIONS}",
    ):  # fmt: skip
        peer.command(command)
    return peer


def main() -> None:
    """Print the tables."""
    global clock
    options = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    options.add_argument("--parts", nargs="+", default=["attempts", "batch", "superballs", "fire"])
    options.add_argument("--most", type=int, default=100_000)
    options.add_argument("--turns", type=int, default=3)
    options.add_argument("--device", default="cpu", choices=runtime.DEVICES)
    options.add_argument("--threads", type=int, default=1)
    given = options.parse_args()
    runtime.init(device=given.device, threads=given.threads if given.device == "cpu" else 0)
    if given.device != "cpu" or given.threads > 1:
        clock = time.perf_counter
    print(f"{processor()['model name']}, {runtime.current().described}")
    if "attempts" in given.parts:
        print(f"time of an attempt, us a body, {DENSITY} by volume\n")
        attempts(given.most, given.turns)
    if "batch" in given.parts:
        batch(given.turns)
    if "superballs" in given.parts:
        superballs(given.turns)
    if "fire" in given.parts:
        fire(min(given.most, 10_000), given.turns)


if __name__ == "__main__":
    main()
