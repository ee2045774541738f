"""The size from which self-gravity matters to agglomeration (Z04 remark 4.2).

Two equal grains in contact attract each other with G m^2/(2 b)^2. Z04 compares this force with the one that
bonds them, the pressure 2 H on their cross-section:

    G (4/3 pi rho b^3)^2/(2 b)^2 = 2 H pi b^2,    b = (3/rho) sqrt(H/(2 pi G))                          (4.16)

The same size follows, up to a factor, from the speeds of impacts. Two grains that fall from rest, their
centres k b apart, meet at the speed u of each,

    u^2 = G m (1/(2 b) - 1/(k b)),

which is the adhesion speed sqrt(3 a_f H beta/(2 rho)) (4.15) at

    b = (3/rho) sqrt(a_f beta H/(8 pi G (1/2 - 1/k))).

From far away this is (4.16) over sqrt(2), with a_f = beta = 1: gravity alone then bonds grains at rest.
"""

from collections.abc import Iterator

import numpy as np
from scipy.constants import G, epsilon_0

from tisim import Particles, Scene, run
from tisim.cases.agglomeration.field_checks import fall_time
from tisim.cases.case import Check
from tisim.cases.common.runs import sound
from tisim.effects import Agglomeration, Impact, SelfGravity
from tisim.steppers import FixedStep, Verlet

HARDNESS, DENSITY = 3e5, 2000.0
"""Hardness (Pa) and density (kg/m^3) of the grains in the checks."""
FALL_DISTANCE = 6.0
"""Distance of the centres of two grains at rest at the start, over their radius."""
FALL_STEPS = 16000
"""Number of steps of a fall."""
ATTRACTION_BOUND, FALL_BOUND = 1e-10, 1e-3
"""Largest relative differences between runs and closed forms; impacts are found at the end of a step."""


def gravity_radius(hardness: float, density: float) -> float:
    """Return the radius (m) at which the gravity of two touching grains equals the force that bonds them (Z04
    4.16).

    hardness : Pa. density : kg/m^3.
    """
    return float(3 / density * np.sqrt(hardness / (2 * np.pi * G)))


def bonding_radius(
    hardness: float, density: float, apart: float = np.inf, area: float = 1.0, length: float = 1.0
) -> float:
    """Return the radius (m) from which two grains that fall from rest bond.

    hardness : Pa. density : kg/m^3. apart : distance of their centres at the start over the radius. area,
    length : a_f and beta of the impact.
    """
    return float(3 / density * np.sqrt(area * length * hardness / (8 * np.pi * G * (0.5 - 1 / apart))))


def falling(radius: float, apart: float = FALL_DISTANCE, part: float = 1.02) -> Scene:
    """Return two grains at rest that fall together, until ``part`` of the time at which they meet.

    radius : m. apart : distance of their centres over the radius.
    """
    mass = DENSITY * 4 / 3 * np.pi * radius**3
    # Two opposite charges of this size attract each other as the two masses do.
    charge = mass * np.sqrt(4 * np.pi * epsilon_0 * G)
    time = fall_time(mass, charge, apart * radius, 2 * radius)
    return Scene(
        name="falling pair",
        particles=Particles(
            position=((-apart / 2 * radius, 0, 0), (apart / 2 * radius, 0, 0)),
            velocity=np.zeros((2, 3)),
            radius=radius,
            density=DENSITY,
        ),
        effects=(Impact(hardness=HARDNESS), SelfGravity(), Agglomeration()),
        stepper=Verlet(control=FixedStep(dt=time / FALL_STEPS)),
        duration=part * time,
    )


def bonded(radii: np.ndarray) -> np.ndarray:
    """Return whether grains of each radius (m) that fall from rest become one."""
    return np.array([result.work["merges"] > 0 for result in sound(run([falling(b) for b in radii]))])


def self_gravity_checks() -> Iterator[Check]:
    """Yield the attraction at the radius of (4.16), and the radius from which falling grains bond."""
    radius = gravity_radius(HARDNESS, DENSITY)
    (near,) = sound([run(falling(radius, apart=2.1, part=1e-3))])
    force = float(np.linalg.norm(near.state["force"][0]))
    distance = float(np.linalg.norm(near.state["position"][1] - near.state["position"][0]))
    ratio = force * (distance / (2 * radius)) ** 2 / (2 * HARDNESS * np.pi * radius**2)
    yield Check("gravity over 2 H pi b^2 at the radius of (4.16)", ratio, 1.0, ATTRACTION_BOUND)
    exact = bonding_radius(HARDNESS, DENSITY, FALL_DISTANCE)
    low, high = 0.9 * exact, 1.1 * exact
    while high - low > 1e-5 * exact:
        radii = np.linspace(low, high, 32)
        first = int(np.argmax(bonded(radii)))
        low, high = radii[max(first - 1, 0)], radii[first]
    yield Check(
        "radius from which grains that fall from rest bond (m)", 0.5 * (low + high), exact, FALL_BOUND * exact
    )
