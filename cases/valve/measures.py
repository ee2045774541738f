"""What is measured of a valve: its mass flow rate, the pressure that it holds, and clusters of grains."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.constants import mu_0

from cases.dipoles import attraction_in_line
from cases.mrf_shear.measures import CHAINED
from cases.valve import published
from cases.valve.duct import Duct
from tisim import Result, Scene
from tisim.analysis import contacts, labels, periodic_sides
from tisim.effects import Walls
from tisim.scene.initial_state import Arrays
from tisim.sources import ConstrictionFlow


def duct_of(scene: Scene) -> Duct:
    """Return the duct of a scene."""
    walls = next(one for one in scene.effects if isinstance(one, Walls))
    _, throat, wide = walls.cylinders
    length = float(scene.domain.edges(0.0)[2, 2])
    straight = throat.end[2] - throat.start[2]
    return Duct(2 * throat.radius, 2 * wide.radius, straight, wide.start[2] - throat.end[2], length)


def oil_of(scene: Scene) -> ConstrictionFlow:
    """Return the oil of a scene."""
    return next(one for one in scene.effects if isinstance(one, ConstrictionFlow))


def rate(mass: np.ndarray, velocity: np.ndarray, length: float) -> float:
    """Return the mass flow rate (kg/s) along z, the mean over cross-sections of a duct of a length (m): the
    momentum of the grains over the length. In steady flow it is that through the constriction.

    mass : kg, shape (n,). velocity : m/s, shape (n, 3).
    """
    return float(mass @ velocity[:, 2] / length)


def flow_rate(result: Result) -> float:
    """Return the mass flow rate at the end, kg/s."""
    return rate(result.state["mass"], result.state["velocity"], duct_of(result.scene).length)


def unhindered_rate(scene: Scene, mass: float) -> float:
    """Return the mass flow rate (kg/s) of grains of a mass (kg) in all that go with the oil, evenly over the
    duct."""
    duct = duct_of(scene)
    return mass * oil_of(scene).speed * duct.oil_through() / duct.filling().volume() / duct.length


def drag(result: Result) -> float:
    """Return the force of the oil on all grains along the duct at the end, N."""
    state, duct = result.state, duct_of(result.scene)
    rho = np.hypot(state["position"][:, 0], state["position"][:, 1])
    oil = oil_of(result.scene).speed * duct.oil_speed(rho, state["position"][:, 2])
    slip = oil - state["velocity"][:, 2]
    return float(6 * np.pi * published.OIL_VISCOSITY * (state["radius"] * slip).sum())


def drag_pressure(result: Result) -> float:
    """Return the drag on all grains at the end over the cross-section of the duct, Pa: what L21 says is about
    100 kPa where the flow is arrested."""
    return drag(result) / duct_of(result.scene).area


def held_pressure(result: Result) -> float:
    """Return the force of the grains on the walls along the duct at the end, over its cross-section, Pa."""
    return result.measures["valve_force_z"] / duct_of(result.scene).area


@dataclass(frozen=True)
class Clusters:
    """The clusters of grains that touch.

    label : that of each grain's. largest : the part of all grains that are in the largest. bridged : whether
    grains within the cones and the constriction that are bound to each other there touch the wall on both
    sides of the axis, along the field: an arch or a chain across.
    """

    label: np.ndarray
    largest: float
    bridged: bool


def clusters(state: Arrays, scene: Scene) -> Clusters:
    """Return the clusters of a state."""
    position, radius, duct = state["position"], state["radius"], duct_of(scene)
    gap = CHAINED * float(radius.mean())
    pairs = contacts(position, radius, gap, periodic_sides(scene.domain))
    label = labels(len(radius), pairs)
    # Bound to each other within the constriction alone.
    inside = np.abs(position[:, 2]) <= duct.straight / 2 + duct.taper
    there = labels(len(radius), pairs[inside[pairs].all(axis=1)])
    heights, radii = duct.profile()
    wall = np.interp(position[:, 2] + duct.length / 2, heights, radii)
    rho = np.hypot(position[:, 0], position[:, 1])
    # To a cone it is nearer than to its radius at this height, by the cosine of its inclination.
    slant = np.where(np.abs(position[:, 2]) > duct.straight / 2, inclination(duct), 1.0)
    touches = inside & ((wall - rho) * slant <= radius + gap)
    sides = [set(there[touches & (sign * position[:, 0] > 0)].tolist()) for sign in (-1, 1)]
    return Clusters(label, float(np.bincount(label).max() / len(label)), bool(sides[0] & sides[1]))


def inclination(duct: Duct) -> float:
    """Return the cosine of the angle of the cones to the axis."""
    narrower = (duct.bore - duct.throat) / 2
    return float(duct.taper / np.hypot(duct.taper, narrower))


def attraction(radius: float, flux: float) -> float:
    """Return the force (N) with which two grains of a radius (m) that touch along a field (T) attract each
    other, with the moments of spheres without end of permeability that magnetise each other, 4/3 of 4 pi R^3
    B / mu_0."""
    return attraction_in_line(4 / 3 * 4 * np.pi * radius**3 * flux / mu_0, 2 * radius)


def mason_number(scene: Scene, radius: float, flux: float) -> float:
    """Return the drag on a grain at rest in the constriction over the attraction of two of them."""
    duct = duct_of(scene)
    speed = oil_of(scene).speed * (duct.bore / duct.throat) ** 2
    return float(6 * np.pi * published.OIL_VISCOSITY * radius * speed / attraction(radius, flux))
