"""Parts of a scene to and from plain data, each by the name of its kind."""

from __future__ import annotations

import importlib
import json
import pkgutil
from collections.abc import Mapping
from types import ModuleType
from typing import Any, TypeVar

from tisim.errors import must
from tisim.spec import Spec
from tisim.steppers.controller import Controller
from tisim.steppers.stepper import Stepper

Part = TypeVar("Part", bound=Spec)


def load(package: ModuleType) -> None:
    """Import every module of a package, so that its effects can be found by name."""
    for module in pkgutil.iter_modules(package.__path__):
        importlib.import_module(f"{package.__name__}.{module.name}")


def from_dict(base: type[Part], data: Any, where: str) -> Part:
    """The part that ``data["kind"]`` names; its other keys are its parameters."""
    must(isinstance(data, Mapping), where, "a table", data)
    values = dict(data)
    must("kind" in values, f"{where}.kind", f"given, to name a kind of {base.kind()}", "nothing")
    return base.named(values.pop("kind"), f"{where}.kind")(**values)


def stepper(data: Any) -> Stepper:
    """The stepper of a scene, with its step control."""
    must(isinstance(data, Mapping), "stepper", "a table", data)
    values = dict(data)
    if "control" in values:
        values["control"] = from_dict(Controller, values["control"], "stepper.control")
    return Stepper.named(values.pop("kind", "verlet"), "stepper.kind")(**values)


def to_dict(part: Spec, named: bool = True) -> dict[str, Any]:
    """Kind and parameters of a part, those left at None not among them."""
    values = {key: value for key, value in part.model_dump(mode="json").items() if value is not None}
    return {"kind": part.kind(), **values} if named else values


def toml(table: Mapping[str, Any], path: str = "") -> str:
    """TOML text of nested tables of numbers, text, flags and lists."""
    lines = [f"{key} = {_value(value)}" for key, value in table.items() if not isinstance(value, Mapping)]
    text = "\n".join(lines) + "\n" if lines else ""
    for key, value in table.items():
        if isinstance(value, Mapping):
            name = f"{path}.{key}" if path else key
            text += f"\n[{name}]\n{toml(value, name).lstrip()}"
    return text


def _value(value: Any) -> str:
    if isinstance(value, list | tuple):
        return "[" + ", ".join(_value(item) for item in value) + "]"
    return json.dumps(value)
