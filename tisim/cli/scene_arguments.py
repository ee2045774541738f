"""The scene given by the arguments of a command: a case or a file, its size and seed, --without and --set."""

from __future__ import annotations

import math
import os
import tomllib
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from tisim.cli import targets
from tisim.components import serialization
from tisim.errors import InputError, abbreviated, must, printable
from tisim.scene.scene import Scene


def load_scene(
    target: str,
    size: str | None = None,
    seed: int | None = None,
    absent: Sequence[str] = (),
    changes: Sequence[str] = (),
    variant: str | None = None,
) -> tuple[str, Scene]:
    """Return name and scene of a case, or of a file that ends in .toml or .py; InputError if there is none.

    absent : effects to leave out, before ``changes``.
    changes : "key=value" texts.
    variant : name of a scene of the case, for cases with several.
    """
    if target.endswith(".toml"):
        must(size is None, "--size", "given for a case only", size)
        must(variant is None, "--variant", "given for a case only", variant)
        name, scene = Path(target).stem, Scene.from_toml(target)
        if seed is not None:
            scene = scene.replace({"seed": seed})
    else:
        case = targets.case(target, targets.SCENE_FILE)
        name = case.name if variant is None else f"{case.name}-{variant}"
        scene = case.scene_of(size or "default", seed or 0, variant)
    return name, scene.without(*absent).replace(assignments(changes))


def checkpoint_seconds() -> float:
    """Return the wall time between checkpoints of a run, s: TISIM_CHECKPOINT_SECONDS, or 60."""
    text = os.environ.get("TISIM_CHECKPOINT_SECONDS", "60")
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    must(seconds >= 0, "TISIM_CHECKPOINT_SECONDS", "a number of seconds, at least 0", text)
    return seconds


def assignments(changes: Sequence[str], option: str = "--set") -> dict[str, Any]:
    """Return ``key=value`` texts as a mapping. A value is parsed as TOML; if that fails, it is text.

    option : the option of the command line, for messages.
    """
    result = {}
    for change in changes:
        key, equals, text = change.partition("=")
        must(bool(key.strip() and equals), option, "key=value", change)
        result[key.strip()] = _parse_value(key, text)
    return result


def _parse_value(key: str, text: str) -> Any:
    """Return the value to the right of the equals sign: a TOML value, otherwise text."""
    try:
        return serialization.parse(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()
    except (RecursionError, ValueError):
        # The value is nested too deeply, or is a number with thousands of digits.
        raise InputError(
            f"{printable(key)} must be a value that can be read; received {abbreviated(text)}"
        ) from None


def table_changes(table: str, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return changes to the settings of one table without its name; InputError for keys of other tables."""
    for key in changes:
        must(key.startswith(f"{table}."), "--set", f"of the form {table}.KEY=VALUE", key)
    return {key.removeprefix(f"{table}."): value for key, value in changes.items()}


def with_changes(settings: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Return settings with dotted keys changed; missing tables are created."""
    result = dict(settings)
    for dotted, value in changes.items():
        *path, last = dotted.split(".")
        table = result
        for step in path:
            subtable = table.get(step, {})
            must(isinstance(subtable, Mapping), dotted, "a setting", last)
            # Copy the table, because the given settings must not change.
            copy = dict(subtable)
            table[step] = copy
            table = copy
        table[last] = value
    return result
