"""Print how packings of spheres depend on the attempts of mechanical contraction and on their number, the
tables in docs/packings.md. About four minutes of one core of an AMD EPYC (Zen 4).

    python -m tests.benchmarks.packing_accuracy [attempts] [number]
"""

import sys

import numpy as np

from tisim import Scene, run
from tisim.analysis import Mean
from tisim.cases.common.runs import sound
from tisim.cases.packing.measures import fraction_of, mean_contacts
from tisim.cases.packing.scene import packed_by, rod, scene_for
from tisim.steppers import EnergyMinimisation, MechanicalContraction, Stepper

ATTEMPTS = (20, 60, 200, 600, 2000)
ATTEMPT_STARTS = 24
NUMBERS = {32: 96, 64: 96, 128: 48, 256: 16}
"""Number of spheres and of random starts."""
OTHER_SETTINGS = {
    "": {},
    "volume step / 10": {"volume_step": 0.1},
    "volume step * 10": {"volume_step": 10.0},
    "tolerance 1e-3": {"tolerance": 1e-3},
    "tolerance 1e-2": {"tolerance": 1e-2},
    "motion 0.3": {"motion": 0.3},
    "motion 1": {"motion": 1.0},
    "motion 3": {"motion": 3.0},
}
"""Settings of mechanical contraction; the volume step is a factor here."""
TRIED = 600
"""Attempts with other settings."""


def measured(scenes: list[Scene]) -> tuple[np.ndarray, np.ndarray, float]:
    """Packing fraction and contact number of each packing, and the mean number of steps."""
    results = sound(run(scenes))
    values = np.array([(fraction_of(one), mean_contacts(one)) for one in results])
    return values[:, 0], values[:, 1], float(np.mean([one.work["steps"] for one in results]))


def contracted(stepper: Stepper) -> list[Scene]:
    """Packings of the small size by a stepper, from the same starts for all steppers."""
    packed = scene_for("small", 0)
    return [packed.model_copy(update={"seed": k, "stepper": stepper}) for k in range(ATTEMPT_STARTS)]


def print_attempts() -> None:
    """Print the distance from the jamming density by method and attempts, and with other settings."""
    jammed, contacts, steps = measured(contracted(EnergyMinimisation()))
    print(f"energy minimisation: {Mean.of(jammed)}, {Mean.of(contacts)} contacts, {steps:.0f} steps")
    own = scene_for("small", 0).stepper
    assert isinstance(own, MechanicalContraction)
    for method in ("original", "revised"):
        distances = []
        for attempts in ATTEMPTS:
            stepper = own.model_copy(update={"method": method, "attempts": attempts})
            fraction, contacts, steps = measured(contracted(stepper))
            off = Mean.of(jammed - fraction)
            distances.append(off.value)
            print(f"| {method} | {attempts} | {off} | {Mean.of(contacts)} | {steps:.0f} |", flush=True)
        order = np.polyfit(np.log(ATTEMPTS), np.log(distances), 1)[0]
        print(f"{method}: the distance falls as attempts^{order:.2f}")
    for name, change in OTHER_SETTINGS.items():
        step = own.volume_step * change.get("volume_step", 1.0)
        stepper = own.model_copy(update={"attempts": TRIED, **change, "volume_step": step})
        fraction, contacts, steps = measured(contracted(stepper))
        off = Mean.of(jammed - fraction)
        print(f"| revised | {name} | {off} | {Mean.of(contacts)} | {steps:.0f} |", flush=True)


def print_numbers() -> None:
    """Print packing fraction and its standard deviation by the number of spheres."""
    spreads = []
    for number, starts in NUMBERS.items():
        scenes = [packed_by(EnergyMinimisation(), rod(1.0), number, 0.2, seed=k) for k in range(starts)]
        fraction, contacts, steps = measured(scenes)
        spreads.append(fraction.std(ddof=1))
        print(
            f"| {number} | {Mean.of(fraction)} | {spreads[-1]:.4f} | {Mean.of(contacts)} | {steps:.0f} |",
            flush=True,
        )
    order = np.polyfit(np.log(list(NUMBERS)), np.log(spreads), 1)[0]
    print(f"the standard deviation falls as N^{order:.2f}")


if __name__ == "__main__":
    chosen = sys.argv[1:] or ["attempts", "number"]
    if "attempts" in chosen:
        print_attempts()
    if "number" in chosen:
        print_numbers()
