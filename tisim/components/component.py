"""Validated plain data: the parts of a scene, their units, and their names in files.

A ``Component`` is a frozen pydantic model. Its name in a file is its class name in snake_case
(``StokesDrag`` is ``stokes_drag``), found by walking subclasses: nothing is registered anywhere.
"""

from __future__ import annotations

import functools
import re
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path
from typing import Annotated, Any, ClassVar, Self, get_args, get_origin

import numpy as np
from pydantic import AfterValidator, BaseModel, ConfigDict, Field, ValidationError, model_validator
from pydantic.fields import FieldInfo
from pydantic_core import PydanticCustomError

from tisim.backend.taichi import DEVICE_FUNCTION, is_device_function
from tisim.components.accuracy_parameter import AccuracyParameter
from tisim.components.invalid import explain_invalid, unit_of
from tisim.components.plain_numbers import is_numeric, plain
from tisim.components.ranges import WHOLE, check_magnitude
from tisim.errors import InputError, must, some_of
from tisim.files import python_file

Vector = tuple[float, float, float]
"""A vector of three Cartesian components."""
LISTED = "'tisim effects'"
"""The command that lists all parts of a scene by name."""


def snake_case(name: str) -> str:
    """Return the name of a class in files and messages."""
    return re.sub(r"(?<=[a-z0-9])(?=[A-Z])", "_", name).lower()


def _encodable(text: str) -> str:
    if any("\ud800" <= character <= "\udfff" for character in text):
        raise PydanticCustomError("surrogate", "text that UTF-8 can hold")
    return text


Text = Annotated[str, AfterValidator(_encodable)]
"""Text that UTF-8 can encode, without unpaired surrogates."""


class Checked(BaseModel):
    """Validated plain data: frozen, without unknown keys, NaN or infinity; invalid data raise InputError."""

    model_config = ConfigDict(frozen=True, extra="forbid", allow_inf_nan=False)

    # ``self`` is positional-only, because a file can have a key of that name.
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
        """Return the names of the settings that are numbers or lists of numbers."""
        return frozenset(name for name, info in cls.model_fields.items() if is_numeric(info.annotation))

    @classmethod
    def called(cls, data: Mapping[str, Any]) -> str:
        """Return the name that messages use for an object with these values."""
        return cls.kind()

    @classmethod
    def kind(cls) -> str:
        """Return the name of this class in files and messages: snake_case."""
        return snake_case(cls.__name__)


