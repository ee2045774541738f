"""Print the heat of reaction of grains in a row that bond and are then pressed together, by number of steps.

    python tests/benchmarks/pressed_grains.py

Rows of touching grains close in at 1 m/s and attract each other for 0.1 ms. Heat is over the heat of one
bonding impact. Grains in a row hit each other repeatedly until the row comes to rest; then impacts end.
"""

import numpy as np

from tisim import Particles, Scene, run
from tisim.effects import Heating, Impact, NearField, Reaction
from tisim.steppers import FixedStep, Verlet

RADIUS, DENSITY, DURATION = 1e-3, 2000.0, 1e-4
ALPHA = 10.0
NUMBERS, STEPS = (2, 3, 4, 8), (100, 1000, 10000)


def row(number: int, steps: int) -> Scene:
    """Grains in a row, all moving towards its middle."""
    x = (np.arange(number) - (number - 1) / 2) * 2 * RADIUS * (1 - 1e-9)
    zero = np.zeros(number)
    return Scene(
        particles=Particles(
            position=np.stack([x, zero, zero], axis=1),
            velocity=np.stack([-np.sign(x), zero, zero], axis=1),
            radius=RADIUS,
            density=DENSITY,
            quantities={"temperature": 300.0},
        ),
        effects=(
            Impact(hardness=1e-3, initial_area=0.3),
            Heating(heat_capacity=1000.0),
            Reaction(energy_density=ALPHA),
            NearField(alpha1=1e-6),
        ),
        stepper=Verlet(control=FixedStep(dt=DURATION / steps)),
        duration=DURATION,
    )


def main() -> None:
    """Print the table of docs/agglomeration.md."""
    cases = [(number, steps) for number in NUMBERS for steps in STEPS]
    once = 2 * ALPHA * np.pi * RADIUS**2
    print("| grains | steps | impacts | contacts | heat of reaction |\n|---|---|---|---|---|")
    for (number, steps), result in zip(cases, run([row(*case) for case in cases]), strict=True):
        heat, work = result.state["reaction_heat"].sum() / once, result.work
        print(f"| {number} | {steps} | {work['impacts']} | {work.get('contacts', 0)} | {heat:.3g} |")


if __name__ == "__main__":
    main()
