"""Scenes of every kind of effect, operator, source and stepper, with numbers at the ends of the accepted
ranges.

Each scene has three particles: two overlap, and the third approaches. It also has everything that the kind
needs to act: particles that respond to a field, a field for a moment. Numbers are of ordinary size until one
or more of them are made extreme. Such a scene may be refused; if it is accepted, it must run, or fail with a
message.
"""

from __future__ import annotations

import copy
import math
from collections.abc import Iterator
from functools import cache
from random import Random
from typing import Any

import numpy as np

from tests.hostile import materials, with_needed
from tisim import Clump, Scene, steppers
from tisim.components import serialization
from tisim.describe.explain import known_effects
from tisim.effects import (
    Agglomeration,
    Confinement,
    DerivedQuantity,
    Effect,
    Granular,
    HardBodies,
    Impact,
    InducedMoment,
    LangevinMoment,
    Lorentz,
    Magnetophoresis,
    Mie,
    NearField,
    PermanentMoment,
    RigidShapes,
    StokesDrag,
    Tether,
    TruncatedDipoleDipole,
    Walls,
)
from tisim.effects.magnetic.moment import MOMENT
from tisim.engine.assembly import needed_fields
from tisim.packing.clump import clump_columns, sphere_columns
from tisim.sources import ElectricField, MagneticField, MagneticSpheres, Source
from tisim.steppers.packing.packing_stepper import Attempts

MAGNITUDES = (
    5e-324, 2.3e-308, 1e-300, 1e-155, 1e-100, 1e-60, 1e-30, 1e-15, 1e-9, 1e-3, 0.5, math.nextafter(1.0, 0.0),
    1.0, 1e3, 1e9, 1e15, 1e30, 1e60, 1e100, 1e155, 1e300, 1.7e308,
)  # fmt: skip
"""From the smallest to the largest number, including some whose squares and cubes do not overflow."""
VALUES = (0.0, *MAGNITUDES, *(-size for size in MAGNITUDES))
DT, STEPS = 1e-5, 30
"""s, an ordinary step; number of steps in a run."""

