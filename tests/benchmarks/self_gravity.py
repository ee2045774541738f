"""Gravity between particles, by a tree and over all pairs: errors, times, conservation.

    python tests/benchmarks/self_gravity.py errors [--numbers 1000 10000 100000] [--precision f64]
    python tests/benchmarks/self_gravity.py time [--numbers 1000 3000 10000 30000 100000] [--threads 1]
    python tests/benchmarks/self_gravity.py drift [--numbers 1000]

``errors`` compares forces with a sum over all pairs in NumPy in f64, for at most 500 of the particles: root
mean square and largest error, each over the root mean square of the force; and the sum of all forces, which
should be 0, over the sum of their magnitudes. It does so in a uniform ball and in a Plummer sphere, whose
middle is dense. ``time`` prints the CPU time of the process per particle and step, the smallest of several
tries; the crossover is the number of particles at which both cost the same. ``drift`` prints the drift of
energy and momenta, with softening, for a ball that collapses from a slow rotation and for a Plummer sphere in
balance, over five dynamical times (a^3 / (G M))^(1/2), by Verlet with the same steps.
"""

import argparse
import sys
import time
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np
from scipy.constants import G

from tisim import Particles, Scene, Simulation
from tisim.analysis import angular_momentum, gravitational_energy
from tisim.backend import runtime
from tisim.effects import SelfGravity, SoftenedSelfGravity, TreeGravity
from tisim.steppers import FixedStep, Verlet

TOTAL = 1e9
"""Total mass, kg."""
SCALE = 1.0
"""m; the radius of the ball, and the scale radius of the Plummer sphere."""
DYNAMICAL = (SCALE**3 / (G * TOTAL)) ** 0.5
"""s."""
SOFTENING = 0.05 * SCALE
ANGLES = (0.2, 0.3, 0.4, 0.5, 0.6, 0.7, 0.8)
PROBES = 500


def directions(draw: np.random.Generator, n: int) -> np.ndarray:
    """Unit vectors, uniform over all directions."""
    v = draw.normal(size=(n, 3))
    return np.asarray(v / np.linalg.norm(v, axis=1)[:, None])


