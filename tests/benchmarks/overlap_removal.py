"""Remove the overlaps of 1000 triples of rods by the original method, by the revised method, and by the
revised method with rotations, or rotations and displacements, in random directions (B16 Fig. 3.4). Print the
table and draw the figure in docs/packing_study.md. About a minute on one core of an AMD EPYC (Zen 4).

    python -m tests.benchmarks.overlap_removal [packings_overlaps.png]
"""

import sys
from typing import ClassVar, Literal

import numpy as np
from scipy.spatial.transform import Rotation

import tisim
from tests.steppers.packing.test_mechanical_contraction import hard
from tisim import Box, Particles, Scene, Simulation
from tisim.analysis.packings.gaps import near_gaps
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.backend.taichi import ti
from tisim.components.component import option
from tisim.effects.base import HardBodies
from tisim.numerics import philox
from tisim.numerics.random_streams import TRIAL_MOVES
from tisim.numerics.statistics import half_width
from tisim.plotting.style import empty, letters, plain
from tisim.shapes import SpherocylinderShape
from tisim.steppers import MechanicalContraction
from tisim.steppers.context import Step
from tisim.steppers.packing.mechanical_contraction import RemoveOverlaps

ROD = SpherocylinderShape(length=4.0, diameter=1.0)
TRIPLES, ATTEMPTS = 1000, 300
DEEPEST = 0.1
"""Largest overlap (D) of two rods of a triple at the start; B16 only says that it is small."""
TOLERANCE = 1e-6
"""Overlap (D) that counts as removed."""
ROOM = 40.0
"""Side of the box of a triple (D), in which it does not meet its images."""


class RandomRemoval(MechanicalContraction):
    """The revised method with rotations, or rotations and displacements, in random directions."""

    random: ClassVar = True
    directions: Literal["turn", "both"] = option("motions in random directions", "both")

    def step(self, context):
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
    def direction(self, w, i, draw: ti.template()):
        """A random unit vector."""
        u = philox.uniform(philox.bits(self.s.seed[w], TRIAL_MOVES, self.s.id[w, i], self.s.steps[w], draw))
        z, angle = 2.0 * u[0] - 1.0, 2.0 * ti.math.pi * u[1]
        across = ti.sqrt(1.0 - z * z)
        return ti.cast(ti.Vector([across * ti.cos(angle), across * ti.sin(angle), z]), self.s.real)


METHODS = {
    "original": (MechanicalContraction, {"method": "original"}),
    "revised": (MechanicalContraction, {"method": "revised"}),
    "random rotations": (RandomRemoval, {"directions": "turn"}),
    "random motions": (RandomRemoval, {"directions": "both"}),
}


def triples(number, generator):
    """Places (D) and orientations of triples of rods, each two of which overlap by up to DEEPEST."""
    tried = 20_000
    places, turns = candidates(tried, generator)
    places[:, 2] = ROOM / 2
    good = slight(overlaps(places, turns)[:, 0])
    pairs, pair_turns = places[good, :2], turns[good, :2]
    found, found_turns = np.zeros((0, 3, 3)), np.zeros((0, 3, 4))
    while len(found) < number:
        places, turns = candidates(tried, generator)
        chosen = generator.integers(len(pairs), size=tried)
        places[:, :2], turns[:, :2] = pairs[chosen], pair_turns[chosen]
        good = slight(overlaps(places, turns)).all(axis=1)
        found, found_turns = np.concatenate([found, places[good]]), np.concatenate([found_turns, turns[good]])
    return found[:number], found_turns[:number]


def candidates(number, generator):
    """Three rods each: one at the origin, two at random places around it, in random directions."""
    places = generator.normal(size=(number, 3, 3))
    places /= np.linalg.norm(places, axis=2, keepdims=True)
    places *= ROD.length * np.cbrt(generator.uniform(size=(number, 3, 1)))
    places[:, 0] = 0.0
    turns = Rotation.random(3 * number, rng=generator).as_quat(scalar_first=True)
    return places, turns.reshape(number, 3, 4)