PERIODIC = {"kind": "box", "low": [-0.04] * 3, "high": [0.04] * 3}
"""A box for effects that need images."""
EWALD = {"cutoff": 0.035, "waves": [6, 6, 6], "accuracy": 1e-2}
COMMON: dict[str, dict[str, Any]] = {
    "impact": {"hardness": 1e5},
    "heating": {"heat_capacity": 500.0},
    "friction": {"coefficient": 0.3},
    "fragmentation": {"surface_energy": 0.05},
    "reaction": {"energy_density": 1e3},
    "softening": {"activation_energy": 300.0},
    "cooling": {"convection": 10.0},
    "contact": {"stiffness": 1e9},
    "granular": {
        "normal": "hertz_material",
        "damping": "restitution_damping",
        "tangential": "mindlin_force",
        "rolling": "rolling_epsd",
        "twisting": "twisting_marshall",
        "cohesion": "dmt",
    },
    "capillary_bridge": {"volume": 1e-12},
    "rigid_rods": {"rods": [{"length": 2e-3, "diameter": 1e-3}]},
    "rigid_superquadrics": {
        "superquadrics": [{"semi_axes": [1e-3, 7e-4, 2e-3], "exponents": [4.0, 2.0, 3.0]}]
    },
    "rigid_mixture": {
        "rods": [{"length": 2e-3, "diameter": 1e-3}],
        "superquadrics": [{"semi_axes": [1e-3, 7e-4, 2e-3], "exponents": [4.0, 2.0, 3.0]}],
    },
    "parallel_bond": {"gap": 1e-4, "young": 1e6, "tensile_strength": 1e6, "shear_strength": 1e6},
    "walls": {
        "planes": [{"point": [0.0, 0.0, -9e-4], "normal": [0.0, 0.0, 1.0]}],
        "discs": [{"centre": [0.0, -9.5e-4, 0.0], "normal": [0.0, 1.0, 0.0], "radius": 1e-3}],
        "boxes": [{"low": [-1.0, -1.0, -1.0], "high": [1.0, 1.0, 1.0]}],
    },
    "contact_bond": {"stiffness": 1e9, "grip_stiffness": 1e6, "threshold": 1e-3},
    "contact_dissipation": {"damping": 1e3},
    "contact_friction": {"stiffness": 1e6},
    "contact_softening": {"reference_temperature": 300.0, "floor": 1e3},
    "hertz": {"young": 1e7, "poisson": 0.3},
    "mie": {"epsilon": 4e-21, "cutoff": 2.0},
    "morse": {"depth": 4e-21, "alpha": 1e4, "cutoff": 2.0},
    "near_field": {"alpha1": 1e-6, "alpha2": 1e-9},
    "truncated_near_field": {"alpha1": 1e-6, "alpha2": 1e-9},
    "tether": {"stiffness": [1.0, 1.0, 2.0]},
    "stokes_drag": {"viscosity": 1e-3},
    "chow_drag": {"density": 1.2, "viscosity": 1.8e-5},
    "schiller_naumann_drag": {"density": 1.2, "viscosity": 1.8e-5},
    "couette_flow": {"first": -2e-3, "second": 4e-3, "first_velocity": [-1.0, 0.0, 0.0]},
    "constriction_flow": {"speed": 1.0, "throat_radius": 1e-3, "duct_radius": 4e-3, "length": 2e-3},
    "softened_self_gravity": {"softening_length": 1e-4},
    "darcy_flow": {"pressure_gradient": [0.0, 0.0, 1e3], "viscosity": 1e-3, "diameter": 1e-3},
    "pore_flow": {
        "low": [-4e-3] * 3,
        "high": [4e-3] * 3,
        "speed": 1.0,
        "viscosity": 1e-3,
        "cells": [8, 8, 8],
        "cylinders": [{"centre": [0, 0, -2e-3], "radius": 1e-3, "length": 3e-3}],
        "spheres": [{"centre": [0, 2e-3, 2e-3], "radius": 1.5e-3}],
    },
    "magnetic_field": {"constant": [0.0, 0.0, 0.1], "amplitude": [0.1, 0.0, 0.0], "omega": [1e3, 0.0, 0.0]},
    "electric_field": {"constant": [1e3, 0.0, 0.0], "amplitude": [0.0, 1e3, 0.0], "omega": [0.0, 1e3, 0.0]},
    "magnetic_spheres": {
        "spheres": [{"centre": [0, 0, -3e-3], "magnetisation": [0, 0, 1e6], "radius": 1e-3}]
    },
    "magnetic_cylinders": {
        "cylinders": [
            {"centre": [0, 0, -4e-3], "magnetisation": [0, 1e5, 1e6], "radius": 1e-3, "length": 5e-3}
        ]
    },
    "langevin_moment": {"temperature": 300.0},
    "permanent_moment": {"magnetisation": 1e5},
    "mutual_langevin_moment": {"temperature": 300.0, "cutoff": 3.0, "shifted": True},
    "mutual_induced_moment": {"susceptibility": 1.0, "cutoff": 2.0, "gap": 1e-3},
    "magnetic_body_force": {"gamma": 1e-4},
    "ewald_dipole_dipole": EWALD,
    "ewald_froehlich_moment": EWALD,
    "ewald_induced_moment": {"susceptibility": 1.0, **EWALD},
    "ewald_langevin_moment": {"temperature": 300.0, **EWALD},
    "insertion_by_flux": {"low": [0.0, 0.0, 5e-3], "high": [0.02, 0.02, 0.02], "number": 3},
    "insertion_by_fraction": {"low": [0.0, 0.0, 0.02], "high": [0.02, 0.02, 0.04], "number": 3},
    "inlet": {"low": [0.0, 0.0, 5e-3], "high": [0.02, 0.02, 6e-3], "end": 1e-4},
    "at_rest": {"time": 2e-4, "reference_acceleration": 9.81},
    "join_group": {"time": 1e-4},
    "mean_force": {"begin": 1e-4},
    "compacted": {"low": [0.0, 0.0, 0.0], "high": [0.02, 0.02, 0.02], "interval": 2e-5},
}
"""Ordinary parameters of effects that cannot take 1/2. With all of them, something happens in each scene."""
FIELDS = {"flow_velocity": (StokesDrag,), "electric_field": (Lorentz,)}
"""Effects that respond to a field; charges and moments respond to a magnetic one."""
CONTROLLED = {
    "verlet": (
        ({"kind": "fixed_step", "dt": DT}, {}, (NearField, Tether)),
        ({"kind": "approach_time"}, {}, (Impact,)),
    ),
    "boris": (({"kind": "fixed_step", "dt": DT}, {}, (Lorentz, MagneticField, Tether)),),
    "trapezoid": (
        ({"kind": "iteration_control"}, {}, (Lorentz, MagneticField, StokesDrag, Tether)),
        ({"kind": "iteration_control"}, {}, (NearField, StokesDrag)),
        ({"kind": "error_control", "per": "run"}, {"acceleration": "anderson"}, (NearField, Tether)),
        ({"kind": "error_control"}, {}, (Lorentz, MagneticField, Tether)),
    ),
    "collocation": (
        ({"kind": "stage_control"}, {}, (NearField, StokesDrag)),
        ({"kind": "stage_control", "per": "run"}, {}, (Lorentz, MagneticField, Tether)),
    ),
    "langevin": (
        ({"kind": "fixed_step", "dt": DT}, {}, (NearField, Tether)),
        ({"kind": "approach_time"}, {}, (Impact,)),
    ),
    "brownian": (
        ({"kind": "drift_limit", "longest": DT / 20}, {}, (Tether,)),
        ({"kind": "drift_limit", "longest": DT}, {}, (Mie,)),
        ({"kind": "drift_limit", "longest": DT}, {"hydrodynamics": "rotne-prager"}, (Mie,)),
        ({"kind": "drift_limit", "longest": DT}, {"hydrodynamics": "oseen", "noise": "fast"}, (NearField,)),
    ),
}  # fmt: skip
"""For each stepper, the controls with which it is tested: control, options, effects."""
QUANTITIES: dict[str, Any] = {
    "temperature": 300.0, "charge": 1e-9, "spin": [0.0, 0.0, 10.0], "saturation_moment": 1e-6,
    "domain_moment": 1e-18, "polarity": 1,
}  # fmt: skip
"""Values for all particles, used if an effect needs them."""
PAIR, _SIZES = clump_columns(
    Clump(centres=[(0, 0, 0), (1.99e-3, 0, 1e-4)], radii=[1e-3], density=2e3),
    [(0.995e-3, 0, 0.5e-4)],
    velocity=(0.1, -0.5, 0.2),
    angular_velocity=(0.0, 100.0, 30.0),
)
LONE = sphere_columns(np.array([2e-6]))
EACH = {"group": [1, 0, 0]} | {
    name: [*PAIR[name].tolist(), *LONE[name].tolist()] for name in LONE if name != "spin"
}
"""Values that differ between the three particles, used if an effect needs them: two form a clump."""
FLUID = {"temperature": 300.0, "viscosity": 1e-3}


