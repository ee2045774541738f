"""Hostile input: nonsensical values, and valid scenes with such a value in the wrong place."""

from __future__ import annotations

import copy
import datetime
from functools import cache
from random import Random
from typing import Any

from tests.packing.test_placement import BALL, VIBRATION
from tests.scenes import flow, scene
from tisim import Blast, Cloud, Material, RandomAroundCylinder, RandomInBox, steppers
from tisim.components import serialization
from tisim.components.component import Component
from tisim.describe.explain import known_effects
from tisim.effects import Confinement, Effect, HardBodies, HardRods
from tisim.sources import MagneticField, PoreFlow, UniformFlow
from tisim.steppers import DriftLimit, FixedStep, Stepper


def nested(levels: int) -> list[Any]:
    """A list nested ``levels`` deep."""
    inner: list[Any] = []
    for _ in range(levels):
        inner = [inner]
    return inner


def tables(levels: int) -> dict[str, Any]:
    """A table nested ``levels`` deep."""
    inner: dict[str, Any] = {}
    for _ in range(levels):
        inner = {"a": inner}
    return inner


NUMBERS = (
    0, -0.0, 1, -1, 3, 0.5, 2.5, 1e-9, 2.3e-308, 5e-324, 1e-320, 1e-200, 1e-100, 1e-30, 1e15, 1e17, 3e38,
    1e39, 1e100, 1e155, 3e296, 1.7e308, float("inf"), -float("inf"), float("nan"), 2**31, 2**53 + 1, 2**63,
    -(2**63), 10**400, -(10**5000),
)  # fmt: skip
TEXTS = (
    "", " ", "x", "nan", "1e999", "sphere", "self", "kind", "größer", "日本", "😀", "a\x00b", "a\nb", "\x7f",
    "\ud800", 'a"b\\', "[table]", "a.b", "../x", "x" * 100_000, "9" * 5000,
)  # fmt: skip
OTHERS = (
    None, True, False, (), [], {}, [[]], [None], [1], [1, 2], [1, 2, 3], [1, 2, 3, 4], [1, "2", 3], [0.0] * 3,
    [[0, 0, 0]], [[0, 0, 0]] * 2, [[1, 2], [3]], {"kind": "verlet"}, {"kind": []}, {"self": 1}, {"": 1},
    {"a": {"b": 1}}, datetime.date(2004, 1, 1), datetime.time(1), b"bytes", 1j, {3}, {3: 4}, object(),
)  # fmt: skip
DEEP = (100, 500, 2000, 20_000)


def value(random: Random) -> Any:
    """A random hostile value."""
    choice = random.randrange(10)
    if choice < 4:
        return random.choice(NUMBERS)
    if choice < 6:
        return random.choice(TEXTS)
    if choice < 9:
        return copy.deepcopy(random.choice(OTHERS))
    return random.choice((nested, tables))(random.choice(DEEP))


def _places(data: Any, path: tuple[Any, ...] = ()) -> list[tuple[Any, ...]]:
    """Every place in plain data except the root; only the first few of long lists, and none very deep."""
    items = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    paths = []
    for key, inner in list(items)[: 8 if len(path) < 8 else 0]:
        paths += [(*path, key), *_places(inner, (*path, key))]
    return paths


def _mutate(data: dict[str, Any], random: Random) -> None:
    """Change one thing: replace a value or a key, or remove it."""
    *path, last = random.choice(_places(data))
    place: Any = data
    for step in path:
        place = place[step]
    kind = random.randrange(8)
    if kind < 4:
        place[last] = value(random)
    elif kind == 4:
        del place[last]
    elif isinstance(place, list):
        place.extend([copy.copy(place[last])] * random.choice((1, 2, 40)))
    elif kind == 5:
        place[random.choice((*TEXTS, 3, None, (1, 2)))] = place.pop(last)
    elif kind == 6:
        place[random.choice(TEXTS)] = copy.copy(place[last])
    else:
        place[random.choice(list(place))] = place[last]


