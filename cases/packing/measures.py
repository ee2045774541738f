"""Measures of packings, and many packings as one batch."""

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.analysis.packings.bond_order import bond_order, contact_bonds
from tisim.analysis.packings.contact_numbers import contact_numbers
from tisim.analysis.packings.gaps import near_gaps, relative_gaps
from tisim.analysis.packings.orientational_order import cubatic_order, nematic_order
from tisim.analysis.packings.packed_bodies import PackedBodies
from tisim.analysis.packings.packing_fractions import packing_fraction
from tisim.cases.common.runs import sound
from tisim.effects import Confinement
from tisim.engine.batches import Batches, Progress

CUTOFF = 1e-4
"""Gap (D) up to which bodies are in contact in B16 chapters 3 and 4."""

CONTACT_GAP = 1e-3
"""Gap (D) up to which bodies count as touching in pictures, and where protocols are compared. Some leave
overlaps of up to 1e-4 D between touching bodies, others gaps as wide as their last trial moves."""
SHELL_GAP = 0.4
"""Gap (D) up to which bodies are neighbours in the bond order, the first minimum of the pair correlation."""


@dataclass(frozen=True)
class MeasuredPacking:
    """A packing and its measures.

    fraction : packing fraction. contacts : mean contact number, extrapolated to contact (B16 2.2.5).
    touching : mean number of bodies within CUTOFF (B16 3.3). held : ``contacts`` of bodies that are not
    rattlers. nematic : S of the axes z. cubatic : S4. attempts : of the run.
    """

    bodies: PackedBodies
    fraction: float
    contacts: float
    touching: float
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
        touching=2 * len(near_gaps(bodies, CUTOFF * float(bodies.diameters().max())).pairs) / len(bodies),
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


def contact_counts(packing: PackedBodies) -> np.ndarray:
    """Return the number of bodies that each body touches, with a gap of at most CONTACT_GAP, shape (n,)."""
    gaps = near_gaps(packing, float(CONTACT_GAP * packing.diameters().max()))
    pairs = gaps.pairs[relative_gaps(packing, gaps) <= CONTACT_GAP]
    return np.bincount(pairs.ravel(), minlength=len(packing))


def mean_contacts(result: Result) -> float:
    """Return the mean number of bodies that a body touches."""
    return float(contact_counts(PackedBodies.from_result(result)).mean())


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


def packings(
    scenes: Sequence[Scene], progress: Progress | None = None, together: int = 256
) -> Iterator[tuple[int, MeasuredPacking]]:
    """Yield (index into scenes, packing) as the packings end; RunError if a run fails.

    together : largest number of packings that are made side by side.
    """
    for index, result in Batches(together).run(scenes, progress):
        (result,) = sound([result])
        yield index, measured(result)