def for_packings(kind: type) -> bool:
    """Whether a part belongs to packings, whose scenes have many bodies; tests/steppers/packing has them."""
    return issubclass(kind, HardBodies | Confinement | Attempts) or getattr(kind, "packs", False)


@cache
def scenes() -> dict[str, dict[str, Any]]:
    """Scenes as plain data, by name: one for each effect, source and operator, and those for each stepper."""
    serialization.load(steppers)
    kinds = [kind for kind in known_effects() if not for_packings(kind)]
    scenes_by_name = {f"effects.{kind.kind()}": _scene(_company(kind)) for kind in kinds}
    for name in sorted(CONTROLLED):
        fluid = FLUID if name in ("brownian", "langevin") else {}
        for k, (control, options, effects) in enumerate(CONTROLLED[name]):
            stepper = {"kind": name, **fluid, **options, "control": control}
            scenes_by_name[f"stepper.{name}.{k}"] = _scene(_effects(effects), stepper)
    return scenes_by_name


def _company(kind: type[Effect]) -> dict[str, Any]:
    """An effect with the effects that it needs, and with those that make it act."""
    felt: tuple[type[Effect], ...] = ()
    if issubclass(kind, Source):
        felt = FIELDS.get(kind.quantity, (Lorentz, LangevinMoment, Magnetophoresis))
    elif issubclass(kind, Walls | RigidShapes):
        felt = (Granular,)
    elif issubclass(kind, PermanentMoment):
        felt = (MagneticSpheres, Magnetophoresis, TruncatedDipoleDipole)
    elif issubclass(kind, DerivedQuantity):
        felt = (MagneticSpheres, Magnetophoresis)
    elif MOMENT in kind.fields or "magnetic_flux_density" in kind.requires_source:
        felt = (MagneticSpheres, *((InducedMoment,) if MOMENT in kind.fields else ()))
        felt += (ElectricField,) if kind is Lorentz else ()
    return _effects((*felt, kind))