def mutated(random: Random) -> dict[str, Any]:
    """Plain data of a valid scene with one to three changes."""
    data = copy.deepcopy(random.choice(valid()))
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        if data:
            _mutate(data, random)
    return data


@cache
def valid() -> tuple[dict[str, Any], ...]:
    """Plain data of scenes: all cases, every stepper and control, every start, and every effect with those it
    needs."""
    from tisim.cases.case import every

    base = scene([[0, 0, 0], [1, 0, 0]], [[0, 0, 0]] * 2, quantities={"temperature": 300.0})
    tables_ = [flow(grains=3).to_dict(), base.to_dict()]
    cases = dict(every())
    # Its flow would be solved again for each changed fibre; the one of pore_flow below is small.
    tables_.append(cases.pop("packed_filter").scenes["uniform-flow"]("small", 1).to_dict())
    tables_ += [case.scene(size, 1).to_dict() for case in cases.values() for size in list(case.sizes)[:2]]
    box = {"kind": "box", "low": [-1.0] * 3, "high": [1.0] * 3}
    # For Ewald sums, which use images.
    wide = {"kind": "box", "low": [-4.2] * 3, "high": [4.2] * 3}
    cylinder = RandomAroundCylinder(radius=0.5, length=3.0, thickness=0.4)
    starts = (
        Cloud(**BALL, specific_charge=10.0, pulse=Blast(energy=1e4)),
        Cloud(**VIBRATION, quantities={"charge": 1.0, "spin": (0.0, 0.0, 3.0)}),
        Cloud(number=9, radius=0.02, density=1.0, placement=cylinder),
        Cloud(number=5, radius=0.1, density=1.0, placement=RandomInBox(low=(0, 0, 0), high=(1, 1, 1))),
        Cloud(number=5, radius=0.1, density=1.0),
    )
    for start in starts:
        tables_.append({**base.to_dict(), "domain": box, "particles": serialization.to_dict(start)})
    step = FixedStep(dt=1e-9)
    controls = {"brownian": DriftLimit(longest=1e-9), "boris": step, "langevin": step}
    for name, kind in _kinds(Stepper).items():
        fluid = {"temperature": 300.0, "viscosity": 1e-3} if name in ("brownian", "langevin") else {}
        control = {"control": controls[name]} if name in controls else {}
        more = {"effects": with_needed(HardRods), "domain": box} if kind.packs else {}
        tables_.append({**base.to_dict(), **more, "stepper": serialization.to_dict(kind(**fluid, **control))})
    return (
        *tables_,
        *(
            {
                **base.to_dict(),
                "domain": wide if kind.kind().startswith("ewald_") else base.to_dict()["domain"],
                "materials": materials(),
                "effects": with_needed(kind),
            }
            for kind in known_effects()
            if not issubclass(kind, Confinement | HardBodies)
        ),
    )


def with_needed(kind: type[Effect]) -> dict[str, Any]:
    """Plain data of an effect, after the effects that it needs."""
    partners: dict[str, Any] = {}
    for contract in kind.requires:
        partners |= with_needed(next(other for other in known_effects() if issubclass(other, contract)))
    if kind.requires_source:
        partners |= with_needed(UniformFlow if "flow_velocity" in kind.requires_source else MagneticField)
    rows = {name: [_required(row)] for name, row in kind.lists()}
    return {**partners, kind.kind(): serialization.to_dict(kind(**_required(kind), **rows), named=False)}