def ball(draw: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions in a uniform ball, and velocities of a rotation so slow that the ball collapses."""
    place = SCALE * directions(draw, n) * draw.uniform(0, 1, n)[:, None] ** (1 / 3)
    return place, np.cross([0, 0, 0.2 / DYNAMICAL], place)


def plummer(draw: np.random.Generator, n: int) -> tuple[np.ndarray, np.ndarray]:
    """Positions and velocities of a Plummer sphere in balance, truncated at 10 times its scale radius.

    Source: S. J. Aarseth, M. Henon, R. Wielen, Astron. Astrophys. 37 (1974) 183.
    """
    mass = draw.uniform(0, (1 + 0.01) ** -1.5, n)
    r = SCALE * (mass ** (-2 / 3) - 1) ** -0.5
    part = np.zeros(n)
    waiting = np.arange(n)
    while len(waiting):
        q, u = draw.uniform(0, 1, (2, len(waiting)))
        taken = 0.1 * u < q**2 * (1 - q**2) ** 3.5
        part[waiting[taken]] = q[taken]
        waiting = waiting[~taken]
    escape = np.sqrt(2 * G * TOTAL / SCALE) * (1 + (r / SCALE) ** 2) ** -0.25
    return directions(draw, n) * r[:, None], directions(draw, n) * (part * escape)[:, None]


STARTS = {"ball": ball, "Plummer sphere": plummer}


def scene(start, law, dt: float = 1e-9, duration: float = 1.0) -> Scene:
    """Equal particles from such a start."""
    place, velocity = start
    n = len(place)
    return Scene(
        particles=Particles(position=place, velocity=velocity, radius=1e-3, mass=TOTAL / n, density=None),
        effects=(law,),
        stepper=Verlet(control=FixedStep(dt=dt)),
        duration=duration,
    )


def exact(place: np.ndarray, probes: np.ndarray) -> np.ndarray:
    """The force on the probed particles, summed over all pairs."""
    mass = TOTAL / len(place)
    force = np.zeros((len(probes), 3))
    for k, i in enumerate(probes):
        apart = place - place[i]
        square = (apart**2).sum(axis=1)
        square[i] = 1.0
        force[k] = G * mass**2 * (square[:, None] ** -1.5 * apart).sum(axis=0)
    return force


def errors(numbers: list[int]) -> None:
    print("start           particles  theta  rms       largest   force evaluation")
    for n in numbers:
        for name, start in STARTS.items():
            begin = start(np.random.default_rng(1), n)
            probes = np.arange(0, n, max(1, n // PROBES))
            expected, simulation = exact(begin[0], probes), None
            for angle in ANGLES:
                setup = scene(begin, TreeGravity(opening_angle=angle))
                simulation = simulation or Simulation(setup)
                simulation.load([setup])
                force = simulation.s.read("force")[0].astype(float)
                off = np.linalg.norm(force[probes] - expected, axis=1)
                size = np.sqrt((expected**2).sum(axis=1).mean())
                total = np.linalg.norm(force.sum(axis=0)) / np.linalg.norm(force, axis=1).sum()
                rms, most = np.sqrt((off**2).mean()) / size, off.max() / size
                print(f"{name:15s} {n:9d}  {angle:5.1f}  {rms:.1e}   {most:.1e}   {total:.1e}", flush=True)
            simulation.close()


def times(numbers: list[int], tries: int) -> None:
    laws = (SelfGravity(), *(TreeGravity(opening_angle=angle) for angle in (0.3, 0.5, 0.8)))
    print("CPU time for a particle and step, us")
    print("particles      all pairs      theta 0.3      theta 0.5      theta 0.8")
    for n in numbers:
        begin, columns, simulation = ball(np.random.default_rng(1), n), [], None
        for law in laws:
            setup = scene(begin, law)
            if simulation is None or simulation.structure != setup.structure():
                simulation = Simulation(setup)
            simulation.load([setup])
            steps = max(1, 3000 // n)
            simulation.program.advance(1)
            seconds = []
            for _ in range(tries):
                before = time.process_time()
                simulation.program.advance(steps)
                seconds.append((time.process_time() - before) / steps)
            columns.append(1e6 * min(seconds) / n)
        print(f"{n:9d}  " + "".join(f"{column:13.2f}  " for column in columns), flush=True)


def drift(numbers: list[int]) -> None:
    dt, duration = DYNAMICAL / 100, 5 * DYNAMICAL
    print("start           particles  law         energy    angular momentum   momentum")
    for n in numbers:
        for name, start in STARTS.items():
            begin, simulations = start(np.random.default_rng(1), n), {}
            laws = {"all pairs": SoftenedSelfGravity(softening_length=SOFTENING)}
            for angle in (0.3, 0.5, 0.8):
                laws[f"theta {angle}"] = TreeGravity(opening_angle=angle, softening_length=SOFTENING)
            for label, law in laws.items():
                setup = scene(begin, law, dt, duration)
                if type(law) not in simulations:
                    simulations[type(law)] = Simulation(setup)
                simulation = simulations[type(law)]
                simulation.load([setup])
                simulation.run()
                (result,) = simulation.results()
                print(f"{name:15s} {n:9d}  {label:10s} " + changes(result), flush=True)
            for simulation in simulations.values():
                simulation.close()


def changes(result) -> str:
    """The change of energy over the initial energy, and the changes of momenta over the sum of their
    magnitudes."""
    told = []
    for state in (result.start, result.state):
        mass, place, velocity = state["mass"], state["position"], state["velocity"]
        kinetic = 0.5 * (mass * (velocity**2).sum(axis=1)).sum()
        turning = angular_momentum(place, velocity, mass)
        momentum = (mass[:, None] * velocity).sum(axis=0)
        told.append((kinetic + gravitational_energy(place, mass, SOFTENING), turning, momentum))
    arm = mass * np.linalg.norm(place - place.mean(axis=0), axis=1) * np.linalg.norm(velocity, axis=1)
    energy = (told[1][0] - told[0][0]) / abs(told[0][0])
    turn = np.linalg.norm(told[1][1] - told[0][1]) / arm.sum()
    push = np.linalg.norm(told[1][2] - told[0][2]) / (mass * np.linalg.norm(velocity, axis=1)).sum()
    return f"{energy:9.1e}   {turn:9.1e}          {push:9.1e}"


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("what", choices=("errors", "time", "drift"))
    parser.add_argument("--numbers", type=int, nargs="+", help="of particles")
    parser.add_argument("--precision", choices=("f64", "f32"), default="f64")
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--device", default="cpu")
    parser.add_argument("--tries", type=int, default=5)
    options = parser.parse_args()
    settings = runtime.init(
        device=options.device, precision=options.precision, threads=options.threads
    ).settings
    print(settings)
    if options.what == "errors":
        errors(options.numbers or [1000, 10000, 100000])
    elif options.what == "time":
        times(options.numbers or [1000, 3000, 10000, 30000, 100000], options.tries)
    else:
        drift(options.numbers or [1000])


if __name__ == "__main__":
    main()
