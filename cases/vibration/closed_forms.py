"""Closed forms of a charged, tethered particle in uniform fields (Z13 section 3), compared with runs.

In the plane across B, along z, with w = q B/m and the field along x, z = x + i y obeys

    z'' + i w z' + (k/m) z = (q/m) E(t),

so free motion is a sum of exp(lambda t), lambda = i (-w/2 +- sqrt(w^2/4 + k/m)). All arguments may be arrays
that broadcast; SI units.
"""

from typing import Any

import numpy as np

from tisim import Open, Result, Scene
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import displacement
from tisim.effects import Lorentz, PairForce, Tether
from tisim.operators import PeakDisplacement
from tisim.scene.initial_state import Arrays
from tisim.sources import ElectricField, MagneticField

Numbers = np.ndarray | float


def response(t: Numbers, w: Numbers, k_m: Numbers, push: Numbers, omega: Numbers) -> np.ndarray:
    """Return z = x + i y (m) from rest at the anchor, with equal tethers along x and y, in E_0 sin(Omega t)
    along x.

    The centre of gravity of a cloud moves in the same way, because forces between its particles cancel. Not
    valid at resonance.
    """
    root = np.sqrt(np.asarray(w, float) ** 2 / 4 + k_m)
    a, b = 1j * (-w / 2 + root), 1j * (-w / 2 - root)
    # E_0 sin(Omega t) = Im: the particular solution of exp(+-i Omega t) divided by D(+-Omega).
    plus = push / 2j / (k_m - omega**2 - w * omega)
    minus = push / 2j / (k_m - omega**2 + w * omega)
    # z(0) = z'(0) = 0 gives the two amplitudes of free motion.
    place, speed = plus - minus, 1j * omega * (plus + minus)
    c = (b * place - speed) / (a - b)
    d = (speed - a * place) / (a - b)
    driven_part = plus * np.exp(1j * omega * t) - minus * np.exp(-1j * omega * t)
    return driven_part + c * np.exp(a * t) + d * np.exp(b * t)


def resonances(w: float, k_m: float) -> tuple[float, float]:
    """Return the two angular frequencies (1/s) at which ``response`` grows without bound."""
    root = np.sqrt(w**2 / 4 + k_m)
    return float(root - abs(w) / 2), float(root + abs(w) / 2)


def centre(result: Result) -> np.ndarray:
    """Return the displacement of the centre of gravity, m."""
    order = np.argsort(result.state["id"])
    return np.average(displacement(result), axis=0, weights=result.state["mass"][order])


def exact(result: Result) -> np.ndarray:
    """Return the displacement of the centre of gravity (m) in closed form, for a scene with ``constants``."""
    place = complex(response(result.time, **(constants(result.scene) or {})))
    return np.array([place.real, place.imag, 0.0])


def constants(scene: Scene) -> dict[str, float] | None:
    """Return w, k_m, push and omega of ``response``; None if that does not describe the centre of gravity.

    It does if the scene adds only pair forces and PeakDisplacement to the array of Z13, with a constant
    magnetic field along z and an oscillating electric field along x, and if all particles are equal and begin
    at rest at their anchors.
    """
    single_effects = (e for e in scene.effects if not isinstance(e, PairForce | PeakDisplacement))
    have: dict[type, Any] = {type(effect): effect for effect in single_effects}
    if have.keys() != {Lorentz, ElectricField, MagneticField, Tether} or not isinstance(scene.domain, Open):
        return None
    field, flux, k = have[ElectricField], have[MagneticField], have[Tether].stiffness
    along_x = not any((*field.constant, *field.amplitude[1:], field.phase[0])) and field.amplitude[0] != 0
    along_z = not any((*flux.constant[:2], *flux.amplitude))
    start = scene.particles.arrays(scene.domain, scene.seed)
    always = not (field.kinked or flux.kinked)
    if not (along_x and along_z and always and len(set(k)) == 1 and k[0] > 0 and _alike_at_rest(start)):
        return None
    mass, charge = float(start["mass"][0]), float(start["charge"][0])
    return {
        "w": charge * flux.constant[2] / mass, "k_m": k[0] / mass,
        "push": charge * field.amplitude[0] / mass, "omega": field.omega[0],
    }  # fmt: skip


def _alike_at_rest(start: Arrays) -> bool:
    alike = all(name in start and np.ptp(start[name]) == 0 for name in ("mass", "charge"))
    anchored = np.array_equal(start.get("anchor", start["position"]), start["position"])
    return alike and anchored and not start["velocity"].any()


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Return the quantities of ``tisim cost``: positions of all particles and of their centre of gravity."""
    described = constants(scene) is not None
    independent = described and not any(isinstance(effect, PairForce) for effect in scene.effects)

    def alike(result: Result) -> np.ndarray:
        return np.tile(exact(result), (len(result.start["mass"]), 1))

    return (
        Quantity("positions", displacement, alike if independent else None, returns=True),
        Quantity("centre of gravity", centre, exact if described else None, returns=True),
    )
