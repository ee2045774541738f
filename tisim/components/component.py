"""Validated plain data: the parts of a scene, their units, and their names in files.

A ``Component`` is a frozen pydantic model. Its name in a file is its class name in snake_case
(``StokesDrag`` is ``stokes_drag``), found by walking subclasses: nothing is registered anywhere.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Mapping
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, get_args, get_origin

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from tisim.backend.taichi import DEVICE_FUNCTION, is_device_function
from tisim.components.cost_hints import AccuracyHints
from tisim.components.invalid import explain_invalid, unit_of
from tisim.components.plain_numbers import is_numeric, plain
from tisim.components.ranges import WHOLE, check_magnitude
from tisim.errors import InputError, must, some_of
from tisim.files import python_file

Vector = tuple[float, float, float]
"""A vector has three Cartesian components."""
LISTED = "'tisim effects'"
"""The command that lists all parts of a scene by name."""


def _encodable(text: str) -> str:
    if any("\ud800" <= character <= "\udfff" for character in text):
        raise PydanticCustomError("surrogate", "text that UTF-8 can hold")
    return text


Text = Annotated[str, AfterValidator(_encodable)]
"""A text can be held by a file: it is without halves of surrogate pairs."""


class Checked(BaseModel):
    """Checked data is plain and either right or refused (InputError): frozen, no unknown keys, no NaN, no
    infinity."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    # ``self`` by position alone: a file can have a key of that name.
    def __init__(self, /, **data: Any) -> None:
        try:
            super().__init__(**data)
        except ValidationError as invalid:
            raise InputError(explain_invalid(invalid, self.called(data), type(self).model_fields)) from None

    @model_validator(mode="before")
    @classmethod
    def _plain_numbers(cls, data: Any) -> Any:
        if not isinstance(data, Mapping):
            return data
        label, numeric = cls.called(data), cls.numeric()
        return {k: plain(f"{label}.{k}", v) if k in numeric else v for k, v in data.items()}

    @classmethod
    @functools.cache
    def numeric(cls) -> frozenset[str]:
        """Return the names of the settings that are numbers, or lists of them."""
        return frozenset(name for name, info in cls.model_fields.items() if is_numeric(info.annotation))

    @classmethod
    def called(cls, data: Mapping[str, Any]) -> str:
        """Return what messages call the one that is made of these values."""
        return cls.kind()

    @classmethod
    def kind(cls) -> str:
        """Return the name of this class in files and messages: snake_case."""
        return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", cls.__name__).lower()


