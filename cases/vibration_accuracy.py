"""What accuracy is of in the array of Z13: where its particles are, and its centre of gravity.

The centre of gravity of any such array, and every particle that feels no other, follow
``charged_closed_forms.response``.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from cases.charged_closed_forms import response
from tisim import Result, Scene
from tisim.accuracy.quantity import Quantity, displacement
from tisim.effect import Effect, PairForce
from tisim.effects.lorentz import Lorentz
from tisim.effects.tether import Tether
from tisim.sources.uniform import ElectricField, MagneticField


def centre(result: Result) -> np.ndarray:
    """Displacement of the centre of gravity, m."""
    order = np.argsort(result.state["id"])
    return np.average(displacement(result), axis=0, weights=result.state["mass"][order])


def exact(result: Result) -> np.ndarray:
    """The same in closed form, for what the scene asks for."""
    field, flux, tether = (_one(result.scene, k) for k in (ElectricField, MagneticField, Tether))
    per_mass = float(result.start["charge"][0] / result.start["mass"][0])
    place = response(
        result.time, per_mass * flux.constant[2], tether.stiffness[0] / float(result.start["mass"][0]),
        per_mass * field.amplitude[0], field.omega[0],
    )  # fmt: skip
    return np.array([complex(place).real, complex(place).imag, 0.0])


def solvable(scene: Scene) -> bool:
    """Whether the scene is one that ``exact`` knows: nothing but the array of Z13 in fields along x and z."""
    single = {type(effect) for effect in scene.effects if not isinstance(effect, PairForce)}
    if single != {Lorentz, ElectricField, MagneticField, Tether}:
        return False
    field, flux, tether = (_one(scene, k) for k in (ElectricField, MagneticField, Tether))
    along_x = not any((*field.constant, *field.amplitude[1:], field.phase[0])) and field.amplitude[0] != 0
    along_z = not any((*flux.constant[:2], *flux.amplitude))
    return along_x and along_z and len(set(tether.stiffness)) == 1


def _one(scene: Scene, kind: type[Effect]) -> Any:
    return next(effect for effect in scene.effects if isinstance(effect, kind))


def quantities(scene: Scene) -> tuple[Quantity, ...]:
    """Where every particle is, and where their centre of gravity."""
    known = solvable(scene)
    alone = known and not any(isinstance(effect, PairForce) for effect in scene.effects)

    def alike(result: Result) -> np.ndarray:
        return np.tile(exact(result), (len(result.start["mass"]), 1))

    return (
        Quantity("positions", displacement, alike if alone else None),
        Quantity("centre of gravity", centre, exact if known else None),
    )