def _effects(kinds: tuple[type[Effect], ...]) -> dict[str, Any]:
    table: dict[str, Any] = {}
    for kind in kinds:
        table |= {name: {**values, **COMMON.get(name, {})} for name, values in with_needed(kind).items()}
    if Agglomeration in kinds:
        table["impact"]["hardness"] = 1.0
    return table


def _scene(effects: dict[str, Any], stepper: dict[str, Any] | None = None) -> dict[str, Any]:
    data: dict[str, Any] = {
        "name": "extreme",
        "duration": STEPS * DT,
        "seed": 7,
        "particles": {
            "kind": "particles",
            "position": [[0.0, 0.0, 0.0], [1.99e-3, 0.0, 1e-4], [0.0, 2.5e-3, 0.0]],
            "velocity": [[1.0, 0.0, 0.5], [-1.0, 0.0, 0.0], [0.0, -3.0, 0.0]],
            "radius": [1e-3, 1e-3, 0.5e-3],
            "mass": [1e-5, 1e-5, 2e-6],
        },
        "domain": PERIODIC if any(name.startswith("ewald_") for name in effects) else {"kind": "open"},
        "stepper": stepper
        or {
            "kind": "boris" if "lorentz" in effects else "verlet",
            "control": {"kind": "fixed_step", "dt": DT},
        },
        "effects": effects,
    }
    if "granular" in effects:
        data["materials"] = materials()
    if "rigid_clumps" in effects:
        for name in ("position", "velocity"):
            data["particles"][name][:2] = PAIR[name].tolist()
        data["particles"]["quantities"] = EACH
    scene = Scene.from_dict(data)
    names = {
        need if isinstance(need, str) else need.name for need in needed_fields(scene.effects, scene.stepper)
    }
    quantities = {name: [value] * 3 for name, value in QUANTITIES.items() if name in names}
    data["particles"]["quantities"] = quantities | {n: v for n, v in EACH.items() if n in names}
    return Scene.from_dict(data).to_dict()


Place = tuple[str | int, ...]
"""The keys that lead to a number in plain data."""


def places(data: Any, path: Place = ()) -> Iterator[Place]:
    """All floating-point numbers in plain data."""
    for key, inner in data.items() if isinstance(data, dict) else enumerate(data):
        if isinstance(inner, dict | list):
            yield from places(inner, (*path, key))
        elif isinstance(inner, float):
            yield (*path, key)


def own(name: str) -> list[Place]:
    """The numbers in a scene that belong to its kind, to its first particle or to materials, and its
    duration."""
    family, kind, *_ = name.split(".")
    return [
        place
        for place in places(scenes()[name])
        if place[0] == "duration"
        or (place[0] == "particles" and place[3 if place[1] == "quantities" else 2] == 0)
        or place[0] == "materials"
        or (place[0] == family and (family == "stepper" or place[1] == kind))
    ]


def changed(data: dict[str, Any], values: dict[Place, Any]) -> dict[str, Any]:
    """A copy with other numbers at some places."""
    copied = copy.deepcopy(data)
    for (*path, last), value in values.items():
        inner: Any = copied
        for key in path:
            inner = inner[key]
        inner[last] = value
    return copied


def one_by_one(name: str) -> Iterator[dict[Place, float]]:
    """Set each number of a kind and of its particles to each extreme, and leave the others unchanged."""
    for place in own(name):
        for value in VALUES:
            yield {place: value}


def draw_values(name: str, random: Random) -> dict[Place, float]:
    """One to four random numbers of a scene, each at an extreme."""
    all_places = list(places(scenes()[name]))
    return {
        place: random.choice(VALUES) for place in random.sample(all_places, random.choice((1, 1, 2, 3, 4)))
    }
