"""Quantities whose accuracy ``tisim cost`` measures in the array of Z13: the positions of its particles, and
its centre of gravity.

The centre of gravity of any such array, and every particle without interaction, follow
``closed_forms.response``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from tisim import Open, Result, Scene
from tisim.accuracy import Quantity
from tisim.accuracy.quantity import displacement
from tisim.cases.vibration.closed_forms import response
from tisim.effects import Lorentz, PairForce, Tether
from tisim.operators import PeakDisplacement
from tisim.scene.initial_state import Arrays
from tisim.sources import ElectricField, MagneticField


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
    always = field.begin == flux.begin == 0
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
    """Return the positions of all particles and of their centre of gravity."""
    described = constants(scene) is not None
    independent = described and not any(isinstance(effect, PairForce) for effect in scene.effects)

    def alike(result: Result) -> np.ndarray:
        return np.tile(exact(result), (len(result.start["mass"]), 1))

    return (
        Quantity("positions", displacement, alike if independent else None, returns=True),
        Quantity("centre of gravity", centre, exact if described else None, returns=True),
    )
