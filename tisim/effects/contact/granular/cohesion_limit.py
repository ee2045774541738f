"""Checks, before a scene runs, that the normal force of a law can balance its cohesion."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from itertools import combinations_with_replacement
from typing import TYPE_CHECKING, Protocol

import numpy as np

from tisim.errors import must
from tisim.operators.base import largest_inserted

if TYPE_CHECKING:
    from tisim.effects.base import Effect
    from tisim.effects.contact.granular.parts import Cohesion, NormalForce
    from tisim.materials.materials import Materials, Touching


class CohesiveLaw(Protocol):
    """A contact law with a normal force and perhaps a cohesion."""

    @property
    def normal(self) -> NormalForce: ...

    @property
    def cohesion(self) -> Cohesion | None: ...

    @property
    def label(self) -> str: ...


def with_inserted(start: Mapping[str, np.ndarray], effects: Sequence[Effect]) -> dict[str, np.ndarray]:
    """Return radius (m) and material of the grains of a start and of the largest grains that effects
    insert."""
    later, material = largest_inserted(effects), start.get("material", np.zeros(len(start["radius"]), int))
    return {
        "radius": np.concatenate([start["radius"], later["radius"]]),
        "material": np.concatenate([material, later["material"]]),
    }


def largest_radii(grains: Mapping[str, np.ndarray]) -> dict[int, list[float]]:
    """Return the radii (m) of the two largest grains of each material, by the number of the material."""
    radius, material = grains["radius"], grains["material"]
    return {int(k): np.sort(radius[material == k])[:-3:-1].tolist() for k in np.unique(material)}


def check_grains(law: CohesiveLaw, materials: Materials, grains: Mapping[str, np.ndarray]) -> None:
    """Raise InputError unless a law repels more than it attracts when the largest grains of any two materials
    touch."""
    radii, number = largest_radii(grains), max(1, len(materials.named))
    for i, j in combinations_with_replacement(radii, 2):
        both = radii[i] if i == j else [radii[i][0], radii[j][0]]
        if len(both) == 2:
            pair, (a, b) = materials.touching()[i * number + j], both
            what = f"{pair.names[0]} of {a:g} m touches {pair.names[1]} of {b:g} m in radius"
            _check(law, pair, a * b / (a + b), what)


def check_wall(
    law: CohesiveLaw, materials: Materials, grains: Mapping[str, np.ndarray], wall: int, label: str
) -> None:
    """Raise InputError unless a law does so when the largest grains touch a wall of a material."""
    number = max(1, len(materials.named))
    for i, (radius, *_) in largest_radii(grains).items():
        pair = materials.touching()[i * number + wall]
        _check(law, pair, radius, f"{pair.names[0]} of {radius:g} m in radius touches {label}")


def _check(law: CohesiveLaw, pair: Touching, radius: float, what: str) -> None:
    """Compare elastic force and cohesion at an overlap of R* (m)."""
    if law.cohesion is not None:
        push, pull = law.normal.push(pair, radius, radius), law.cohesion.pulls(pair, radius, radius)
        rule = f"below the repulsion of {law.normal.kind()} at an overlap of R*, {push:.4g} N, when {what}"
        must(pull < push, f"{law.label}.cohesion", rule, float(f"{pull:.4g}"))
