"""Measures of a valve: its mass flow rate, the pressure on its walls, and clusters of grains."""

from dataclasses import dataclass

import numpy as np
from scipy.constants import mu_0

from tisim import Cloud, Result, Scene
from tisim.accuracy import Quantity
from tisim.analysis import contacts, labels, periodic_sides
from tisim.cases.common.runs import overlap
from tisim.cases.common.two_spheres import attraction_in_line
from tisim.cases.valve import published
from tisim.cases.valve.duct import Duct
from tisim.cases.valve.scene import mean_radius
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
    """Return the mass flow rate (kg/s) along z: the momentum of the grains divided by the length (m) of the
    duct.

    It is the mean over cross-sections; in steady flow it equals the rate through the constriction.
    mass : kg, shape (n,). velocity : m/s, shape (n, 3).
    """
    return float(mass @ velocity[:, 2] / length)


def flow_rate(result: Result) -> float:
    """Return the mass flow rate at the end, kg/s."""
    return rate(result.state["mass"], result.state["velocity"], duct_of(result.scene).length)


def unhindered_rate(scene: Scene, mass: float) -> float:
    """Return the mass flow rate (kg/s) of grains of a total mass (kg) that move with the oil.

    The grains are distributed evenly over the duct.
    """
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
    """Return the drag on all grains at the end divided by the cross-section of the duct, Pa.

    L21 gives about 100 kPa for an arrested flow.
    """
    return drag(result) / duct_of(result.scene).area


def pressure_at_rest(scene: Scene) -> float:
    """Return the drag on grains at rest, evenly distributed over the duct, divided by its cross-section,
    Pa."""
    cloud, duct = scene.particles, duct_of(scene)
    assert isinstance(cloud, Cloud)
    each = 6 * np.pi * published.OIL_VISCOSITY * mean_radius(cloud.grains) * oil_of(scene).speed
    return float(each * cloud.count() * duct.oil_through() / duct.filling().volume() / duct.area)


def held_pressure(result: Result) -> float:
    """Return the force of the grains on the walls along the duct at the end, divided by its cross-section,
    Pa."""
    return result.measures["valve_force_z"] / duct_of(result.scene).area


ARCH_ANGLE = 27.0
"""Largest angle between the field and the direction of an arch's wall contacts, degrees. A row of four grains
along the wall does not count as an arch in a constriction four grains wide, nor does a row of seven in one
6.5 grains wide; rows of five and eight do."""


@dataclass(frozen=True)
class Clusters:
    """The clusters of grains that touch.

    largest : fraction of all grains in the largest cluster.
    bridged : whether one cluster within the cones and the constriction touches the wall on opposite sides,
    within ARCH_ANGLE of the direction of the field. It can be an arch, a chain across, or a long row along
    the wall. Valves that flow have such clusters, too.
    """

    largest: float
    bridged: bool


def clusters(state: Arrays, scene: Scene) -> Clusters:
    """Return the clusters of a state."""
    position, radius, duct = state["position"], state["radius"], duct_of(scene)
    pairs = contacts(position, radius, sides=periodic_sides(scene.domain))
    size = np.bincount(labels(len(radius), pairs)).max()
    x, y, z = position.T
    inside = np.abs(z) <= duct.straight / 2 + duct.taper
    # Connected within the constriction only.
    there = labels(len(radius), pairs[inside[pairs].all(axis=1)])
    aside = np.abs(y) < np.tan(np.radians(ARCH_ANGLE)) * np.abs(x)
    touches = inside & aside & (duct.depth(np.hypot(x, y), z) <= radius)
    sides = [set(there[touches & (sign * x > 0)].tolist()) for sign in (-1, 1)]
    return Clusters(float(size / len(radius)), bool(sides[0] & sides[1]))


def attraction(radius: float, flux: float) -> float:
    """Return the attraction (N) of two grains of a radius (m) that touch along a field (T).

    The moments are 4/3 of 4 pi R^3 B / mu_0, for spheres of infinite permeability that magnetise each other.
    """
    return attraction_in_line(4 / 3 * 4 * np.pi * radius**3 * flux / mu_0, 2 * radius)


def mason_number(scene: Scene, radius: float, flux: float) -> float:
    """Return the drag on a grain at rest in the constriction divided by the attraction of two grains."""
    duct = duct_of(scene)
    speed = oil_of(scene).speed * (duct.bore / duct.throat) ** 2
    return float(6 * np.pi * published.OIL_VISCOSITY * radius * speed / attraction(radius, flux))


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``: flow rate and largest overlap, as paths of grains are
    chaotic."""
    return (
        Quantity("mass flow rate at the end", flow_rate, random=True),
        Quantity("largest overlap", overlap, random=True),
    )
