"""Measures of packings, and many packings as one batch."""

from collections.abc import Sequence
from dataclasses import dataclass

from tisim import Result, Scene, run
from tisim.accuracy import Quantity
from tisim.analysis.packings.bond_order import bond_order, contact_bonds
from tisim.analysis.packings.contact_numbers import contact_numbers
from tisim.analysis.packings.gaps import near_gaps, relative_gaps
from tisim.analysis.packings.orientational_order import cubatic_order, nematic_order
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.cases.common.runs import sound
from tisim.effects import Confinement
from tisim.engine.batches import Progress

CONTACT_GAP = 1e-3
"""Gap (D) up to which bodies count as touching where protocols are compared. Some leave overlaps of up to
1e-4 D between touching bodies, others gaps as wide as their last trial moves."""
SHELL_GAP = 0.4
"""Gap (D) up to which bodies are neighbours in the bond order, the first minimum of the pair correlation."""


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


def mean_contacts(result: Result) -> float:
    """Return the mean contact number: contacts have gaps of at most CONTACT_GAP, whatever the protocol."""
    bodies = PackedBodies.from_result(result)
    gaps = near_gaps(bodies, float(CONTACT_GAP * bodies.diameters().max()))
    return 2 * int((relative_gaps(bodies, gaps) <= CONTACT_GAP).sum()) / len(bodies)


def fraction_of(result: Result) -> float:
    """Return the packing fraction."""
    return packing_fraction(PackedBodies.from_result(result), volume_of(result))


def bond_order_of(result: Result) -> float:
    """Return the bond order Q6 of all bonds together, of bodies with a gap of at most SHELL_GAP."""
    bodies = PackedBodies.from_result(result)
    bonds = contact_bonds(bodies, float(SHELL_GAP * bodies.diameters().max()))
    return bond_order(len(bodies), bonds, 6).whole


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``, over random starts."""
    return (
        Quantity("packing fraction", fraction_of, random=True),
        Quantity("contact number", mean_contacts, random=True),
        Quantity("bond order Q6", bond_order_of, random=True),
    )


def packings(scenes: Sequence[Scene], progress: Progress | None = None) -> list[MeasuredPacking]:
    """Return the packings of scenes, packed as one batch; RunError if a run fails."""
    return [measured(result) for result in sound(run(list(scenes), progress))]