class Component(Checked):
    """A component is a part of a scene.

    Two hints are read by ``tisim cost`` only; a part without hints is not varied in a cost study.

    accuracy_parameters : settings that trade accuracy for time.
    softening : properties of materials that may be lowered to allow longer steps. Each value is the power of
        the property by which the duration of an impact at a given speed decreases: {"young": 0.4} for a
        duration proportional to E^-0.4. At a given load the dependence may be weaker: the overlap in Hertz's
        law is proportional to E^-2/3, so the stiffness of a contact at rest is proportional to E^(2/3) and
        its oscillation period to E^-1/3. All other constants are unchanged. For example, a cohesion has more
        effect on softer grains, and the spring of a bond may be too stiff for the longer steps; such effects
        are part of the measured error.
    """

    model_config = ConfigDict(ignored_types=(DEVICE_FUNCTION,))
    accuracy_parameters: ClassVar[tuple[AccuracyParameter, ...]] = ()
    softening: ClassVar[Mapping[str, float]] = {}

    def __init_subclass__(cls, **kwargs: Any) -> None:
        super().__init_subclass__(**kwargs)
        for name, own in vars(cls).items():
            promised = any(is_device_function(vars(base).get(name)) for base in cls.__mro__[1:])
            rule = "decorated with ti.func, as in its contract"
            must(not promised or is_device_function(own), f"{cls.__name__}.{name}", rule, type(own).__name__)

    @model_validator(mode="before")
    @classmethod
    def _are_lists(cls, data: Any) -> Any:
        """Raise InputError if a part is given in place of a list of such parts."""
        for name, kind in cls.lists() if isinstance(data, Mapping) else ():
            value, rule = data.get(name), f"a list or tuple of {kind.kind()}"
            must(not isinstance(value, Component), f"{cls.called(data)}.{name}", rule, value)
        return data

    @model_validator(mode="after")
    def _in_range(self) -> Self:
        """Raise InputError for magnitudes for which the arithmetic is invalid (see ranges.py)."""
        varying = {name for name, _, _ in self.parameters()}
        for name, info in type(self).model_fields.items():
            value, where = getattr(self, name), f"{self.label}.{name}"
            if name in varying and value is not None:
                check_magnitude(where, unit_of(info), value)
            elif info.annotation in (int, int | None, int | float) and not _bounded(info):
                must(value is None or abs(value) < WHOLE, where, f"less than {WHOLE}", value)
        return self

    def unit_as_set(self, name: str) -> str:
        """Return the unit of the value of a setting; by default its declared unit."""
        return unit_of(type(self).model_fields[name])

    @property
    def label(self) -> str:
        """Return the name of this part in files and messages."""
        return self.called(vars(self))

    @classmethod
    def named(cls, kind: Any, where: str) -> type[Self]:
        """Return the subclass of this name; otherwise raise InputError, naming ``where`` and the known
        names."""
        known = cls.known()
        rule = f"one of {some_of(known, kind, LISTED)}, or your own (--plugin, import)"
        must(isinstance(kind, str) and kind in known, where, rule, kind)
        return known[kind]

    @classmethod
    def known(cls) -> dict[str, type[Self]]:
        """Return all imported subclasses that are not contracts, by name, including this class if it is not
        one."""
        return {kind.kind(): kind for kind in cls.kinds()}

    @classmethod
    def kinds(cls) -> Iterator[type[Self]]:
        """Yield this class and its subclasses, except contracts and classes from superseded versions of a
        file."""
        for kind in (cls, *_descendants(cls)):
            if not kind.__dict__.get("contract") and not python_file.is_superseded(kind):
                yield kind

    def parts(self) -> Iterator[Component]:
        """Yield this part and all parts nested in it, including those in lists."""
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
        """Return name, declaration and number of components of each parameter that may differ per world. The
        result is cached, so the class must be complete at the first call."""
        sizes: dict[Any, int] = {float: 1, float | None: 1, Vector: 3}
        fields = ((name, info, sizes.get(info.annotation, 0)) for name, info in cls.model_fields.items())
        return tuple(field for field in fields if field[2])

    @classmethod
    @functools.cache
    def lists(cls) -> tuple[tuple[str, type[Component]], ...]:
        """Return name and row class of each parameter that is a list of parts, ``tuple[Row, ...]``; its
        length may differ per world. The result is cached."""
        found = []
        for name, info in cls.model_fields.items():
            row, *rest = get_args(info.annotation) if get_origin(info.annotation) is tuple else (None,)
            if rest == [...] and isinstance(row, type) and issubclass(row, Component):
                found.append((name, row))
        return tuple(found)

    @classmethod
    def from_files(cls, values: dict[str, Any], where: str, folder: Path) -> dict[str, Any]:
        """Return the parameters that a table of a scene gives, with the contents of other files that it
        refers to. ``where`` is the path of the table in the scene, and ``folder`` the folder of the scene. By
        default no parameter refers to a file."""
        return values

    @classmethod
    def columns(cls) -> Iterator[tuple[str, int]]:
        """Yield name and number of components of the per-world numbers that kernels read: the parameters, and
        numbers that a part derives from them."""
        for name, _, size in cls.parameters():
            yield name, size

    def values(self) -> list[float]:
        """Return the numbers of ``columns()`` in order, with vectors flattened; SI units."""
        spread: list[float] = []
        for name, _, size in self.parameters():
            value = getattr(self, name)
            spread.extend(value if size == 3 else (value,))
        return spread

    def members(self) -> dict[str, Component]:
        """Return, by name, the nested parts that kernels access as ``self.NAME``; by default none."""
        return {}

    def derived_rows(self) -> Mapping[str, Sequence[float] | np.ndarray]:
        """Return, by name, rows of derived per-world numbers that a kernel reads as ``self.NAME(w, k)``; by
        default none. The length of each row is compiled in, and must be the same for all parts of a
        structure."""
        return {}

    @classmethod
    def list_capacity(cls, rows: int) -> int:
        """Return the capacity of a list for this number of rows of this class. Capacities are rounded up, so
        that scenes with lists of similar lengths can run in one batch. A part whose lists may have more
        memory than they need reads it from ``room``."""
        return max(cls.least_rows, 1 << (rows - 1).bit_length())

    def needed_room(self) -> dict[str, int]:
        """Return, by name, the number of rows that memory for each list of this part must hold at least."""
        return {name: kind.list_capacity(len(getattr(self, name))) for name, kind in self.lists()}

    def room(self) -> dict[str, int]:
        """Return, by name, the number of rows for which each list has memory: the needed ones, or more
        (``with_room``)."""
        given: Mapping[str, int] = self.__dict__.get("_room", {})
        needed = self.needed_room()
        return {name: max(rows, given.get(name, 0)) if rows else 0 for name, rows in needed.items()}

    def room_size(self) -> int:
        """Return the numbers that kernels may read of the lists of this part, in each world."""
        room = self.room()
        return sum(room[name] * sum(size for _, size in kind.columns()) for name, kind in self.lists())

    def with_room(self, rows: Mapping[str, int]) -> Self:
        """Return a copy with memory for at least this number of rows in the lists of these names, so that it
        runs in one batch with parts that have longer lists. Lists without memory, for which nothing is
        compiled, stay without."""
        made = self.model_copy()
        # Not a field: a part stays equal to one with other memory, and files do not have it.
        made.__dict__["_room"] = dict(rows)
        return made

    def structure(self) -> tuple[Any, ...]:
        """Return everything that is compiled in: the class, every option, and the memory for lists, but no
        per-world parameters."""
        varying = {name for name, _, _ in self.parameters()} | {name for name, _ in self.lists()}
        options, members = (n for n in type(self).model_fields if n not in varying), self.members()
        fixed = tuple((n, members[n].structure() if n in members else getattr(self, n)) for n in options)
        return (type(self), *fixed, *self.room().items())

    def lookups(self) -> dict[str, np.ndarray]:
        """Return, by name, lookup tables of shape (rows, columns) that a kernel reads as ``self.NAME[i, j]``.
        They are the same in every world and may depend on options only, not on parameters."""
        return {}

    def remarks(self) -> dict[str, str]:
        """Return, by name, lines that ``tisim explain`` shows in addition to the parameters; by default
        none."""
        return {}

    contract: ClassVar[bool] = False
    """Whether this class is only a contract for subclasses, and not itself a part of a scene."""
    requires: ClassVar[tuple[type[Component], ...]] = ()
    """Effects that a scene with this effect must have."""
    excludes: ClassVar[tuple[type[Component], ...]] = ()
    """Effects that a scene with this effect must not have."""
    precedes: ClassVar[tuple[type[Component], ...]] = ()
    """Effects that must come after this one, if the scene has them."""
    incompatible_controls: ClassVar[tuple[str, ...]] = ()
    """Kinds of step control that cannot be used with this effect, because they do not account for it."""
    least_rows: ClassVar[int] = 32
    """Smallest capacity of a list of parts of this class."""


