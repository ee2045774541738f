"""Capture by one fibre after the other: the cascade of B16 section 6.4.5.

N particles spend ``stage`` seconds about one cylinder; those it has not captured are placed anew around a
cylinder of another orientation, and so on. "optimal": every cylinder lies across the field. "directions":
each has a random direction, all equally likely. "angles": its angle to the field is random, all angles from
0 to 90 degrees equally likely, as B16 averages elsewhere (section 6.4.3).

B16 says neither which of the two its random orientation is, nor L/D, nor where particles are placed: here in
a layer ``thickness`` wide and ``gap`` away from the cylinder, both in radii of it.
"""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Literal

import numpy as np

from cases import capture
from cases.case import Case, Check, Size
from cases.statistics import Claim
from tisim import RandomAroundCylinder, RunError, Scene, run
from tisim.engine.batches import Progress
from tisim.sources import MagneticCylinders

if TYPE_CHECKING:
    from matplotlib.figure import Figure

    from tisim.io.reader import Frames

Orientation = Literal["optimal", "directions", "angles"]
STAGE = {25: 10.0, 125: 0.5}
"""Delta t_run, s, by radius in nm (B16 section 6.4.5)."""
SHARE = 0.9
"""Of the particles, up to which capture is timed."""
MOST = 1000
"""Stages after which a cascade is given up."""

SIZES = {
    "default": Size("100 particles of 125 nm about a random cylinder of L/D 20, 0.5 s", {}),
    "optimal": Size("the same about a transverse one", {"orientation": "optimal"}),
    "25nm": Size("100 particles of 25 nm, 10 s", {"nanometres": 25, "stage": 10.0}),
}


@dataclass(frozen=True)
class Cascade:
    """One kind of cascade. nanometres : of the particles; stage : s about each cylinder; see above."""

    nanometres: int = 125
    stage: float = 0.5
    orientation: Orientation = "directions"
    aspect: float = 20.0
    thickness: float = 1.0
    gap: float = 0.0
    number: int = capture.NUMBER

    def angle(self, generator: np.random.Generator) -> float:
        """Of the next cylinder to the field, degrees."""
        drawn = generator.uniform()
        return {
            "optimal": 90.0,
            "directions": float(np.degrees(np.arccos(drawn))),
            "angles": 90.0 * drawn,
        }[self.orientation]

    def scene(self, number: int, generator: np.random.Generator) -> Scene:
        """The stage of ``number`` particles about the next cylinder."""
        made = capture.scene(
            nanometres=self.nanometres,
            angle=self.angle(generator),
            aspect=self.aspect,
            number=number,
            duration=self.stage,
            seed=int(generator.integers(2**62)),
        )
        (body,) = next(e for e in made.effects if isinstance(e, MagneticCylinders)).cylinders
        away = self.gap * body.radius
        layer = RandomAroundCylinder(
            axis=body.axis,
            radius=body.radius + away,
            length=body.length + 2 * away,
            thickness=self.thickness * body.radius,
        )
        cloud = made.particles.model_copy(update={"placement": layer})
        return made.model_copy(update={"name": "cascade", "particles": cloud})


def captured_at(
    cascades: Sequence[Cascade],
    repeats: int,
    share: float = SHARE,
    seed: int = 0,
    progress: Progress | None = None,
) -> list[np.ndarray]:
    """When each particle was captured, s from the start of the cascade; inf for those still free when
    ``share`` had been, or after MOST stages. One array (repeats, number) for each cascade, rows sorted.

    A stage of all cascades and repeats that are not done is one batch of worlds. RunError when one fails.
    """
    times = [np.full((repeats, one.number), np.inf) for one in cascades]
    rows = [
        (one, times[k][repeat], np.random.default_rng([seed, k, repeat]))
        for k, one in enumerate(cascades)
        for repeat in range(repeats)
    ]
    for passed in range(MOST):
        going = [row for row in rows if np.isfinite(row[1]).mean() < share]
        if not going:
            break
        found = run([one.scene(int(np.isinf(at).sum()), generator) for one, at, generator in going])
        for (one, at, _), result in zip(going, found, strict=True):
            if not result.status.ok:
                raise RunError(f"cascade: {result.status.reason}")
            when = result.state["captured_at"]
            # A particle has no name in the next stage: those that are captured fill the row from its start.
            first = int(np.isfinite(at).sum())
            caught = np.sort(when[when >= 0])
            at[first : first + len(caught)] = passed * one.stage + caught
        if progress:
            progress(min(1.0, float(np.mean([np.isfinite(at).mean() for _, at, _ in rows])) / share))
    return times


def time_to(share: float, times: np.ndarray) -> np.ndarray:
    """When a share of the particles was captured, of each repeat: shape (repeats,), s; inf for never."""
    return np.asarray(times[:, int(np.ceil(share * times.shape[1])) - 1])


def scene_for(size: str, seed: int) -> Scene:
    """The first stage of the cascade of a size."""
    one = Cascade(**CASE.size(size).scene)
    return one.scene(one.number, np.random.default_rng(seed))


def check() -> Iterator[Check | Claim]:
    """What B16 says of cascades."""
    from cases import cascade_statistics

    yield from cascade_statistics.check()


def pictures(found: Frames) -> Mapping[str, Figure]:
    """Trajectories and captured fraction of a stage."""
    from cases import capture_pictures

    return capture_pictures.pictures(found)


def figures(size: str, progress: Progress) -> Mapping[str, Figure | str]:
    """Captured fraction in time, and how much longer random cascades take."""
    from cases import cascade_pictures

    return cascade_pictures.figures(size, progress)


CASE = Case(
    name="cascade",
    title="Magnetic colloids captured by one fibre after the other (B16)",
    source="R. J. Baars, thesis, Utrecht University (2016), section 6.4.5",
    sizes=SIZES,
    scene=scene_for,
    check=check,
    quantities=capture.quantities,
    pictures=pictures,
    figures=figures,
)
