"""Overlaps of triples of rods, removed by the original method, by the revised method, and by the revised
method with rotations, or rotations and displacements, in random directions (B16 Fig. 3.4)."""

from collections.abc import Mapping
from typing import Any, ClassVar, Literal, NamedTuple

import numpy as np
from matplotlib.figure import Figure
from scipy.spatial.transform import Rotation

from tisim import Box, Particles, Scene, Simulation
from tisim.analysis import Mean
from tisim.analysis.packings.gaps import near_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.backend.taichi import ti
from tisim.cases.common.csv_tables import csv_text
from tisim.cases.packing.scene import hard, rod
from tisim.components.component import option
from tisim.effects.base import HardBodies
from tisim.numerics import philox
from tisim.numerics.random_streams import RANDOM_REMOVAL
from tisim.plotting.style import empty, letters, plain
from tisim.steppers import MechanicalContraction
from tisim.steppers.context import Step, StepContext
from tisim.steppers.packing.mechanical_contraction import RemoveOverlaps

TRIPLE_ROD = rod(5.0)
TRIPLES = {"small": 100, "default": 1000, "paper": 1000}
"""Triples of rods, by size."""
FOLLOWED = 300
"""Attempts that are followed."""
SHOWN = 200
"""Triples that are drawn one by one."""
EARLY = 20
"""Attempts after which methods are compared."""
DEEPEST_START = 0.1
"""Largest overlap (D) of two rods of a triple at the start; B16 only says that it is small."""
REMOVED, NEARLY_REMOVED = 1e-6, 1e-3
"""Overlap (D) that counts as removed, and part of the overlap at the start that nearly does."""
ROOM = 40.0
"""Side of the box of a triple (D), in which it does not meet its images."""
CANDIDATES = 20_000
"""Random triples that are tried at once."""


class Removal(NamedTuple):
    """The removal of overlaps by a method.

    early : mean of the total overlap after EARLY attempts, relative to the start. attempts : median number
    until NEARLY_REMOVED of it is left; FOLLOWED if it takes longer. rising : part of the attempts in which it
    rises.
    """

    early: Mean
    attempts: float
    rising: float


class RandomRemoval(MechanicalContraction):
    """The revised method with rotations, or rotations and displacements, in random directions. It is for
    this comparison only, and therefore not among the steppers of files."""

    contract: ClassVar = True
    random: ClassVar = True
    directions: Literal["turn", "both"] = option("motions in random directions", "both")

    def step(self, context: StepContext) -> Step:
        (bodies,) = context.effects.of(HardBodies)
        made = super().step(context)
        items = [RandomMotions(context, bodies) if type(one) is RemoveOverlaps else one for one in made.items]
        return Step(tuple(items), made.buffers)


class RandomMotions(RemoveOverlaps):
    """This phase moves bodies as far as the revised method, in random directions."""

    @ti.func
    def motion(self, w, i):
        s = self.s
        push, twist = s.overlap_push[w, i], s.overlap_twist[w, i]
        shift, turn = 0.0 * push, 0.0 * push
        if s.inverse_overlap[w, i] > 0.0:
            size = self.bodies.size(s, w, i) * self.bodies.unit(w, 0)
            mass, spin = self.bodies.mass(s, w, i), self.bodies.spun(s, w, i, twist)
            energy = 0.5 * (push.norm_sqr() / mass + twist.dot(spin))
            if energy > 0.0:
                part = self.stepper.motion(w) / ti.sqrt(energy) / s.inverse_overlap[w, i]
                shift, turn = part / mass * push, part / size * spin
                turn = turn.norm() * self.direction(w, i, 0)
                if ti.static(self.stepper.directions == "both"):
                    shift = shift.norm() * self.direction(w, i, 1)
        return shift, turn

    @ti.func
    def direction(self, w, i, draw: ti.template()):  # type: ignore[valid-type]
        """Return a random unit vector."""
        s = self.s
        u = philox.uniform(philox.bits(s.seed[w], RANDOM_REMOVAL, s.id[w, i], s.steps[w], draw))
        z, angle = 2.0 * u[0] - 1.0, 2.0 * ti.math.pi * u[1]
        across = ti.sqrt(1.0 - z * z)
        return ti.cast(ti.Vector([across * ti.cos(angle), across * ti.sin(angle), z]), s.real)


METHODS: Mapping[str, tuple[type[MechanicalContraction], dict[str, Any]]] = {
    "original": (MechanicalContraction, {"method": "original"}),
    "revised": (MechanicalContraction, {"method": "revised"}),
    "random rotations": (RandomRemoval, {"directions": "turn"}),
    "random motions": (RandomRemoval, {"directions": "both"}),
}


