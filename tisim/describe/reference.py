"""The reference of all parts of a scene, read from the code for ``tisim effects`` and the documentation.

The descriptions are the docstrings of the parts (docstrings.py) and the texts of parameters and options.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any, Literal, get_args, get_origin

import numpy as np
from pydantic.fields import FieldInfo

from tisim import packing, shapes
from tisim.components import serialization
from tisim.components.component import Checked, Component
from tisim.components.invalid import text_of, unit_of
from tisim.describe import docstrings, template
from tisim.domains.domain import Domain
from tisim.effects.base import Effect
from tisim.effects.contact.granular.parts import ContactPart
from tisim.effects.walls.motion import Motion
from tisim.errors import InputError, abbreviated, did_you_mean, some_of
from tisim.geometry.container import Container
from tisim.geometry.shape import Shape
from tisim.materials.materials import ContactProperties
from tisim.operators.base import Operator
from tisim.operators.release import Release
from tisim.packing.grains import GrainClass
from tisim.packing.magnetic_core import MagneticCore
from tisim.packing.placement import Placement
from tisim.packing.sizes import SizeDistribution
from tisim.scene import plugins
from tisim.scene.initial_state import Start
from tisim.scene.initial_velocity import Pulse
from tisim.shapes.particle_shape import ParticleShape
from tisim.sources.base import Source
from tisim.sources.magnetic.magnets import Body
from tisim.state.fields import names_of, resolve_fields
from tisim.steppers.base import Stepper
from tisim.steppers.step_control import StepControl


@dataclass(frozen=True)
class Family:
    """A family of parts, such as effects or steppers.

    title : heading. base : common base class.
    place : table of a scene file that holds a part, with ``NAME`` in place of its name if the name is the
        key; otherwise the name is the table's ``kind``.
    """

    title: str
    base: type[Component]
    place: str

    def kinds(self) -> dict[str, type[Component]]:
        """Return the known parts of the family, by name."""
        plugins.load_parts()
        serialization.load(packing)
        serialization.load(shapes)
        narrower = tuple(one.base for one in FAMILIES.values() if one.base in self.base.__subclasses__())
        known = sorted(self.base.known().items())
        return {name: kind for name, kind in known if not issubclass(kind, narrower)}


FAMILIES = {
    "effects": Family("Effects", Effect, "effects.NAME"),
    "sources": Family("Sources", Source, "effects.NAME"),
    "bodies": Family("Bodies of magnetic sources", Body, ""),
    "shapes": Family("Shapes of walls", Shape, ""),
    "particle_shapes": Family("Shapes of particles", ParticleShape, ""),
    "containers": Family("Containers of hard bodies", Container, "effects.confinement.container"),
    "motions": Family("Motions of walls and groups", Motion, "effects.walls.motion"),
    "contact_parts": Family("Parts of granular contact laws", ContactPart, ""),
    "materials": Family("Materials", ContactProperties, ""),
    "operators": Family("Operators", Operator, "effects.NAME"),
    "releases": Family("Releases of captured particles", Release, "effects.capture.release"),
    "steppers": Family("Steppers", Stepper, "stepper"),
    "step_controls": Family("Step controls", StepControl, "stepper.control"),
    "starts": Family("Starts", Start, "particles"),
    "placements": Family("Placements", Placement, "particles.placement"),
    "grain_classes": Family("Classes of grains", GrainClass, ""),
    "size_distributions": Family("Size distributions", SizeDistribution, "particles.grains.sizes"),
    "cores": Family("Magnetic cores of grains", MagneticCore, "particles.grains.core"),
    "pulses": Family("Pulses", Pulse, "particles.pulse"),
    "domains": Family("Domains", Domain, "domain"),
}
"""The families, by name."""


@dataclass(frozen=True)
class Declaration:
    """The declaration of a parameter or option. rule : allowed values. default : as text; "" if there is
    none."""

    name: str
    unit: str
    text: str
    rule: str
    default: str


@dataclass(frozen=True)
class Entry:
    """The reference entry of a part.

    summary : first sentence of its docstring. body : the rest, without the source.
    fields : (name, unit) of the particle fields that it may need.
    needs : other requirements on the scene.
    gives : its counters and measures.
    toml : table of a scene file with all of its settings.
    """

    name: str
    kind: type[Component]
    family: str
    summary: str
    body: str
    source: str
    settings: tuple[Declaration, ...]
    fields: tuple[tuple[str, str], ...]
    needs: tuple[str, ...]
    gives: tuple[str, ...]
    toml: str

    def publications(self) -> list[str]:
        """Return the full references of the works that its source cites in short form."""
        return [f"{short}: {work}" for short, work in docstrings.PUBLICATIONS.items() if short in self.source]


def entries() -> list[Entry]:
    """Return the entries of all known parts, family by family."""
    return [describe(kind, name) for name, family in FAMILIES.items() for kind in family.kinds().values()]


def names() -> dict[str, tuple[type[Component], str]]:
    """Return class and family of all known parts, by name."""
    return {kind: (cls, family) for family, of in FAMILIES.items() for kind, cls in of.kinds().items()}


def groups() -> dict[str, list[Entry]]:
    """Return the entries of each family, and of each subpackage of one (``contact``), by name."""
    groups: dict[str, list[Entry]] = {name: [] for name in FAMILIES}
    for entry in entries():
        groups[entry.family].append(entry)
        top, *path = entry.kind.__module__.split(".")
        for subpackage in path[1:-1] if top == "tisim" else ():
            groups.setdefault(subpackage, []).append(entry)
    return groups


def find(name: str) -> Entry:
    """Return the entry of a part by name; raise InputError, with the known and the nearest names, if there is
    none."""
    known = names()
    if name not in known:
        rule, nearest = some_of(known, name, "'tisim effects'"), did_you_mean(name, (*known, *groups()))
        raise InputError(f"part must be one of {rule}; received {abbreviated(name)}{nearest}")
    return describe(*known[name])


def describe(kind: type[Component], family: str) -> Entry:
    """Return the entry of a part."""
    effect = kind if issubclass(kind, Effect) else Effect
    wanted = {need if isinstance(need, str) else need.name for need in effect.fields}
    declared = resolve_fields(effect.fields)
    place = FAMILIES[family].place.replace("NAME", kind.kind())
    return Entry(
        name=kind.kind(),
        kind=kind,
        family=family,
        summary=docstrings.summary(kind),
        body=docstrings.body(kind),
        source=docstrings.source(kind),
        settings=settings(kind),
        fields=tuple((field.name, field.unit) for field in declared if field.name in wanted),
        needs=tuple(_needs(kind)),
        gives=(*names_of(effect.world_fields, "counter"), *names_of(effect.world_fields, "measure")),
        toml=template.toml(kind, place, named="NAME" not in FAMILIES[family].place) if place else "",
    )


def _needs(kind: type[Component]) -> Iterator[str]:
    for other in kind.requires:
        names = sorted(other.known()) if other.__dict__.get("contract") else [other.kind()]
        yield " or ".join(names)
    if quantities := getattr(kind, "requires_source", ()):
        yield f"a source of {' or '.join(quantities)}"
    for other in kind.excludes:
        yield f"no {' or '.join(sorted(other.known()))}"
    for other in kind.precedes:
        yield f"a place before {' or '.join(sorted(other.known()))}"
    if getattr(kind, "depends_on_velocity", False):
        yield "a stepper with inertia, not brownian"
    if kind.incompatible_controls:
        yield f"another step control than {' or '.join(kind.incompatible_controls)}"
    rows = [
        f"{source.kind()}, a row of its {name}"
        for source in FAMILIES["sources"].kinds().values()
        for name, row in source.lists()
        if row is kind
    ]
    if rows:
        yield " or ".join(rows)
    if issubclass(kind, Stepper):
        control = kind.model_fields["control"].annotation
        yield f"a step control: {' or '.join(_suiting(control))}"


def _suiting(control: Any) -> list[str]:
    known = FAMILIES["step_controls"].kinds()
    return [name for name, kind in known.items() if issubclass(kind, control)]


def settings(kind: type[Checked]) -> tuple[Declaration, ...]:
    """Return the parameters and options in order. The name of an effect is omitted, because it is the name of
    its table."""
    shown = template.fields(kind) if issubclass(kind, Component) else kind.model_fields
    return tuple(_setting(name, info) for name, info in shown.items())


def _setting(name: str, info: FieldInfo) -> Declaration:
    value = info.get_default(call_default_factory=True)
    default = "" if info.is_required() else f'"{value}"' if isinstance(value, str) else shown(value)
    return Declaration(name, unit_of(info), text_of(info), _rule(info), default)


def _rule(info: FieldInfo) -> str:
    """Return the allowed values, without those implied by the unit."""
    choices = [one for t in (info.annotation, *get_args(info.annotation)) for one in _choices(t)]
    if choices:
        return " or ".join(choices)
    signs = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}
    bounds = [(sign, getattr(rule, name, None)) for rule in info.metadata for name, sign in signs.items()]
    return ", ".join(f"{sign} {bound:g}" for sign, bound in bounds if bound is not None)


def _choices(annotation: Any) -> list[str]:
    if annotation is bool:
        return ["true", "false"]
    return [f'"{one}"' for one in get_args(annotation)] if get_origin(annotation) is Literal else []


def shown(value: object) -> str:
    """Return a value as text."""
    if isinstance(value, Component):
        return value.kind()
    if isinstance(value, np.ndarray):
        return " x ".join(map(str, value.shape)) + " numbers"
    if isinstance(value, tuple):
        return "(" + ", ".join(shown(item) for item in value) + ")"
    if isinstance(value, bool | None):
        return {True: "true", False: "false", None: "none"}[value]
    return f"{value:.6g}" if isinstance(value, float) else str(value)
