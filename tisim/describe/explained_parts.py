"""What a part of a scene is, for people: its law, its values, what it is made of; and what materials are."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

from tisim.components.component import Component
from tisim.components.invalid import text_of, unit_of
from tisim.describe import docstrings, reference
from tisim.materials.materials import HARMONIC, ContactProperties, Material, Materials, Touching

Row = tuple[str, str, str, str]
"""A row is the name, the value, the unit and the text of a number."""
ROWS_SHOWN = 3
"""This many rows of a list are shown."""


@dataclass(frozen=True)
class Part:
    """A part is an effect, the domain or the stepper of a scene, or what one of them is made of.

    name : in files. summary : one line. source : where the law is from. parameters : name, value, unit and
    text of each. parts : what it is made of, such as the parts of a granular law.
    """

    name: str
    summary: str
    source: str
    parameters: tuple[Row, ...]
    parts: tuple[Part, ...] = ()

    def all(self) -> Iterator[Part]:
        """Yield it, and what it is made of."""
        yield self
        for part in self.parts:
            yield from part.all()


def explained(spec: Component, name: str = "") -> Part:
    """Return what a part of a scene is, with its values and what it is made of.

    name : by which that leads to it that is made of it, such as ``granular.normal``.
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
    return replace(explained_kind(type(spec)), name=shown, parameters=rows, parts=made_of)


def explained_kind(kind: type[Component]) -> Part:
    """Return what a kind of part is."""
    return Part(kind.kind(), docstrings.summary(kind), docstrings.source(kind), ())


def _values(spec: Component, within: str = "") -> Iterator[Row]:
    """Yield (name, value, unit, text) of each parameter; of a long list, of its first rows."""
    lists = dict(spec.lists())
    for name, info in type(spec).model_fields.items():
        value = getattr(spec, name)
        if name == "name":
            continue  # It stands at the head.
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
    """Yield the materials of a scene, then what each two of them are to each other where they touch."""
    for name, material in materials.named.items():
        yield Part(name, "a material", "", _given(material))
    for pair in materials.touching():
        if list(materials.named).index(pair.names[0]) <= list(materials.named).index(pair.names[1]):
            yield Part("-".join(pair.names), "where they touch", "", (*_elastic(pair), *_mixed(pair)))


def _given(material: Material) -> tuple[Row, ...]:
    """Return what is given of a material."""
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
    """Return where a property of a pair is from."""
    if pair.given is not None and getattr(pair.given, name) is not None:
        return "given for the pair"
    if getattr(pair.first, name) == getattr(pair.second, name):
        return "that of each"
    return "harmonic mean" if name in HARMONIC else "geometric mean"
