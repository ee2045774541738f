"""From the words of a command line to a scene: a case or a file, its size and seed, --without and --set."""

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


def scene(
    target: str,
    size: str | None = None,
    seed: int | None = None,
    absent: Sequence[str] = (),
    changes: Sequence[str] = (),
) -> tuple[str, Scene]:
    """Name and scene of a case, or of a file that ends in .toml or .py; InputError when there is none.

    absent : effects to leave out. changes : key=value texts, of what is then there.
    """
    if target.endswith(".toml"):
        must(size is None, "--size", "given for a case only", size)
        name, made = Path(target).stem, Scene.from_toml(target)
        if seed is not None:
            made = made.replace({"seed": seed})
    else:
        case = targets.case(target, f"or a scene file ending in .toml, {targets.OWN_FILE}")
        case.size(size or "default")
        name, made = case.name, case.scene(size or "default", seed or 0)
    return name, made.without(*absent).replace(assignments(changes))


def checkpoint_seconds() -> float:
    """Wall time between checkpoints of a run, s: TISIM_CHECKPOINT_SECONDS, a minute unless given."""
    text = os.environ.get("TISIM_CHECKPOINT_SECONDS", "60")
    try:
        seconds = float(text)
    except ValueError:
        seconds = math.nan
    must(seconds >= 0, "TISIM_CHECKPOINT_SECONDS", "a number of seconds, at least 0", text)
    return seconds


def assignments(changes: Sequence[str]) -> dict[str, Any]:
    """``key=value`` texts as a mapping. A value is read as TOML; what is not TOML is text."""
    found = {}
    for change in changes:
        key, equals, text = change.partition("=")
        must(bool(key.strip() and equals), "--set", "key=value", change)
        found[key.strip()] = _value(key, text)
    return found


def _value(key: str, text: str) -> Any:
    """What stands right of the equals sign: a TOML value, else text."""
    try:
        return serialization.parse(f"value = {text}")["value"]
    except tomllib.TOMLDecodeError:
        return text.strip()
    except (RecursionError, ValueError):
        # Nested too deeply to be read, or a number of thousands of digits.
        raise InputError(
            f"{printable(key)} must be a value that can be read; received {abbreviated(text)}"
        ) from None


def below(table: str, changes: Mapping[str, Any]) -> dict[str, Any]:
    """Changes to the settings of one table, without its name; InputError for any other."""
    for key in changes:
        must(key.startswith(f"{table}."), "--set", f"of the form {table}.KEY=VALUE", key)
    return {key.removeprefix(f"{table}."): value for key, value in changes.items()}


def nested(settings: Mapping[str, Any], changes: Mapping[str, Any]) -> dict[str, Any]:
    """Settings with dotted keys changed; tables on the way are made where they are missing."""
    result = dict(settings)
    for dotted, value in changes.items():
        *path, last = dotted.split(".")
        place = result
        for step in path:
            inside = place.get(step, {})
            must(isinstance(inside, Mapping), dotted, "a setting", last)
            # A copy, as the settings given stay as they are.
            inner = dict(inside)
            place[step] = inner
            place = inner
        place[last] = value
    return result
