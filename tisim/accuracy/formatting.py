"""Settings of a scene as text: as Python, and as options of ``tisim run``."""

from __future__ import annotations

import shlex
from collections.abc import Iterator
from typing import Any

from tisim.components import serialization
from tisim.components.component import Component
from tisim.scene.scene import Scene


def non_default_settings(part: Component) -> dict[str, Any]:
    """Return the settings of a part that differ from their defaults, by name."""
    return {
        name: getattr(part, name)
        for name, info in type(part).model_fields.items()
        if info.is_required() or getattr(part, name) != info.get_default()
    }


def expression(part: Component) -> str:
    """Return a part as Python, without default settings: Boris(control=FixedStep(dt=1e-05))."""
    arguments = (f"{name}={text_of_setting(value)}" for name, value in non_default_settings(part).items())
    return f"{type(part).__name__}({', '.join(arguments)})"


def text_of_setting(value: Any) -> str:
    """Return the value of a setting as Python."""
    return expression(value) if isinstance(value, Component) else repr(value)


def options(scene: Scene, changed: Scene, precision: str = "f64", arithmetic: str = "strict") -> list[str]:
    """Return the options that make ``tisim run`` run ``changed`` instead of ``scene``."""
    old, new = ({effect.label: effect for effect in s.effects} for s in (scene, changed))
    arguments = [argument for name in old if name not in new for argument in ("--without", name)]
    settings = list(_differences(scene.stepper, changed.stepper, "stepper"))
    for name, effect in new.items():
        settings += _differences(old.get(name), effect, f"effects.{name}")
    for name, material in changed.materials.items():
        settings += _differences(scene.materials.get(name), material, f"materials.{name}")
    for key, value in settings:
        arguments += ["--set", f"{key}={value}"]
    arguments += ["--precision", precision] if precision != "f64" else []
    return arguments + (["--arithmetic", arithmetic] if arithmetic != "strict" else [])


def shell_line(arguments: list[str]) -> str:
    """Return command-line arguments as one line for a shell."""
    return shlex.join(arguments)


def _differences(old: Component | None, new: Component, path: str) -> Iterator[tuple[str, str]]:
    """Yield the dotted key and the TOML value of each setting that differs. A part is given as a whole if its
    kind differs, or if a setting becomes None, which TOML cannot express."""
    names = type(new).model_fields
    if type(old) is not type(new) or any(
        getattr(new, n) is None for n in names if getattr(old, n) is not None
    ):
        yield path, serialization.inline(_table(new, named=path != f"effects.{new.kind()}"))
        return
    for name in names:
        before, value = getattr(old, name), getattr(new, name)
        if before != value and isinstance(value, Component):
            yield from _differences(before, value, f"{path}.{name}")
        elif before != value:
            yield f"{path}.{name}", serialization.inline(value)


def _table(part: Component, named: bool = True) -> dict[str, Any]:
    table = {
        name: _table(v) if isinstance(v, Component) else v for name, v in non_default_settings(part).items()
    }
    return {"kind": part.kind(), **table} if named else table
