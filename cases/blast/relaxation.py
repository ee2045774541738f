"""The ball that relaxes before the blast (Z16 section 9), and its effect on the conclusions of Z16.

    python -m tisim.cases.blast.relaxation [--number 500] [--starts 10] [--out blast_relaxation.png]

Z16 places particles by random sequential addition in a ball, "which was then allowed to dynamically converge
to an equilibrium state". Without a near field a ball of spheres that do not touch is in equilibrium already.
With a near field it contracts to one aggregate, in which attraction and contact are in balance. Both balls
are blasted here, from the same random starts.
"""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from tisim import Result, Scene, run
from tisim.analysis import Mean, contacts, labels
from tisim.cases.blast import scene as blast
from tisim.cases.blast.shape import ball, half_axes, moments
from tisim.cases.common.runs import sound
from tisim.scene.initial_state import Arrays

NEIGHBOURS_ONLY: dict[str, Any] = {"cutoff": blast.NEIGHBOURS}
WITH_NEAR_FIELD: dict[str, Any] = {"contact": True, "near": True}
NEAR_NEIGHBOURS: dict[str, Any] = {**WITH_NEAR_FIELD, **NEIGHBOURS_ONLY}
BALLS: Mapping[str, Mapping[str, Any] | None] = {
    "random": None,
    "relaxed, neighbours": NEIGHBOURS_ONLY,
    "relaxed, all pairs": {},
}
"""Balls before the blast: settings of the near field by which they relax; None for one that does not."""
BLASTS: Mapping[str, tuple[Mapping[str, Any], tuple[str, ...]]] = {
    "no interaction": ({}, tuple(BALLS)),
    "contact": ({"contact": True}, ("random", "relaxed, neighbours")),
    "near field of neighbours": (NEAR_NEIGHBOURS, ("random", "relaxed, neighbours")),
    "near field of all pairs": (WITH_NEAR_FIELD, ("random", "relaxed, all pairs")),
}
"""Settings of the blasts of Z16 Figs 5, 8 and 9, and the balls from which they start.

A blast with a near field starts from a ball that has relaxed by the same near field.
"""
ENERGIES = (1e4, 2e4, 4e4, 6e4, 8e4, 1.2e5)
"""Energies of the blast (J, of 2000 particles) with the near field of neighbours; the first is Z16's."""


def relaxing(number: int, seed: int, law: Mapping[str, Any]) -> Scene:
    """Return the random ball of a seed, which relaxes by a near field until it is at rest."""
    return blast.scene(number=number, seed=seed, **blast.RELAXATION, **law)


def largest(state: Arrays) -> int:
    """Return the number of particles in the largest cluster of touching ones."""
    pairs = contacts(state["position"], state["radius"])
    return int(np.bincount(labels(len(state["mass"]), pairs)).max())


def near_energy(state: Arrays, cutoff: float = np.inf) -> float:
    """Return the work (J) that the near field of Z16 does until all pairs are at their distance: from the
    cut-off (m), or from the diameter of the ball at the start without one.

    For a pair of masses m at the distance d, from D: m^2 (alpha_1 ln(D/d) - alpha_2 (1/d - 1/D)).
    """
    far = cutoff if np.isfinite(cutoff) else 2 * blast.BALL * (len(state["mass"]) / blast.NUMBER) ** (1 / 3)
    i, j = np.triu_indices(len(state["mass"]), 1)
    d = np.linalg.norm(state["position"][i] - state["position"][j], axis=1)
    near = d < cutoff
    d, m2 = d[near], (state["mass"][i] * state["mass"][j])[near]
    work = blast.NEAR_FIELD["alpha1"] * np.log(far / d) - blast.NEAR_FIELD["alpha2"] * (1 / d - 1 / far)
    return float((m2 * work).sum())


@dataclass(frozen=True)
class RelaxedBall:
    """A ball before the blast.

    half_axis : of the ball with the same second moments, m. time : until it is at rest, s. coordination :
    mean number of contacts of a particle. kinetic : energy over the energy of the blast. unbalanced : mean
    resultant force on a particle over the attraction of two touching ones. bound : work of the near field
    over the energy of the blast.
    """

    half_axis: float
    time: float
    coordination: float
    kinetic: float
    unbalanced: float
    bound: float

    @classmethod
    def of(cls, result: Result, cutoff: float = np.inf) -> "RelaxedBall":
        """Measure the final state of a ball that has relaxed."""
        state, number = result.state, len(result.state["mass"])
        energy = blast.ENERGY * number / blast.NUMBER
        kinetic = 0.5 * float((state["mass"] * (state["velocity"] ** 2).sum(axis=1)).sum())
        return cls(
            half_axis=ball(moments(state)),
            time=result.time,
            coordination=2 * len(contacts(state["position"], state["radius"])) / number,
            kinetic=kinetic / energy,
            unbalanced=float(np.linalg.norm(state["force"], axis=1).mean() / blast.PAIR_ATTRACTION),
            bound=near_energy(state, cutoff) / energy,
        )


@dataclass(frozen=True)
class CloudShape:
    """A cloud after the blast.

    along, across : half axes along and across the field, m; across : root mean square of the two.
    largest : number of particles in the largest cluster.
    """

    along: float
    across: float
    largest: int

    @classmethod
    def of(cls, result: Result) -> "CloudShape":
        axes = half_axes(result.state)
        return cls(float(axes[0]), float(np.sqrt((axes[1:] ** 2).mean())), largest(result.state))


