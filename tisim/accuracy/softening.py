"""Scenes with softer materials and longer steps, a common approximation for grains."""

from __future__ import annotations

from collections.abc import Mapping

from tisim.accuracy.scene_parts import in_steps, parts
from tisim.components.accuracy_parameter import three_digits
from tisim.scene.scene import Scene

SOFTER = (1000.0, 100.0, 10.0)
"""Factors by which materials are softened."""


def softening(scene: Scene) -> dict[str, float]:
    """Return the material properties by which the contacts of a scene may be softened. Each value is the
    power of the property with which the duration of an impact decreases. Empty if such a property is set for
    a pair of materials, which would not be softened."""
    powers = {name: power for _, part in parts(scene) for name, power in part.softening.items()}
    pairs = scene.material_pairs.values()
    given = any(getattr(pair, name, None) is not None for pair in pairs for name in powers)
    return {} if given else powers


def softened(scene: Scene, properties: Mapping[str, float], factor: float) -> Scene:
    """Return a copy in which material properties are divided by a factor and steps are lengthened in
    proportion to the duration of impacts."""
    materials = {}
    for label, material in scene.materials.items():
        given = {name: getattr(material, name) for name in properties}
        lower = {name: three_digits(value / factor) for name, value in given.items() if value is not None}
        materials[label] = material.model_copy(update=lower)
    longer = factor ** min(properties.values())
    softer = scene.model_copy(update={"materials": materials})
    return in_steps(softer, lambda length: three_digits(longer * length))
