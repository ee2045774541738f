"""Scenes of softer materials in longer steps, as is usual for grains: what a study tries of them."""

from __future__ import annotations

from collections.abc import Mapping

from tisim.accuracy.scene_parts import in_steps, parts
from tisim.components.accuracy_parameter import three_digits
from tisim.scene.scene import Scene

SOFTER = (1000.0, 100.0, 10.0)
"""By these factors materials are softened."""


def softening(scene: Scene) -> dict[str, float]:
    """Return the properties of materials by which the contacts of a scene may be softened, each with the
    power of it that the time of an impact goes by; none where one of them is given for a pair of materials,
    which would stay as stiff as it is."""
    powers = {name: power for _, part in parts(scene) for name, power in part.softening.items()}
    pairs = scene.material_pairs.values()
    given = any(getattr(pair, name, None) is not None for pair in pairs for name in powers)
    return {} if given else powers


def softened(scene: Scene, properties: Mapping[str, float], factor: float) -> Scene:
    """Return a copy whose materials have properties that are lower by a factor, and whose steps are longer by
    as much as the impacts are."""
    materials = {}
    for label, material in scene.materials.items():
        given = {name: getattr(material, name) for name in properties}
        lower = {name: three_digits(value / factor) for name, value in given.items() if value is not None}
        materials[label] = material.model_copy(update=lower)
    longer = factor ** min(properties.values())
    softer = scene.model_copy(update={"materials": materials})
    return in_steps(softer, lambda length: three_digits(longer * length))
