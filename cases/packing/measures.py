"""Measures of packings, and many packings as one batch."""

from collections.abc import Sequence
from dataclasses import dataclass

from tisim import Result, Scene, run
from tisim.analysis.packings.contact_numbers import contact_numbers
from tisim.analysis.packings.orientational_order import cubatic_order, nematic_order
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.cases.common.runs import sound
from tisim.effects import Confinement
from tisim.engine.batches import Progress


@dataclass(frozen=True)
class MeasuredPacking:
    """A packing and its measures.

    fraction : packing fraction. contacts : mean contact number. held : mean contact number of bodies that are
    not rattlers. nematic : S of the axes z. cubatic : S4. attempts : of the run.
    """

    bodies: PackedBodies
    fraction: float
    contacts: float
    held: float
    nematic: float
    cubatic: float
    attempts: int


def measured(result: Result) -> MeasuredPacking:
    """Return the packing at the end of a run."""
    bodies = PackedBodies.from_result(result)
    numbers = contact_numbers(bodies)
    axes = bodies.axes()
    return MeasuredPacking(
        bodies=bodies,
        fraction=packing_fraction(bodies, volume_of(result)),
        contacts=numbers.at_contact.value,
        held=numbers.held_at_contact.value,
        nematic=nematic_order(axes[:, 2]).order,
        cubatic=cubatic_order(bodies).order,
        attempts=int(result.work["steps"]),
    )


def volume_of(result: Result) -> float | None:
    """Return the volume of the container (m^3); None for a periodic box."""
    around = [one for one in result.scene.effects if isinstance(one, Confinement)]
    if not around:
        return None
    bodies = PackedBodies.from_result(result)
    side = bodies.high - bodies.low
    return around[0].container.volume_in(side, float(bodies.diameters()[0]))


def packings(scenes: Sequence[Scene], progress: Progress | None = None) -> list[MeasuredPacking]:
    """Return the packings of scenes, packed as one batch; RunError if a run fails."""
    return [measured(result) for result in sound(run(list(scenes), progress))]
