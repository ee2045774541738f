"""Descriptions of the parts and materials of a scene: laws, values and nested parts."""

from __future__ import annotations

import re
from collections.abc import Iterator
from dataclasses import dataclass, replace

from tisim.components.component import Component
from tisim.components.invalid import text_of, unit_of
from tisim.describe import docstrings, reference
from tisim.materials.materials import HARMONIC, ContactProperties, Material, Materials, Touching

Row = tuple[str, str, str, str]
"""Name, value, unit and text of a number."""
ROWS_SHOWN = 3
"""Number of rows of a list that are shown."""
GIVEN = "given for the pair"
"""Text of a contact property that the scene gives for a pair of materials."""
SWITCHED_OFF = re.compile(r"none|false|0|\(0(, 0)*\)|0 in all")
"""Values that leave something out."""


@dataclass(frozen=True)
class Part:
    """The description of an effect, the domain or the stepper of a scene, or of a part nested in one.

    name : name in files. summary : one line. source : origin of the law.
    parameters : name, value, unit and text of each.
    parts : nested parts, such as the parts of a granular law.
    off : names of the parameters that are zero, false or none by default and in the scene.
    """

    name: str
    summary: str
    source: str
    parameters: tuple[Row, ...]
    parts: tuple[Part, ...] = ()
    off: frozenset[str] = frozenset()

    def all(self) -> Iterator[Part]:
        """Yield the part and all nested parts."""
        yield self
        for part in self.parts:
            yield from part.all()


def explained(spec: Component, name: str = "") -> Part:
    """Return the description of a part of a scene, with its values and nested parts.

    name : dotted path of a nested part, such as ``granular.normal``.
    """
    label = name or spec.label
    made_of = tuple(
        explained(value, f"{label}.{field}")
        for field in type(spec).model_fields
        if isinstance(value := getattr(spec, field), Component)
    )
    shown = f"{label}: {spec.kind()}" if name else label
    remarks = ((name, value, "", "") for name, value in spec.remarks().items())
    rows = (*_values(spec), *remarks)
    kind, off = explained_kind(type(spec)), frozenset(_off(spec))
    return replace(kind, name=shown, parameters=rows, parts=made_of, off=off)


def explained_kind(kind: type[Component]) -> Part:
    """Return the description of a kind of part, without values."""
    return Part(kind.kind(), docstrings.summary(kind), docstrings.source(kind), ())


def _off(spec: Component) -> Iterator[str]:
    """Yield the names of the parameters that are zero, false, none or empty by default and in the scene."""
    for name, info in type(spec).model_fields.items():
        value = reference.shown(getattr(spec, name))
        default = "" if info.is_required() else reference.shown(info.get_default(call_default_factory=True))
        if value == default and SWITCHED_OFF.fullmatch(value):
            yield name


def _values(spec: Component, within: str = "") -> Iterator[Row]:
    """Yield (name, value, unit, text) of each parameter; for a long list, of its first rows only."""
    lists = dict(spec.lists())
    for name, info in type(spec).model_fields.items():
        value = getattr(spec, name)
        if name == "name":
            continue  # The name is shown in the heading.
        if name in lists:
            for k, row in enumerate(value[:ROWS_SHOWN]):
                yield from _values(row, f"{within}{name}.{k}.")
            if not 0 < len(value) <= ROWS_SHOWN:
                yield f"{within}{name}", f"{len(value)} in all", "", text_of(info)
        elif within or not isinstance(value, Component):
            yield f"{within}{name}", reference.shown(value), spec.unit_as_set(name), text_of(info)
            if isinstance(value, Component):
                yield from _values(value, f"{within}{name}.")


def explained_materials(materials: Materials) -> Iterator[Part]:
    """Yield the materials of a scene, then the contact properties of each two of them."""
    for name, material in materials.named.items():
        yield Part(name, "a material", "", _given(material))
    for pair in materials.touching():
        if list(materials.named).index(pair.names[0]) <= list(materials.named).index(pair.names[1]):
            yield Part("-".join(pair.names), "contact properties", "", (*_elastic(pair), *_mixed(pair)))


def _given(material: Material) -> tuple[Row, ...]:
    """Return the properties that a material has."""
    return tuple(
        (name, f"{value:.6g}", unit_of(info), text_of(info).partition(";")[0])
        for name, info in type(material).model_fields.items()
        if (value := getattr(material, name)) is not None
    )


def _elastic(pair: Touching) -> Iterator[Row]:
    if len(pair.elastic()) == 2:
        yield "E*", f"{pair.effective_young:.6g}", "Pa", "1/E* = (1 - nu_i^2)/E_i + (1 - nu_j^2)/E_j"
        yield "G*", f"{pair.effective_shear:.6g}", "Pa", "1/G* is the sum of 2 (2 - nu) (1 + nu)/E"


def _mixed(pair: Touching) -> Iterator[Row]:
    for name, info in ContactProperties.model_fields.items():
        if not any(pair.lacking(name)):
            yield name, f"{pair.mixed(name):.6g}", unit_of(info), _origin(pair, name)


def _origin(pair: Touching, name: str) -> str:
    """Return the origin of a property of a pair."""
    if pair.given is not None and getattr(pair.given, name) is not None:
        return GIVEN
    if getattr(pair.first, name) == getattr(pair.second, name):
        return "the same for both"
    return "harmonic mean" if name in HARMONIC else "geometric mean"