@dataclass(frozen=True)
class Relaxation:
    """Balls and blasts from several starts.

    number : of particles. relaxed : final state of a ball that has relaxed, by name, of the first start.
    balls : measures of such balls, of each start. shapes : of clouds, by blast and ball, of each start.
    clouds : state of the cloud of the first start, by blast and ball. by_energy : shapes with the near field
    of neighbours, by ball and energy (J).
    """

    number: int
    relaxed: Mapping[str, Result]
    balls: Mapping[str, Sequence[RelaxedBall]]
    shapes: Mapping[tuple[str, str], Sequence[CloudShape]]
    clouds: Mapping[tuple[str, str], Arrays]
    by_energy: Mapping[tuple[str, float], Sequence[CloudShape]]


def relaxed_balls(number: int, seeds: Sequence[int], law: Mapping[str, Any]) -> list[Result]:
    """Return balls that have relaxed by a near field; RunError if one fails."""
    return sound(run([relaxing(number, seed, law) for seed in seeds]))


def blasts(
    number: int, seeds: Sequence[int], starts: Sequence[Result] | None, settings: Mapping[str, Any]
) -> list[Result]:
    """Return the clouds after the blast of random balls, or of balls that have relaxed (``starts``)."""
    balls: Sequence[Result | None] = [None] * len(seeds) if starts is None else starts
    scenes = [
        blast.scene(number=number, seed=seed, start=start, **settings)
        for seed, start in zip(seeds, balls, strict=True)
    ]
    return sound(run(scenes))


def study(
    number: int,
    seeds: Sequence[int],
    energies: Sequence[float] = ENERGIES,
    kinds: Mapping[str, tuple[Mapping[str, Any], tuple[str, ...]]] = BLASTS,
) -> Relaxation:
    """Relax balls, and blast them and the random balls from which they came.

    energies : of the blasts with the near field of neighbours, J. kinds : blasts and their balls, as BLASTS.
    """
    used = {start for _, starts in kinds.values() for start in starts}
    relaxed = {
        name: relaxed_balls(number, seeds, law)
        for name, law in BALLS.items()
        if law is not None and name in used
    }
    ends = {
        (kind, start): blasts(number, seeds, relaxed.get(start), settings)
        for kind, (settings, starts) in kinds.items()
        for start in starts
    }
    by_energy = {
        (start, energy): blasts(number, seeds, relaxed.get(start), {**NEAR_NEIGHBOURS, "energy": energy})
        for start in BLASTS["near field of neighbours"][1]
        for energy in energies
    }
    cutoffs = {name: float((law or {}).get("cutoff", np.inf)) for name, law in BALLS.items()}
    return Relaxation(
        number,
        {name: ones[0] for name, ones in relaxed.items()},
        {name: [RelaxedBall.of(one, cutoffs[name]) for one in ones] for name, ones in relaxed.items()},
        {key: [CloudShape.of(one) for one in ones] for key, ones in ends.items()},
        {key: ones[0].state for key, ones in ends.items()},
        {key: [CloudShape.of(one) for one in ones] for key, ones in by_energy.items()},
    )


def mean(ones: Sequence[Any], name: str) -> Mean:
    """Return the mean of a measure over starts."""
    return Mean.of([getattr(one, name) for one in ones])


def tables(found: Relaxation) -> str:
    """Return the tables of docs/blast.md."""
    lines = [
        "| ball | half axis, m | at rest after, s | contacts of a particle | kinetic energy over W"
        " | force on a particle over the attraction of two | work of the near field over W |",
        "|---|---|---|---|---|---|---|",
    ]
    for name, balls in found.balls.items():
        measures = (
            mean(balls, one)
            for one in ("half_axis", "time", "coordination", "kinetic", "unbalanced", "bound")
        )
        lines.append(f"| {name} | {' | '.join(map(str, measures))} |")
    lines += [
        "",
        f"| blast | ball | along the field, m | across, m | largest cluster, of {found.number} |",
        "|---|---|---|---|---|",
    ]
    for (name, start), shapes in found.shapes.items():
        measures = (mean(shapes, one) for one in ("along", "across", "largest"))
        lines.append(f"| {name} | {start} | {' | '.join(map(str, measures))} |")
    lines += ["", "| W, kJ | ball | along the field, m | largest cluster |", "|---|---|---|---|"]
    for (start, energy), shapes in found.by_energy.items():
        lines.append(f"| {energy / 1e3:g} | {start} | {mean(shapes, 'along')} | {mean(shapes, 'largest')} |")
    return "\n".join(lines)


def main() -> None:
    """Relax and blast balls, print the tables and draw the figure."""
    from tisim.cases.blast.relaxation_figure import relaxation_figure

    parser = argparse.ArgumentParser(description=(__doc__ or "").splitlines()[0])
    parser.add_argument("--number", type=int, default=500, help="number of particles")
    parser.add_argument("--starts", type=int, default=10, help="number of random starts")
    parser.add_argument("--out", type=Path, help="file of the figure")
    options = parser.parse_args()
    if options.starts < 2:
        parser.error(f"--starts must be at least 2 for an interval; received {options.starts}")
    found = study(options.number, range(options.starts))
    print(tables(found))
    if options.out is not None:
        relaxation_figure(found).savefig(options.out, dpi=150)


if __name__ == "__main__":
    main()
