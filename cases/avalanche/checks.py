"""Checks of the avalanche: findings of L21 that a narrow cell can reproduce, and relations that hold
exactly."""

import math
from collections.abc import Iterator, Sequence

import numpy as np

from tisim import Particles, Result, Scene, run
from tisim.analysis import Mean
from tisim.cases.avalanche.measures import load_on_walls
from tisim.cases.avalanche.scaling import attraction, moment, moment_eigenvalues, ratio, weight
from tisim.cases.avalanche.scene import DEFAULT, DIAMETERS, FLUX, RELAXATION, magnetism
from tisim.cases.avalanche.stages import SLOPES, Avalanche, avalanches, larger, of, steeper_by
from tisim.cases.case import Check, Claim, Shown
from tisim.steppers import FixedStep, Verlet

CHECKED_SEEDS = 6
"""Number of random starts of each avalanche."""
MAGNETISATION = 11.9e3
"""Magnetisation of a single grain at 5 mT, A/m (L21 section 4.5)."""
BALANCE = 0.02
"""Largest relative difference between the load on the walls and the weight of the grains at rest."""


def check(seeds: int = CHECKED_SEEDS) -> Iterator[Check | Claim | Shown]:
    """Yield the checks of two grains and of avalanches from several starts."""
    yield from of_two_grains()
    wanted = [(d, field, seed) for d in DIAMETERS for field in (0.0, FLUX) for seed in range(seeds)]
    yield from of_avalanches(avalanches(DEFAULT, wanted))


def pairs() -> list[Result]:
    """Return two grains of each diameter in contact along the field, after one step."""
    scenes = []
    for d in DIAMETERS:
        place = np.array([[0.0, 0.0, 0.0], [0.0, 0.0, d]])
        grains = Particles(position=place, velocity=np.zeros((2, 3)), radius=d / 2, mass=1.0)
        stepper = Verlet(control=FixedStep(dt=1e-9))
        scenes.append(Scene(particles=grains, effects=magnetism(FLUX), stepper=stepper, duration=1e-7))
    return run(scenes)


def of_two_grains() -> Iterator[Check]:
    """Yield the magnetisation, and the attraction divided by the weight.

    The ratio is about 10 for grains of 5 mm and about 1 for grains of 5 cm (L21 section 4.5).
    """
    for d, result in zip(DIAMETERS, pairs(), strict=True):
        name = f"{1e3 * d:g} mm"
        force = abs(float(result.state["force"][0, 2]))
        yield Check(
            f"{name}: attraction of two grains over weight", force / weight(d), ratio(d), 1e-5 * ratio(d)
        )
        if d == DIAMETERS[0]:
            alone = moment(d) / (math.pi / 6 * d**3)
            yield Check(f"{name}: magnetisation of a single grain, A/m", alone, MAGNETISATION, 50.0)
            tenfold = math.log10(attraction(d) / weight(d))
            yield Check(f"{name}: log10 of attraction over weight (L21: 1)", tenfold, 1.0, 0.3)


def of_avalanches(runs: Sequence[Avalanche]) -> Iterator[Check | Claim | Shown]:
    """Yield the checks of avalanches with and without a field.

    The angle of magnetised slopes is not checked: in a heap this small, chains of grains are as high as the
    heap.
    """
    off = max(abs(load_on_walls(one.end) - 1) for one in runs)
    yield Check("load on the walls over weight, largest deviation", 1 + off, 1.0, BALANCE)
    by_size = {d: (of(runs, d, 0.0), of(runs, d, FLUX)) for d in DIAMETERS}
    loosened: list[np.ndarray] = []
    for d, (without, magnetised) in by_size.items():
        name = f"{1e3 * d:g} mm"
        angle, theirs = Mean.of([one.angle for one in without]), SLOPES[d][0].angle
        yield Claim(f"{name}, without a field: angle, degrees (L21: {theirs:.1f})", angle, 20.0, 40.0)
        grown = [b.volume / a.volume for a, b in zip(without, magnetised, strict=True)]
        loosened.append(np.array([one.loosened for one in magnetised]))
        for what, values in (
            (f"volume with field over volume without (L21: {larger(d):.2f})", grown),
            ("volume magnetised over volume settled", loosened[-1]),
        ):
            # For larger grains these few starts cannot distinguish the value from 1.
            judged = d == DIAMETERS[0]
            mean = Mean.of(values)
            yield Claim(f"{name}: {what}", mean, 1.0) if judged else Shown(f"{name}: {what}", mean)
    small, _, large = loosened
    yield Claim("growth of the volume, 5 mm minus 5 cm", Mean.of(small - large), least=0.0)
    alike = steeper_by(by_size[DIAMETERS[0]][0], by_size[DIAMETERS[2]][0])
    theirs = SLOPES[DIAMETERS[0]][0].angle - SLOPES[DIAMETERS[2]][0].angle
    beside = f"0 for scaled copies; L21: {theirs:.1f}"
    yield Shown("without a field: angle of 5 mm minus 5 cm, degrees", Mean.of(alike), beside)
    bed = by_size[DIAMETERS[0]][1][0]
    yield from of_sweeps("settled", moment_eigenvalues(bed.settled, bed.width))
    yield from of_sweeps("magnetised", moment_eigenvalues(bed.magnetised, bed.width))
    deepest = Mean.of([one.overlap for one in by_size[DIAMETERS[0]][1]])
    yield Claim("5 mm, magnetised: largest overlap over a radius", deepest, most=0.03)


def of_sweeps(bed: str, eigenvalues: np.ndarray) -> Iterator[Check | Shown]:
    """Yield the eigenvalues of a whole sweep of the moments of a bed, and the check that the relaxed sweeps
    converge."""
    for name, value in (("least", eigenvalues[0]), ("largest", eigenvalues[-1])):
        yield Shown(
            f"5 mm, {bed}: {name} eigenvalue of mutual magnetisation", float(value), "unrelaxed: -1 to 1"
        )
    off = np.abs(1 - RELAXATION + RELAXATION * eigenvalues[[0, -1]]).max()
    yield Check(f"5 mm, {bed}: growth factor of a relaxed sweep", float(off), 0.0, 1.0)