def slight(overlap):
    """Whether overlaps are small, but not too small to be followed."""
    return (overlap > 0.01 * DEEPEST) & (overlap < DEEPEST)


def overlaps(places, turns):
    """The overlaps (D) of the three pairs of each triple, shape (number, 3)."""
    number = len(places)
    # All triples in one box, far apart.
    side = int(np.ceil(number ** (1 / 3)))
    corner = ROOM * np.stack(np.unravel_index(np.arange(number), 3 * (side,)), axis=1)
    bodies = PackedBodies.of(
        ROD, (corner[:, None] + places).reshape(-1, 3), 3 * (-ROOM,), 3 * (ROOM * (side + 1),),
        turns.reshape(-1, 4), periodic=(False, False, False),
    )  # fmt: skip
    gaps = near_gaps(bodies, 0.0)
    found = np.zeros((number, 3))
    first, second = gaps.pairs.T
    # Pairs 01, 02 and 12.
    found[first // 3, first % 3 + second % 3 - 1] = -gaps.gap
    return found


def removal(kind, settings, places, turns):
    """The total overlap of each triple over that at the start, by attempt, shape (ATTEMPTS + 1, number)."""
    box = Box(low=(0, 0, 0), high=3 * (ROOM,))
    stepper = kind(volume_step=1e-9, tolerance=TOLERANCE, attempts=10**6, **settings)
    scenes = [
        Scene(
            particles=Particles(
                position=place + ROOM / 2, velocity=np.zeros((3, 3)), mass=np.ones(3),
                radius=np.full(3, ROD.bounding_radius()), quantities={"orientation": turn},
            ),
            effects=[hard(ROD)], domain=box, duration=1e9, stepper=stepper, seed=k,
        )
        for k, (place, turn) in enumerate(zip(places, turns, strict=True))
    ]  # fmt: skip
    simulation = Simulation(scenes[0], len(scenes), 3)
    simulation.load(scenes)
    total = [overlaps(places, turns).sum(axis=1)]
    for _ in range(ATTEMPTS):
        simulation.run(steps=1)
        at, turned = (simulation.s.read(name)[: len(scenes)] for name in ("position", "orientation"))
        total.append(overlaps(at - ROOM / 2, turned).sum(axis=1))
    simulation.close()
    return np.array(total) / total[0]


def main(*files):
    """Print attempts until the overlap has fallen to 1e-3, and the part of the attempts in which it rises."""
    tisim.init(threads=1)
    places, turns = triples(TRIPLES, np.random.default_rng(5))
    figure = empty(12.6, 3.2)
    axes = figure.subplots(1, len(METHODS), sharey=True)
    print(
        "| method | mean after 20 attempts | attempts to 1e-3, median | rising attempts |\n|---|---|---|---|"
    )
    for axis, (name, (kind, settings)) in zip(axes, METHODS.items(), strict=True):
        total = removal(kind, settings, places, turns)
        below = total < 1e-3
        first = np.where(below.any(axis=0), below.argmax(axis=0), ATTEMPTS)
        rising = (np.diff(total, axis=0) > 1e-9).sum() / (total[:-1] > 1e-3).sum()
        mean, half = total[20].mean(), half_width(total[20])
        print(
            f"| {name} | {mean:.3f} ± {half:.3f} | {np.median(first):.0f} | {100 * rising:.1f} % |",
            flush=True,
        )
        shown = np.maximum(total, TOLERANCE)
        axis.plot(shown[:, :200], color="0.6", lw=0.3, alpha=0.4)
        axis.plot(total.mean(axis=1), color="black", lw=1.6)
        axis.set(yscale="log", ylim=(TOLERANCE, 2), xlim=(0, ATTEMPTS), xlabel="attempts")
        axis.set_title(name, fontsize=9)
        plain(axis)
    axes[0].set_ylabel("total overlap, relative to the start")
    letters(axes)
    for file in files:
        figure.savefig(file, dpi=80)


if __name__ == "__main__":
    main(*sys.argv[1:])
