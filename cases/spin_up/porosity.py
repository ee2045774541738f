"""Porosity of piles at rest by number of grains and spacing of the cloud, beside L21's 83.0 %.

    python -m tisim.cases.spin_up.porosity [--starts 4]

L21's pile has 4088 grains, which fall from a lattice of 2 m. The default of this case has 80, from a lattice
of 1.3 m. As in L21 (section 4.2.2.3), the volume of a pile is its convex hull.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from tisim import Result
from tisim.analysis import Mean
from tisim.cases.coalescence import published
from tisim.cases.common.rubble_pile import Asteroid
from tisim.cases.common.runs import grouped
from tisim.cases.spin_up.scene import DEFAULT, scene
from tisim.cases.spin_up.stages import POROSITY
from tisim.engine.batches import Progress
from tisim.errors import must

PILES = (80, 160)
"""Numbers of grains of the compared piles."""
SPACINGS = (DEFAULT["spacing"], published.SPACING)
"""Spacings of the lattice from which they fall, m: of the default, and L21's."""
COMPARED_PILES = (published.MAGNETISATIONS[0], published.MAGNETISATIONS[-1])
"""Magnetisations of L21's grains, A/m."""
PILE_STARTS = 4
"""Number of random starts of each pile."""


@dataclass(frozen=True)
class Piles:
    """The starts of a pile. number : of grains. spacing : of the lattice, m. magnetisation : A/m."""

    number: int
    spacing: float
    magnetisation: float
    results: Sequence[Result]

    @property
    def porosities(self) -> np.ndarray:
        """Return the porosity of each start; shape (starts,)."""
        densities = [Asteroid.of(one.state).density for one in self.results]
        return 1 - np.array(densities) / published.DENSITY


def settled_at(spacing: float) -> float:
    """Return the time (s) at which a pile from a lattice of a spacing (m) is at rest, as many free-fall times
    as in the default."""
    return float(DEFAULT["duration"] * (spacing / DEFAULT["spacing"]) ** 1.5)


def by_number_and_spacing(
    starts: int = PILE_STARTS,
    progress: Progress = lambda part: None,
    numbers: Sequence[int] = PILES,
    spacings: Sequence[float] = SPACINGS,
) -> list[Piles]:
    """Run piles of several numbers of grains, from lattices of several spacings (m), to rest."""
    wanted = [(n, s, m) for n in numbers for s in spacings for m in COMPARED_PILES]
    scenes = [
        scene(**{**DEFAULT, "number": n, "spacing": s, "duration": settled_at(s)}, magnetisation=m, seed=seed)
        for n, s, m in wanted
        for seed in range(starts)
    ]
    groups = grouped(scenes, starts, progress)
    return [Piles(*one, group) for one, group in zip(wanted, groups, strict=True)]


def report(found: Sequence[Piles]) -> str:
    """Return the numbers as text."""
    lines = [f"porosity at rest (L21, 4088 grains, 1190 A/m: {POROSITY:.3g}):"]
    lines += [
        f"  {one.number} grains from a lattice of {one.spacing:g} m, {one.magnetisation:g} A/m:"
        f" {Mean.of(one.porosities)}"
        for one in found
    ]
    return "\n".join(lines)


def main() -> None:
    """Run the piles and print their porosities."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--starts", type=int, default=PILE_STARTS, help="number of starts of each pile")
    options = parser.parse_args()
    must(options.starts >= 2, "starts", "at least 2, for an interval", options.starts)
    print(report(by_number_and_spacing(options.starts)))


if __name__ == "__main__":
    main()
