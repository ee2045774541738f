"""Scenes as plain data, nested tables as in a TOML file: conversion in both directions, and changes by
key."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

from tisim.components import serialization
from tisim.components.component import Component
from tisim.domains.domain import Domain
from tisim.effects.base import Effect
from tisim.errors import InputError, Words, abbreviated, did_you_mean, must, printable
from tisim.scene import plugins
from tisim.scene.initial_state import Start
from tisim.steppers.base import Stepper
from tisim.steppers.verlet import Verlet


def scene_fields(data: Mapping[str, Any], folder: Path) -> dict[str, Any]:
    """Return the fields of a scene, given its plain data and the folder to which file names in the data are
    relative; InputError names the key that is wrong."""
    rest = serialization.table(data, "scene")
    must("particles" in rest, "scene.particles", "given", Words("nothing"))
    plugins.load_parts()
    fields: dict[str, Any] = {
        "particles": serialization.from_dict(Start, rest.pop("particles"), "particles", folder)
    }
    if "domain" in rest:
        fields["domain"] = serialization.from_dict(Domain, rest.pop("domain"), "domain", folder)
    if "stepper" in rest:
        stepper = {"kind": Verlet.kind(), **serialization.table(rest.pop("stepper"), "stepper")}
        fields["stepper"] = serialization.from_dict(Stepper, stepper, "stepper", folder)
    effects_table = serialization.table(
        rest.pop("effects", {}), "scene.effects", "a table of effects, such as [effects.impact]"
    )
    fields["effects"] = tuple(_effect(name, values, folder) for name, values in effects_table.items())
    for name in rest.keys() & {"materials", "material_pairs"}:
        named = serialization.table(rest.pop(name), f"scene.{name}", "a table of tables")
        fields[name] = {key: serialization.table(row, f"{name}.{key}") for key, row in named.items()}
    return {**fields, **rest}


def change(data: dict[str, Any], key: str, value: Any) -> None:
    """Set the value at a dotted key in the plain data of a scene."""
    *path, last = key.split(".")
    place: Any = data
    for depth, step in enumerate(path):
        place = place[_step(place, step, key, ".".join(path[:depth]))]
    # A missing key may be one that was left at its default.
    place[last if isinstance(place, dict) else _step(place, last, key, ".".join(path))] = value


def tables(key: str, parts: Mapping[str, Component]) -> dict[str, Any]:
    """Return a key with a table of each part by name; an empty dictionary if there are no parts."""
    tables = {name: serialization.to_dict(part, named=False) for name, part in parts.items()}
    return {key: tables} if tables else {}


def effect_table(effect: Effect) -> dict[str, Any]:
    """Return the parameters of an effect, with its kind if that is not the name of its table."""
    values = serialization.to_dict(effect, named=effect.label != effect.kind())
    return {key: value for key, value in values.items() if key != "name"}


def _effect(name: str, values: Any, folder: Path) -> Effect:
    """Return the effect of a table. The name of the table is the name of the effect, and its kind unless the
    table has one."""
    where = f"effects.{name}"
    table = serialization.table(values, where)
    own = table.pop("name", None)
    must(own in (None, name), f"{where}.name", "left out: it is the table's name", own)
    name_entry = {"name": name} if table.get("kind", name) != name else {}
    return serialization.from_dict(Effect, {"kind": name, **table, **name_entry}, where, folder)


def _step(place: Any, step: str, key: str, path: str) -> Any:
    """Return the key or index of the next place in plain data; InputError with the whole ``key``.

    path : dotted name of the place; empty for the scene itself.
    """
    # With few digits, because Python refuses to read numbers of some thousand digits.
    in_list = isinstance(place, list) and step.isdecimal() and len(step) < 10 and int(step) < len(place)
    if not in_list and not (isinstance(place, dict) and step in place):
        names = list(place) if isinstance(place, dict) else []
        rows = f"rows 0 to {len(place) - 1}" if isinstance(place, list) and place else "none"
        rule = f"a setting of this scene ({path or 'the scene'} has {', '.join(names) or rows})"
        nearest = did_you_mean(step, names)
        raise InputError(f"{printable(key)} must be {rule}; received {abbreviated(step)}{nearest}")
    return int(step) if in_list else step
