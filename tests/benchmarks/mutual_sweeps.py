"""Sweeps that solve for mutually induced moments of touching spheres in the limit of infinite mu_r, plain and
mixed.

python tests/benchmarks/mutual_sweeps.py
"""

from __future__ import annotations

import numpy as np

import tisim
from tisim.effects import MutualInducedMoment
from tisim.sources import MagneticField
from tisim.steppers import FixedStep, Verlet

MOST = 2000
"""With more sweeps than this, the iteration counts as not converging."""


def packed(number: int, fraction: float) -> np.ndarray:
    """Return centres of spheres of radius 1 at random positions that fill a fraction of a cube,
    shape (n, 3)."""
    draw, side, places = np.random.default_rng(0), (number * 4 / 3 * np.pi / fraction) ** (1 / 3), []
    while len(places) < number:
        place = draw.uniform(0, side, 3)
        if all(np.linalg.norm(place - other) > 2 for other in places):
            places.append(place)
    return np.array(places)


ARRANGEMENTS = {
    "two, in line": 2.0 * np.array([[0, 0, 0], [0, 0, 1]]),
    "a chain of 30": 2.0 * np.outer(np.arange(30), [0, 0, 1]),
    "300 at random": packed(300, 0.3),
    "a cubic lattice of 216": 2.0 * np.argwhere(np.ones((6, 6, 6))),
}


def sweeps(place: np.ndarray, acceleration: str) -> str:
    """Return the number of sweeps for the first moments, from zero to a change of 1e-8."""
    law = MutualInducedMoment(susceptibility=1e12, sweeps=MOST, acceleration=acceleration)
    scene = tisim.Scene(
        particles=tisim.Particles(position=place, velocity=0 * place, radius=1.0, mass=1.0),
        effects=(MagneticField(constant=(0, 0, 1.0)), law),
        stepper=Verlet(control=FixedStep(dt=1.0)),
        duration=1.0,
    )
    simulation = tisim.Simulation(scene)
    simulation.load([scene])
    (result,) = simulation.results()
    simulation.close()
    return (
        "none"
        if not result.status.ok and "converge" in result.status.reason
        else str(result.work["mutual_sweeps"])
    )


def main() -> None:
    print(f"{'':24s} plain mixed")
    for name, place in ARRANGEMENTS.items():
        print(f"{name:24s} {sweeps(place, 'none'):>5s} {sweeps(place, 'anderson'):>5s}")


if __name__ == "__main__":
    main()