def _required(kind: type[Component]) -> dict[str, Any]:
    """A valid value for each required parameter."""
    fit = {"cutoff": 4.0, "low": (0.0, 0.0, 0.0), "high": (4.0, 4.0, 4.0), "second": 4.0}
    fit |= {"duct_radius": 4.0, "semi_axes": (0.5, 0.4, 0.3), "exponents": (2.0, 3.0, 4.0)}
    values = {
        name: fit.get(name, 0.5 if size == 1 else (0.0, 0.0, 0.5))
        for name, info, size in kind.parameters()
        if info.is_required()
    }
    others = kind.model_fields.keys() - values.keys() - dict(kind.lists()).keys()
    options = {name: kind.model_fields[name] for name in others if kind.model_fields[name].is_required()}
    # The number of waves that the cut-off requires.
    more = {"waves": (12, 12, 12)} if "waves" in kind.model_fields else {}
    # Either of two drives, and a grid that is solved in a moment.
    drive = {"speed": 0.5, "cells": (16, 16, 16)} if kind is PoreFlow else {}
    examples = {name: info.examples[0] for name, info in options.items() if info.examples}
    return {**values, **examples, **more, **drive}


def materials() -> dict[str, Any]:
    """Plain data of a material with all properties, for laws that use them."""
    return {"grain": {name: 0.3 for name, _, _ in Material.parameters()}}


def _kinds(contract: type[Stepper]) -> dict[str, type[Stepper]]:
    serialization.load(steppers)
    return {name: kind for name, kind in contract.known().items() if kind.__module__.startswith("tisim.")}


TOKENS = (
    "nan", "inf", "-inf", "1e400", "-1", "0", "9" * 5000, "0x" + "f" * 5000, "[" * 500 + "]" * 500,
    "[" * 5000, "{a=" * 400 + "1" + "}" * 400, "''", '""', '"""', "true", "[]", "{}", "[[]]", "[1, 'x']",
    "{a=1}", "{self=1}", "{kind=[]}", "1979-05-27", "07:32:00", '"\\ud800"', '"\\u0000"', "'sphere'", "'😀'",
    "1__0", "1e", "", "=", "'" + "x" * 100_000 + "'", "[0, 0, 0]", "[[0, 0, 0]]", "1e17", "1e-200", "3e296",
    "18446744073709551616",
)  # fmt: skip
LINES = (
    "self = 1", "kind = []", "[self]", "[effects.self]", "[[effects]]", "[effects]", "[[particles]]", "= 1",
    "a" + ".a" * 20_000 + " = 1", "[a" + ".a" * 5000 + "]", "\x00", "\udcff", '"" = 1', "'a b' = 1",
    "x" * 100_000,
)  # fmt: skip


def mutated_toml(random: Random) -> bytes:
    """The text of a valid scene file with one to three changed lines, and perhaps truncated."""
    lines = serialization.toml(random.choice(valid())).splitlines()
    for _ in range(random.choice((1, 1, 1, 2, 3))):
        at = random.randrange(len(lines))
        kind = random.randrange(8)
        if kind < 4:
            lines[at] = f"{lines[at].partition('=')[0]}= {random.choice(TOKENS)}"
        elif kind == 4:
            lines.insert(at, random.choice(LINES))
        elif kind == 5:
            lines.insert(at, random.choice(lines))
        elif kind == 6:
            lines[at] = lines[at].replace(random.choice("aeinx.[]=_"), random.choice("aeinx.[]=_\n\t\"'#"))
        elif len(lines) > 1:
            del lines[at]
    text = "\n".join(lines).encode(errors="surrogateescape")
    return text[: random.randrange(len(text) + 1)] if random.randrange(10) == 0 else text


def assignment(data: dict[str, Any], random: Random) -> str:
    """An argument of --set: a setting of a scene, or nearly one, and a hostile value."""
    path = [str(step) for step in random.choice(_places(data))]
    kind = random.randrange(8)
    if kind == 4:
        path[random.randrange(len(path))] = random.choice(TEXTS)
    elif kind == 5:
        path.append(random.choice(("a", "0", "self", "kind", "9" * 5000, "", ".".join("a" * 20_000))))
    elif kind == 6:
        del path[-1]
    return f"{'.'.join(path)}{'' if kind == 7 else '='}{random.choice(TOKENS)}"
