"""What a sheared cell measures: shear stress, how grains are ordered, and numbers that tell the regime."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.constants import mu_0

from cases.mrf_shear import published
from cases.mrf_shear.scene import DENSITY, LARGE_RADIUS, LOWER, UPPER
from tisim import Result
from tisim.analysis import cluster_shapes, contacts, fabric_tensor, mean_coordination, nearest_image
from tisim.components.domain import Domain
from tisim.effects import PrescribedMotion, Translation
from tisim.operators import JoinGroup
from tisim.scene.initial_state import Arrays

CHAINED = 0.05
"""Grains are of one chain where the gap between surfaces is below this part of the mean radius."""


def extent(domain: Domain) -> np.ndarray:
    """Return the sides of a cell, m, shape (3,)."""
    return np.diag(domain.edges(0.0))


def area(result: Result) -> float:
    """Return the area of a raft, m^2."""
    return float(np.prod(extent(result.scene.domain)[:2]))


def sides(domain: Domain) -> np.ndarray:
    """Return the sides of the cell along which it is periodic (m), and 0 along the field."""
    return np.where(domain.imaged(), extent(domain), 0.0)


def shear_stress(result: Result) -> float:
    """Return the shear stress, Pa: the mean over time of the force along x that holds the rafts back, over
    their area, of both rafts (L21 Eq. 2.8, which takes the upper one)."""
    lower, upper = (raft_force(result.state, group) for group in (LOWER, UPPER))
    return float(lower[0] - upper[0]) / (2 * area(result))


def raft_force(state: Arrays, group: int) -> np.ndarray:
    """Return the mean over time of the force on a raft, N."""
    return np.asarray(state["mean_force"][state["group"] == group].sum(axis=0))


def shear_rate(result: Result) -> float:
    """Return the shear rate between the rafts, 1/s: that of the oil, were it not at rest."""
    effects = result.scene.effects
    below, above = [one.planes[0].point[2] for one in effects if isinstance(one, JoinGroup)]
    groups = [one.motion for one in effects if isinstance(one, PrescribedMotion)]
    back, on = [one.velocity[0] for one in groups if isinstance(one, Translation)]
    return float((on - back) / (above - below))


@dataclass(frozen=True)
class Order:
    """An order has numbers of the chains in a cell, means over its grains.

    size : of the cluster that a grain is in, of all grains. length : extent of that cluster along its first
    axis, over the height of the cell. breadth : grains side by side in it. alignment : of pairs that touch,
    with the field: (3 cos^2 - 1)/2, 1 along it and 0 at random. contacts : of a grain.
    """

    size: float
    length: float
    breadth: float
    alignment: float
    contacts: float


def order(state: Arrays, domain: Domain) -> Order:
    """Return how the grains of a state in a cell are ordered."""
    position, radius = state["position"], state["radius"]
    around = sides(domain)
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


def largest_overlap(result: Result) -> float:
    """Return the largest overlap of two grains at the end, over the mean radius of all."""
    position, radius, around = result.state["position"], result.state["radius"], sides(result.scene.domain)
    pairs = contacts(position, radius, sides=around)
    apart = np.linalg.norm(nearest_image(position[pairs[:, 1]] - position[pairs[:, 0]], around), axis=1)
    return float((radius[pairs].sum(axis=1) - apart).max(initial=0.0) / radius.mean())


def volume_fraction(result: Result) -> float:
    """Return the part of the cell that grains fill."""
    return float((4 / 3 * np.pi * result.state["radius"] ** 3).sum() / extent(result.scene.domain).prod())


def mason_number(rate: float, flux: float) -> float:
    """Return the Mason number, Mn = 8 eta rate mu_0 / B^2, how much drag in a shear flow is beside magnetic
    forces; others have it with other factors."""
    return 8 * published.OIL_VISCOSITY * rate * mu_0 / flux**2


def stokes_time() -> float:
    """Return the time in which oil stops a grain, m / (6 pi eta R) = 2 rho R^2 / (9 eta), s."""
    return 2 * DENSITY * LARGE_RADIUS**2 / (9 * published.OIL_VISCOSITY)
