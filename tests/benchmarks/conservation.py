"""Conservation of energy and momentum by each stepper, for particles that attract and repel each other.

    python tests/benchmarks/conservation.py [--sites 7]

The cubic array of Z13 section 4 with the published near field and nothing else: no tether, no field. The
array flies apart for 0.005 s. For each stepper: force evaluations, change of the energy over the kinetic
energy at the end, and change of the momentum over the sum of the magnitudes of the particles' momenta.
"""

import argparse
import sys
from pathlib import Path

sys.path.insert(0, str(Path(__file__).parents[2]))

import numpy as np

from tisim import Result, run
from tisim.backend import runtime
from tisim.cases.vibration.scene import ATTRACTION, REPULSION, scene
from tisim.effects import NearField
from tisim.steppers import (
    Collocation,
    ErrorControl,
    FixedStep,
    IterationControl,
    StageControl,
    Stepper,
    Trapezoid,
    Verlet,
)


def trapezoid(error: float) -> Trapezoid:
    return Trapezoid(control=ErrorControl(error=error, tolerance=error / 10, first=1e-7, longest=1e-3))


STEPPERS: dict[str, Stepper] = {
    "Verlet, 500 steps": Verlet(control=FixedStep(dt=1e-5)),
    "Trapezoid, as Z16 section 8.1": Trapezoid(control=IterationControl()),
    "Trapezoid, error=1e-3": trapezoid(1e-3),
    "Trapezoid, error=1e-5": trapezoid(1e-5),
    "Collocation, error=1e-4": Collocation(control=StageControl(error=1e-4)),
    "Collocation, error=1e-8": Collocation(control=StageControl(error=1e-8)),
}


def energy(mass: np.ndarray, position: np.ndarray, velocity: np.ndarray) -> tuple[float, float]:
    """Kinetic and pair energy: alpha_1 ln d + alpha_2/d for each pair. J."""
    a, b = np.triu_indices(len(mass), 1)
    d = np.linalg.norm(position[a] - position[b], axis=1)
    kinetic = 0.5 * float((mass * (velocity**2).sum(axis=1)).sum())
    return kinetic, float((ATTRACTION * np.log(d) + REPULSION / d).sum())


def drift(result: Result) -> tuple[float, float]:
    """Relative drifts of energy and of momentum."""
    names = ("mass", "position", "velocity")
    before, after = ([state[n] for n in names] for state in (result.start, result.state))
    kinetic, pairs = energy(*after)
    momentum = [m[:, None] * v for m, _, v in (before, after)]
    change = np.linalg.norm(momentum[1].sum(axis=0) - momentum[0].sum(axis=0))
    size = np.linalg.norm(momentum[1], axis=1).sum()
    return (kinetic + pairs - sum(energy(*before))) / kinetic, float(change / size)


def measure(stepper: Stepper, sites: int) -> Result:
    """A run of the bare array."""
    effects = (NearField(alpha1=ATTRACTION, beta1=1, alpha2=REPULSION, beta2=2),)
    return run(scene(sites=sites).model_copy(update={"effects": effects, "stepper": stepper}))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--sites", type=int, default=7)
    options = parser.parse_args()
    runtime.init()
    for name, stepper in STEPPERS.items():
        result = measure(stepper, options.sites)
        sums = result.work.get("force_evaluations", result.work["steps"])
        of_energy, of_momentum = drift(result)
        print(
            f"{name:32s} {sums:6d} force evaluations  "
            f"energy off by {of_energy:+.1e}  momentum by {of_momentum:.1e}"
        )


if __name__ == "__main__":
    main()