class Component(AccuracyHints, Checked):
    """A component is a part of a scene."""

    model_config = ConfigDict(ignored_types=(DEVICE_FUNCTION,))

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name, own in vars(cls).items():
            promised = any(is_device_function(vars(base).get(name)) for base in cls.__mro__[1:])
            rule = "decorated with ti.func, as in its contract"
            must(not promised or is_device_function(own), f"{cls.__name__}.{name}", rule, type(own).__name__)

    @model_validator(mode="after")
    def _in_range(self) -> Self:
        """Refuse magnitudes with which the arithmetic does not hold (see ranges.py)."""
        varying = {name for name, _, _ in self.parameters()}
        for name, info in type(self).model_fields.items():
            value, where = getattr(self, name), f"{self.label}.{name}"
            if name in varying and value is not None:
                check_magnitude(where, unit_of(info), value)
            elif info.annotation in (int, int | None, int | float) and not _bounded(info):
                must(value is None or abs(value) < WHOLE, where, f"less than {WHOLE}", value)
        return self

    def unit_as_set(self, name: str) -> str:
        """Return the unit of a setting as it is set; by default the one that it is declared with."""
        return unit_of(type(self).model_fields[name])

    @property
    def label(self) -> str:
        """Return what files and messages call it."""
        return self.called(vars(self))

    @classmethod
    def named(cls, kind: Any, where: str) -> type[Self]:
        """Return the subclass of this name; raise InputError naming ``where`` and the known names
        otherwise."""
        known = cls.known()
        rule = f"one of {some_of(known, kind, LISTED)}, or your own (--plugin, import)"
        must(isinstance(kind, str) and kind in known, where, rule, kind)
        return known[kind]

    @classmethod
    def known(cls) -> dict[str, type[Self]]:
        """Return every part made after this contract that has been imported, by name; itself too if it is
        none."""
        return {kind.kind(): kind for kind in cls.kinds()}

    @classmethod
    def kinds(cls) -> Iterator[type[Self]]:
        """Yield every part made after this contract, but those of a file of which another version has been
        loaded."""
        for kind in (cls, *_descendants(cls)):
            if not kind.__dict__.get("contract") and not python_file.is_superseded(kind):
                yield kind

    def parts(self) -> Iterator[Component]:
        """Yield the part itself and the parts that it is made of, also those in lists."""
        yield self
        for name in type(self).model_fields:
            value = getattr(self, name)
            inner = (
                value if isinstance(value, tuple) and value and isinstance(value[0], Component) else (value,)
            )
            for part in inner:
                if isinstance(part, Component):
                    yield from part.parts()

    @classmethod
    @functools.cache
    def parameters(cls) -> tuple[tuple[str, FieldInfo, int], ...]:
        """Return name, declaration and number of components of each parameter that may differ per world. They
        are found once: a class that has been asked is complete."""
        sizes: dict[Any, int] = {float: 1, float | None: 1, Vector: 3}
        fields = ((name, info, sizes.get(info.annotation, 0)) for name, info in cls.model_fields.items())
        return tuple(field for field in fields if field[2])

    @classmethod
    @functools.cache
    def lists(cls) -> tuple[tuple[str, type[Component]], ...]:
        """Return name, and kind of row, of each parameter that is a list of parts, ``tuple[Row, ...]``; a
        world may have any number of them. They are found once."""
        found = []
        for name, info in cls.model_fields.items():
            row, *rest = get_args(info.annotation) if get_origin(info.annotation) is tuple else (None,)
            if rest == [...] and isinstance(row, type) and issubclass(row, Component):
                found.append((name, row))
        return tuple(found)

    @classmethod
    def from_files(cls, values: dict[str, Any], where: str, folder: Path) -> dict[str, Any]:
        """Return the parameters that a table of a scene gives, ``where`` in it, with what it names in other
        files read from these; ``folder`` is that of the scene. By default a table names no files."""
        return values

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        """Yield name and number of components of what kernels read of each world: the parameters, and what a
        part makes of them besides."""
        for name, _, size in cls.parameters():
            yield name, size

    def values(self) -> list[float]:
        """Return the numbers of ``columns()`` in order, vectors spread out; SI units."""
        spread: list[float] = []
        for name, _, size in self.parameters():
            value = getattr(self, name)
            spread.extend(value if size == 3 else (value,))
        return spread

    def members(self) -> dict[str, Component]:
        """Return, by name, the parts that it is made of and that kernels read as parts of it, ``self.NAME``;
        by default none."""
        return {}

    def derived_rows(self) -> dict[str, list[float]]:
        """Return, by name, rows of numbers that a kernel reads as ``self.NAME(w, k)``, made of what differs
        per world; by default none. How long they are is compiled in."""
        return {}

    @classmethod
    def room(cls, rows: int) -> int:
        """Return how many rows of this kind a list has room for, so that scenes with lists of like lengths
        run as one batch."""
        return max(cls.least_rows, 1 << (rows - 1).bit_length())

    def structure(self) -> tuple[Any, ...]:
        """Return what is compiled in: class, every option that is not a per-world parameter, room for
        lists."""
        varying = {name for name, _, _ in self.parameters()} | {name for name, _ in self.lists()}
        options, members = (n for n in type(self).model_fields if n not in varying), self.members()
        fixed = tuple((n, members[n].structure() if n in members else getattr(self, n)) for n in options)
        return (
            type(self),
            *fixed,
            *((name, kind.room(len(getattr(self, name)))) for name, kind in self.lists()),
        )

    def lookups(self) -> dict[str, np.ndarray]:
        """Return the numbers that a kernel looks up, the same in every world, ``self.NAME[i, j]``; they are
        made for what is compiled, so of the options that are no parameters. They go by name, with shape
        (rows, columns)."""
        return {}

    def remarks(self) -> dict[str, str]:
        """Return, by name, what ``tisim explain`` says of it besides its parameters; by default nothing."""
        return {}

    contract: ClassVar[bool] = False
    """A class sets this if it is no part of a scene itself, only what parts are made after."""
    requires: ClassVar[tuple[type[Component], ...]] = ()
    """These are the effects without which this one means nothing."""
    excludes: ClassVar[tuple[type[Component], ...]] = ()
    """These are the effects that cannot be in a scene with this one."""
    precedes: ClassVar[tuple[type[Component], ...]] = ()
    """These are the effects that must come after this one, where a scene has them."""
    incompatible_controls: ClassVar[tuple[str, ...]] = ()
    """These kinds of step control do not see what this effect needs them to."""
    least_rows: ClassVar[int] = 32
    """Every list of parts of this kind has room for at least so many."""


def _descendants(cls: type[Any]) -> Iterator[type[Any]]:
    for sub in cls.__subclasses__():
        yield sub
        yield from _descendants(sub)


def parameter(unit: str, text: str, default: Any = ..., **rules: Any) -> Any:
    """Declare a physical parameter: its unit ("" for a pure number), what it is in a phrase, and its default.

    ``rules`` are pydantic's, such as ``gt=0``; ``examples=[3e5]`` gives a value for templates where there is
    no default.

    A float or ``Vector`` parameter may differ in every world of a batch. A kernel reads it as
    ``self.name(w)``; a plain Python number there would be frozen into the kernel at first compile. A list of
    parts, ``tuple[Row, ...]`` with Row a Component of such parameters, is one bound Row there. Its parameters
    are functions of the world and the row: ``self.rows.name(w, k)``, k below ``self.rows.size(w)``.
    """
    if not (isinstance(text, str) and text):
        raise TypeError(f"parameter must be given a text after its unit; received {text!r}")
    return Field(default, description=text, json_schema_extra={"unit": unit}, **rules)


def option(text: str, default: Any = ..., **rules: Any) -> Any:
    """Declare what is no physical quantity, such as a method or a number of sweeps: what it is, its default.

    It is the same in all worlds of a batch, and a kernel reads it as ``self.name``, compiled in. ``rules``
    are those of ``parameter``.
    """
    if not (isinstance(text, str) and text):
        raise TypeError(f"option must be given a text first; received {text!r}")
    return Field(default, description=text, **rules)


def _bounded(info: FieldInfo) -> bool:
    """Return whether the rules of a number say how large it may be."""
    return any(hasattr(rule, "le") or hasattr(rule, "lt") for rule in info.metadata)