def triples(number: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return places (D), shape (number, 3, 3), and orientations, shape (number, 3, 4), of triples of rods,
    each two of which overlap by up to DEEPEST_START."""
    tried = CANDIDATES
    places, turns = candidates(tried, generator)
    places[:, 2] = ROOM / 2
    good = slight(overlaps(places, turns)[:, 0])
    pairs, pair_turns = places[good, :2], turns[good, :2]
    found, found_turns = np.zeros((0, 3, 3)), np.zeros((0, 3, 4))
    while len(found) < number:
        places, turns = candidates(tried, generator)
        chosen = generator.integers(len(pairs), size=tried)
        places[:, :2], turns[:, :2] = pairs[chosen], pair_turns[chosen]
        all_good = slight(overlaps(places, turns)).all(axis=1)
        found = np.concatenate([found, places[all_good]])
        found_turns = np.concatenate([found_turns, turns[all_good]])
    return found[:number], found_turns[:number]


def candidates(number: int, generator: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Return places and orientations of three rods each: one at the origin, two at random places around it,
    in random directions."""
    places = generator.normal(size=(number, 3, 3))
    places /= np.linalg.norm(places, axis=2, keepdims=True)
    places *= TRIPLE_ROD.length * np.cbrt(generator.uniform(size=(number, 3, 1)))
    places[:, 0] = 0.0
    turns = Rotation.random(3 * number, rng=generator).as_quat(scalar_first=True)
    return places, turns.reshape(number, 3, 4)


def slight(overlap: np.ndarray) -> np.ndarray:
    """Return whether overlaps (D) are small, but not too small to be followed."""
    return np.asarray((overlap > 0.01 * DEEPEST_START) & (overlap < DEEPEST_START))


def overlaps(places: np.ndarray, turns: np.ndarray) -> np.ndarray:
    """Return the overlaps (D) of the three pairs of each triple, shape (number, 3)."""
    number = len(places)
    # All triples in one box, far apart.
    side = int(np.ceil(number ** (1 / 3)))
    corner = ROOM * np.stack(np.unravel_index(np.arange(number), 3 * (side,)), axis=1)
    bodies = PackedBodies.of(
        TRIPLE_ROD, (corner[:, None] + places).reshape(-1, 3), 3 * (-ROOM,), 3 * (ROOM * (side + 1),),
        turns.reshape(-1, 4), periodic=(False, False, False),
    )  # fmt: skip
    gaps = near_gaps(bodies, 0.0)
    found = np.zeros((number, 3))
    first, second = gaps.pairs.T
    # Pairs 01, 02 and 12.
    found[first // 3, first % 3 + second % 3 - 1] = -gaps.gap
    return found


def removal(
    kind: type[MechanicalContraction], settings: Mapping[str, Any], places: np.ndarray, turns: np.ndarray
) -> np.ndarray:
    """Return the total overlap of each triple over that at the start, by attempt, shape (FOLLOWED + 1,
    number)."""
    box = Box(low=(0, 0, 0), high=3 * (ROOM,))
    stepper = kind(volume_step=1e-9, tolerance=REMOVED, attempts=10**6, **settings)
    scenes = [
        Scene(
            particles=Particles(
                position=place + ROOM / 2, velocity=np.zeros((3, 3)), mass=np.ones(3),
                radius=np.full(3, TRIPLE_ROD.bounding_radius()), quantities={"orientation": turn},
            ),
            effects=[hard(TRIPLE_ROD)], domain=box, duration=1e9, stepper=stepper, seed=k,
        )
        for k, (place, turn) in enumerate(zip(places, turns, strict=True))
    ]  # fmt: skip
    simulation = Simulation(scenes[0], len(scenes), 3)
    simulation.load(scenes)
    total = [overlaps(places, turns).sum(axis=1)]
    for _ in range(FOLLOWED):
        simulation.run(steps=1)
        at, turned = (simulation.s.read(name)[: len(scenes)] for name in ("position", "orientation"))
        total.append(overlaps(at - ROOM / 2, turned).sum(axis=1))
    simulation.close()
    return np.array(total) / total[0]


def removals(size: str) -> dict[str, np.ndarray]:
    """Return the results of ``removal`` by each method, for the triples of a size."""
    places, turns = triples(TRIPLES[size], np.random.default_rng(5))
    return {name: removal(kind, settings, places, turns) for name, (kind, settings) in METHODS.items()}


def measured_removal(total: np.ndarray) -> Removal:
    """Return the measures of a result of ``removal``."""
    below = total < NEARLY_REMOVED
    first = np.where(below.any(axis=0), below.argmax(axis=0), FOLLOWED)
    rises = (np.diff(total, axis=0) > 1e-9).sum() / (total[:-1] > NEARLY_REMOVED).sum()
    return Removal(Mean.of(total[EARLY]), float(np.median(first)), float(rises))


def removal_table(found: Mapping[str, np.ndarray]) -> str:
    """Return the measures of each method as CSV."""
    lines: list[list[object]] = [
        ["method", f"overlap_after_{EARLY}", "half_width_95", f"attempts_to_{NEARLY_REMOVED:g}", "rising"]
    ]
    for name, total in found.items():
        one = measured_removal(total)
        lines.append([name, one.early.value, one.early.half, one.attempts, one.rising])
    return csv_text(lines)


def removal_figure(found: Mapping[str, np.ndarray]) -> Figure:
    """Draw the total overlap of triples by attempt, and its mean, for each method (B16 Fig. 3.4)."""
    figure = empty(12.6, 3.2)
    axes = figure.subplots(1, len(found), sharey=True)
    for axis, (name, total) in zip(axes, found.items(), strict=True):
        axis.plot(np.maximum(total, REMOVED)[:, :SHOWN], color="0.6", lw=0.3, alpha=0.4)
        axis.plot(total.mean(axis=1), color="black", lw=1.6)
        axis.set(yscale="log", ylim=(REMOVED, 2), xlim=(0, FOLLOWED), xlabel="attempts")
        axis.set_title(name, fontsize=9)
        plain(axis)
    axes[0].set_ylabel("total overlap, relative to the start")
    letters(axes)
    return figure
