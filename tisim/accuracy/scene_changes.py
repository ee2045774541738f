"""Changes of a scene: copies with other parts, settings or materials, and a change as text.

A part is named by its dotted path, as in a TOML file. A change is written as Python, or as options of ``tisim
run``.
"""

from __future__ import annotations

import shlex
from collections.abc import Callable, Iterator, Mapping, Sequence
from typing import Any

from tisim.components import serialization
from tisim.components.accuracy_parameter import AccuracyParameter, three_digits
from tisim.components.component import Component, unit_of
from tisim.scene.scene import Scene

SOFTER = (1000.0, 100.0, 10.0)
"""Factors by which materials are softened, a common approximation for grains, with longer steps."""


def parts(scene: Scene) -> Iterator[tuple[str, Component]]:
    """Yield every part of a scene with its dotted path, as in a TOML file."""
    for effect in scene.effects:
        yield from within(f"effects.{effect.label}", effect)
    for name in ("particles", "domain", "stepper"):
        yield from within(name, getattr(scene, name))


def within(path: str, part: Component) -> Iterator[tuple[str, Component]]:
    """Yield a part at a dotted path, and every part within it with its own path."""
    yield path, part
    for name in type(part).model_fields:
        if isinstance(inner := getattr(part, name), Component):
            yield from within(f"{path}.{name}", inner)


def exchanged(scene: Scene, path: str, part: Component) -> Scene:
    """Return a copy of a scene with another part at this dotted path. Settings of other effects that must
    equal those of the part are changed too."""
    first, *rest = path.split(".")
    if first == "effects":
        own = next(effect for effect in scene.effects if effect.label == rest[0])
        new = _put(own, rest[1:], part)
        effects = tuple(new if effect is own else effect.beside(new) for effect in scene.effects)
        return scene.model_copy(update={"effects": effects})
    return scene.model_copy(update={first: _put(getattr(scene, first), rest, part)})


def _put(part: Any, path: Sequence[str], new: Component) -> Any:
    if not path:
        return new
    return part.model_copy(update={path[0]: _put(getattr(part, path[0]), path[1:], new)})


def turned(scene: Scene, path: str, accuracy_parameter: AccuracyParameter, decades: float) -> Scene:
    """Return a copy with an accuracy parameter of the part at ``path`` changed; InputError if the value is
    invalid."""
    return exchanged(scene, path, accuracy_parameter.turned(dict(parts(scene))[path], decades))


def in_steps(scene: Scene, length: Callable[[float], float]) -> Scene:
    """Return a copy with other step lengths: all settings of the step control with the unit s."""
    control = scene.stepper.control
    lengths = [name for name, info in type(control).model_fields.items() if unit_of(info) == "s"]
    changed = {name: length(getattr(control, name)) for name in lengths}
    return exchanged(scene, "stepper.control", control.model_copy(update=changed))


def in_steps_of_at_most(scene: Scene, longest: float) -> Scene:
    """Return a copy whose steps are at most this long (s)."""
    return in_steps(scene, lambda length: min(length, longest))


def finest(scene: Scene, decades: float) -> Scene:
    """Return a copy with every accuracy parameter of its effects refined, so that their errors do not hide
    the error of the stepper."""
    for path, part in list(parts(scene)):
        for accuracy_parameter in part.accuracy_parameters:
            if accuracy_parameter.converges and not path.startswith("stepper"):
                scene = turned(scene, path, accuracy_parameter, decades)
    return scene


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
    # A stepper that tisim has chosen is not in the data of a scene: its settings cannot be set one by one,
    # and it is chosen anew for other effects.
    named = scene.stepper if "stepper" in scene.model_fields_set else None
    chosen_anew = named is None and (changed.effects, changed.materials) != (scene.effects, scene.materials)
    same = changed.stepper == scene.stepper and not chosen_anew
    settings = [] if same else list(_differences(named, changed.stepper, "stepper"))
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