def _descendants(cls: type[Any]) -> Iterator[type[Any]]:
    for sub in cls.__subclasses__():
        yield sub
        yield from _descendants(sub)


def parameter(unit: str, text: str, default: Any = ..., **rules: Any) -> Any:
    """Declare a physical parameter: its unit ("" for a pure number), a phrase that describes it, and its
    default.

    ``rules`` are pydantic's, such as ``gt=0``; ``examples=[3e5]`` gives a value for templates if there is no
    default.

    A float or ``Vector`` parameter may differ in every world of a batch. A kernel reads it as
    ``self.name(w)``; a plain Python number would be frozen into the kernel at first compile. A list of parts,
    ``tuple[Row, ...]`` with Row a Component of such parameters, is one bound Row in kernels. Its parameters
    are functions of the world and the row: ``self.rows.name(w, k)``, for k below ``self.rows.size(w)``.
    """
    if not (isinstance(text, str) and text):
        raise TypeError(f"parameter must be given a text after its unit; received {text!r}")
    return Field(default, description=text, json_schema_extra={"unit": unit}, **rules)


def option(text: str, default: Any = ..., **rules: Any) -> Any:
    """Declare an option, a setting that is not a physical quantity, such as a method or a number of sweeps.

    ``text`` is a phrase that describes it. An option is the same in all worlds of a batch, and a kernel reads
    it as ``self.name``, compiled in. ``rules`` are those of ``parameter``.
    """
    if not (isinstance(text, str) and text):
        raise TypeError(f"option must be given a text first; received {text!r}")
    return Field(default, description=text, **rules)


def rounded(number: int) -> int:
    """Round a number up to the next one whose binary digits are all 0 after the first three.

    Sizes are compiled in. With rounded sizes, scenes of similar size share compiled kernels, within a process
    and through the cache on disk.
    """
    unit = 1 << max(0, number.bit_length() - 3)
    return -(-number // unit) * unit


def _bounded(info: FieldInfo) -> bool:
    """Return whether the rules of a number set an upper limit."""
    return any(hasattr(rule, "le") or hasattr(rule, "lt") for rule in info.metadata)
