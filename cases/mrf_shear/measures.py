"""Measures of a sheared cell: shear stress, order of the grains, and their magnetisation."""

from dataclasses import dataclass

import numpy as np
from scipy.constants import mu_0

from tisim import Result, Scene
from tisim.accuracy import Quantity
from tisim.analysis import cluster_shapes, contacts, fabric_tensor, mean_coordination, periodic_sides
from tisim.cases.common.runs import overlap
from tisim.cases.mrf_shear.scene import LOWER, SUSCEPTIBILITY, UPPER
from tisim.domains.domain import Domain
from tisim.effects import PrescribedMotion, StokesDrag, Translation
from tisim.operators import JoinGroup
from tisim.scene.initial_state import Arrays
from tisim.sources import CouetteFlow, MagneticField

CHAINED = 0.05
"""Largest gap between the surfaces of grains in one chain, as a fraction of the mean radius."""


def extent(domain: Domain) -> np.ndarray:
    """Return the sides of a cell, m, shape (3,)."""
    return np.diag(domain.edges(0.0))


def area(result: Result) -> float:
    """Return the area of a raft, m^2."""
    return float(np.prod(extent(result.scene.domain)[:2]))


def shear_stress(result: Result) -> float:
    """Return the shear stress, Pa: the time-averaged force along x that resists the rafts, over their area.

    It is the mean over both rafts; L21 Eq. 2.8 uses the upper one.
    """
    lower, upper = (raft_force(result, group) for group in (LOWER, UPPER))
    return float(lower[0] - upper[0]) / (2 * area(result))


def raft_force(result: Result, group: int) -> np.ndarray:
    """Return the time-averaged force of the grains on a raft, N, without the drag of the oil.

    The drag is zero if the oil moves with the rafts, and constant if the oil is at rest.
    """
    state, effects = result.state, result.scene.effects
    own = state["group"] == group
    drag = next(one for one in effects if isinstance(one, StokesDrag))
    oil = next(one for one in effects if isinstance(one, CouetteFlow))
    (raft,) = [one.motion for one in effects if isinstance(one, PrescribedMotion) and one.group == group]
    assert isinstance(raft, Translation)
    flow = np.array(oil.first_velocity if group == LOWER else oil.second_velocity)
    resistance = 6 * np.pi * drag.viscosity * float(state["radius"][own].sum())
    return np.asarray(state["mean_force"][own].sum(axis=0) - resistance * (flow - raft.velocity))


def shear_rate(result: Result) -> float:
    """Return the shear rate between the rafts, 1/s; the oil has the same rate unless it is at rest."""
    effects = result.scene.effects
    below, above = [one.planes[0].point[2] for one in effects if isinstance(one, JoinGroup)]
    groups = [one.motion for one in effects if isinstance(one, PrescribedMotion)]
    back, on = [one.velocity[0] for one in groups if isinstance(one, Translation)]
    return float((on - back) / (above - below))


@dataclass(frozen=True)
class Order:
    """Measures of the chains in a cell, as means over its grains.

    size : of the cluster that contains a grain, relative to all grains.
    length : extent of that cluster along its first axis, divided by the height of the cell.
    breadth : grains side by side in it.
    alignment : of touching pairs with the field: (3 cos^2 - 1)/2, 1 along it and 0 at random.
    contacts : of a grain.
    """

    size: float
    length: float
    breadth: float
    alignment: float
    contacts: float


def order(state: Arrays, domain: Domain) -> Order:
    """Return the order of the grains of a state in a cell."""
    position, radius = state["position"], state["radius"]
    around = periodic_sides(domain)
    pairs = contacts(position, radius, CHAINED * float(radius.mean()), around)
    shapes = cluster_shapes(position, pairs, around)
    weight = shapes.size / shapes.size.sum()
    along = fabric_tensor(position, pairs, around)[2, 2]
    return Order(
        size=float((weight * shapes.size).sum() / len(radius)),
        length=float((weight * shapes.extent).sum() / extent(domain)[2]),
        breadth=float((weight * shapes.breadth).sum()),
        alignment=float(3 * along - 1) / 2,
        contacts=mean_coordination(len(radius), pairs),
    )


def magnetised_part(result: Result) -> float:
    """Return the mean moment of a grain at the end, divided by the moment of a single grain in the field."""
    volume = 4 / 3 * np.pi * result.state["radius"] ** 3
    moment = np.linalg.norm(result.state["moment"], axis=1)
    return float((moment / volume).mean()) / magnetisation(flux(result))


def flux(result: Result) -> float:
    """Return the flux density of the field, T."""
    return float(next(e for e in result.scene.effects if isinstance(e, MagneticField)).constant[2])


def volume_fraction(result: Result) -> float:
    """Return the volume fraction of the grains in the cell."""
    return float((4 / 3 * np.pi * result.state["radius"] ** 3).sum() / extent(result.scene.domain).prod())


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``: stress and largest overlap, as paths of grains are chaotic."""
    return (
        Quantity("shear stress", shear_stress, random=True),
        Quantity("largest overlap", overlap, random=True),
    )


def magnetisation(flux: float) -> float:
    """Return the magnetisation (A/m) of a single grain in a field (T): 3 chi / (3 + chi) B / mu_0."""
    return 3 * SUSCEPTIBILITY / (3 + SUSCEPTIBILITY) * flux / mu_0
