"""A scene: the description of a simulation as plain validated data. TOML in and out; no Taichi."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any, ClassVar, Self

from pydantic import ValidationInfo, field_validator, model_validator

from tisim.components import serialization
from tisim.components.component import Component, Text, option, parameter
from tisim.components.serialization import json_pieces
from tisim.domains.domain import Box, Domain, Open
from tisim.domains.sheared_box import ShearedBox
from tisim.effects.base import Effect
from tisim.errors import InputError, Words, abbreviated, did_you_mean, must
from tisim.files import python_file
from tisim.materials.material_law import UsesMaterials
from tisim.materials.materials import Material, MaterialPair, Materials
from tisim.notebook import ShownInNotebook
from tisim.operators.base import adding
from tisim.scene import plain_data, plugins
from tisim.scene.initial_state import Arrays, Start
from tisim.sources.base import Source
from tisim.state.fields import names_of
from tisim.steppers.base import Stepper
from tisim.steppers.choice import ACCURACY, StepperChoice, choose, critical_steps

PHYSICS_VERSION = 12
"""Version of the physics, part of a scene's digest; raised whenever a change of code changes the result of a
scene."""

__all__ = ["Box", "Open", "Scene", "ShearedBox"]


class Scene(Component, ShownInNotebook):
    """A scene describes a simulation: particles, the effects that act on them, and the duration.

    Only the effects in a scene are compiled and allocated. A scene is made in Python or read from a TOML
    file; InputError ("X must be Y; received Z") is raised if it cannot be run.
    """

    shown_by: ClassVar[str] = "tisim.report.cells:scene_cell"

    name: Text = option("descriptive name of the scene", "scene")
    particles: Start = option("initial state, such as Particles or Cloud")
    materials: Mapping[Text, Material] = option(
        "materials by name, used by contact laws", default_factory=dict
    )
    material_pairs: Mapping[Text, MaterialPair] = option(
        "parameters of pairs of materials that no rule derives from the single materials, by both names, "
        "such as steel-rubber",
        default_factory=dict,
    )
    effects: tuple[Effect, ...] = option("effects, sources and operators, which act in this order", ())
    domain: Domain = option("space in which the particles move, such as Open or Box", Open())
    stepper: Stepper = option(
        "time integration, with tolerances and limits; chosen for the accuracy unless given",
        None,
    )
    accuracy: float = parameter(
        "",
        "relative accuracy for which a stepper is chosen: error of final positions over the size of the "
        "motion; with contacts, error of the energy and the rebound of each",
        ACCURACY,
        gt=0,
        lt=1,
    )
    duration: float = parameter("s", "simulated time", gt=0)
    skin: float | None = parameter(
        "m",
        "skin distance of the neighbour lists, which are rebuilt when particles have moved by half of it; "
        "chosen automatically by cost unless given; does not affect results",
        None,
        gt=0,
    )
    seed: int = option("seed of all random numbers of the scene", 0, ge=0, lt=2**63)

    @field_validator("stepper", "domain", mode="before")
    @classmethod
    def _made(cls, value: Any, info: ValidationInfo) -> Any:
        rule = f"a {info.field_name}, not its table (Scene.from_dict and replace read tables)"
        must(not isinstance(value, Mapping), f"scene.{info.field_name}", rule, value)
        return value

    @field_validator("effects", mode="before")
    @classmethod
    def _listed(cls, value: Any) -> Any:
        must(not isinstance(value, Effect), "scene.effects", "a list or tuple of effects", value)
        return tuple(value) if isinstance(value, Sequence) and not isinstance(value, str) else value

    @model_validator(mode="after")
    def _complete(self) -> Self:
        self._check_effects()
        self._check_materials()
        for effect in self.effects:
            effect.check(self)
        rule = "at least one, or inserted by an effect such as insertion_by_flux"
        must(self.capacity() > 0, "particles", rule, Words("none"))
        if "stepper" in self.model_fields_set:
            rule = "left out if a stepper is given, which has its own settings"
            must(self.accuracy == ACCURACY, "scene.accuracy", rule, self.accuracy)
        else:
            # Not set as a field, so that ``replace`` chooses again.
            self.__dict__["stepper"] = self.choice().stepper
        self._check_stepper()
        return self

    def _check_effects(self) -> None:
        """Raise InputError unless the effects fit together: no duplicates, all required effects present, no
        excluded ones, and in the required order."""
        present = [type(effect) for effect in self.effects]
        labels = [effect.label for effect in self.effects]
        for effect, kind, label in zip(self.effects, present, labels, strict=True):
            must(labels.count(label) == 1, f"effects.{label}", "given only once", labels.count(label))
            repeatable = kind.repeatable and not names_of(kind.world_fields, "measure")
            allowed = repeatable or present.count(kind) == 1
            must(allowed, f"effects of kind {kind.kind()}", "at most one in a scene", present.count(kind))
            for required_kinds in effect.required_effects():
                must(
                    any(issubclass(other, required_kinds) for other in present),
                    f"effects.{label}",
                    f"used together with {' or '.join(_names(required_kinds))}",
                    ", ".join(labels),
                )
            for other, other_label in zip(present, labels, strict=True):
                apart = not issubclass(other, kind.excludes)
                must(apart, f"effects.{label}", f"used without {other.kind()}", other_label)
                late = issubclass(other, kind.precedes) and labels.index(other_label) < labels.index(label)
                must(not late, f"effects.{label}", f"listed before effects.{other_label}", ", ".join(labels))
            quantities = {other.quantity for other in present if issubclass(other, Source)}
            must(
                not kind.requires_source or not quantities.isdisjoint(kind.requires_source),
                f"effects.{label}",
                f"used together with a source of {' or '.join(kind.requires_source)}",
                ", ".join(labels),
            )

    def _check_stepper(self) -> None:
        """Raise InputError unless the stepper can step the effects in the domain."""
        for effect in self.effects:
            must(
                self.stepper.control.kind() not in effect.incompatible_controls,
                "stepper.control",
                f"one that suits {effect.label}, such as fixed_step or the control of an implicit stepper",
                self.stepper.control.kind(),
            )
        self.stepper.check(self)
        self.stepper.resolves(self.effects, lambda: self._unplaced()[2])
        self.stepper.min_steps(self.effects, self.duration)

    def _check_materials(self) -> None:
        """Raise InputError unless the materials have the properties that effects need, and all names are
        known."""
        materials = Materials(self.materials, self.material_pairs)
        self.particles.material_indices(materials, self.seed)
        for part in (part for effect in self.effects for part in effect.parts()):
            if isinstance(part, UsesMaterials):
                part.check_materials(materials)

    def __repr__(self) -> str:
        effects = ", ".join(type(effect).__name__ for effect in self.effects) or "no effects"
        n, stepper = len(self.particles.masses(self.seed)), type(self.stepper).__name__
        return f"Scene({self.name!r}: {n} particles, {effects}, {stepper}, {self.duration:.6g} s)"

    def __str__(self) -> str:
        return repr(self)

    def choice(self) -> StepperChoice:
        """Return the stepper chosen for the effects, the initial state and the accuracy, with the reason;
        raise InputError if none can be chosen."""
        return choose(*self._unplaced(), self.duration, self.accuracy)

    def critical_steps(self) -> dict[str, float]:
        """Return the critical time steps (s), 2/omega of the stiffest motion that an effect causes, by the
        label of the effect, the shortest first; only for effects that have a known one."""
        return critical_steps(*self._unplaced(), self.duration)

    def _unplaced(self) -> tuple[list[Effect], Domain, Arrays]:
        """Return the effects bound to their materials, the domain, and the initial state without places."""
        materials = Materials(self.materials, self.material_pairs)
        start = self.particles.unplaced(self.seed)
        indices = self.particles.material_indices(materials, self.seed)
        if indices is not None:
            start = {**start, "material": indices[: len(start["mass"])]}
        return [_of(effect, materials) for effect in self.effects], self.domain, start

    def structure(self) -> tuple[Any, ...]:
        """Return the compiled-in part of the scene; scenes in which it is equal can run as one batch."""
        parts = (*self._roomy(self.effects), self.domain, self.stepper)
        return *(part.structure() for part in parts), tuple(self.materials)

    def rooms(self) -> dict[str, dict[str, int]]:
        """Return, for each effect by its label, the number of rows for which each of its lists has memory, by
        name."""
        return {effect.label: effect.room() for effect in self._roomy(self.effects)}

    def room_size(self) -> int:
        return sum(effect.room_size() for effect in self._roomy(self.effects))

    def with_rooms(self, rows: Mapping[str, Mapping[str, int]]) -> Self:
        """Return a copy whose effects have memory for at least these rows of their lists, by label and
        name."""
        made = self.model_copy()
        made.__dict__["_rooms"] = {label: dict(lists) for label, lists in rows.items()}
        return made

    def _roomy(self, effects: Sequence[Effect]) -> tuple[Effect, ...]:
        """Return the effects with the memory of the scene for their lists."""
        rooms: Mapping[str, Mapping[str, int]] = self.__dict__.get("_rooms", {})
        return tuple(one.with_room(rooms[one.label]) if one.label in rooms else one for one in effects)

    def acting(self) -> tuple[Effect, ...]:
        """Return the effects, completed by data of the initial state, the materials and each other."""
        masses, materials = self.particles.masses(self.seed), Materials(self.materials, self.material_pairs)
        return self._roomy(
            [_of(effect, materials).at_start(masses).completed_by(self.effects) for effect in self.effects]
        )

    def start(self, seed: int | None = None) -> Arrays:
        """Return the initial quantities of the particles by name, for another seed if given."""
        seed = self.seed if seed is None else seed
        arrays = self.particles.arrays(self.domain, seed)
        for effect in self.effects:
            arrays |= effect.given_at_start(arrays, seed)
        indices = self.particles.material_indices(Materials(self.materials, self.material_pairs), seed)
        return arrays if indices is None else {**arrays, "material": indices}

    def capacity(self) -> int:
        """Return the largest number of particles that may exist at once."""
        masses = self.particles.masses(self.seed)
        n = len(masses)
        return n + sum(effect.capacity(masses) - n for effect in adding(self.effects))

    def digest(self) -> str:
        """Return a hash, in hex, of everything that determines the result: physics version, all parameters
        that affect it, the seed, and the files that define parts of the scene outside tisim."""
        order = [effect.label for effect in self.effects]
        files = python_file.module_checksums(*dict.fromkeys(map(type, self.parts())))
        digest = hashlib.sha256(f"{json.dumps([PHYSICS_VERSION, order])[:-1]}, ".encode())
        data = self._table(serialization.to_dict(self.particles, arrays=True))
        for name in ("skin", "accuracy"):
            data.pop(name, None)
        data["stepper"] = serialization.to_dict(self.stepper)
        for piece in json_pieces(data):
            digest.update(piece.encode())
        digest.update((f", {json.dumps(files, sort_keys=True)}]" if files else "]").encode())
        return digest.hexdigest()

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, as in a TOML file; ``from_dict`` is the inverse."""
        return self._table(serialization.to_dict(self.particles))

    def _table(self, particles: dict[str, Any]) -> dict[str, Any]:
        """Return plain data, given the plain data of the particles."""
        stepper: dict[str, Any] = {"accuracy": self.accuracy}
        if "stepper" in self.model_fields_set:
            stepper = {"stepper": serialization.to_dict(self.stepper)}
        return {
            "name": self.name,
            "duration": self.duration,
            **({} if self.skin is None else {"skin": self.skin}),
            "seed": self.seed,
            "particles": particles,
            **plain_data.tables("materials", self.materials),
            **plain_data.tables("material_pairs", self.material_pairs),
            "domain": serialization.to_dict(self.domain),
            **stepper,
            "effects": {effect.label: plain_data.effect_table(effect) for effect in self.effects},
        }

    @classmethod
    def from_dict(cls, data: Mapping[str, Any], folder: str | Path = "") -> Scene:
        """Make a scene from plain data; InputError names the key that is wrong.

        folder : folder to which file names in the data are relative; the working directory unless given.
        """
        return cls(**plain_data.scene_fields(data, Path(folder)))

    @classmethod
    def from_toml(cls, path: str | Path) -> Scene:
        """Read a scene from a TOML file, and further files named in it relative to its folder; raise
        InputError if it is not a scene."""
        file, label = Path(path), "scene file"
        text = None
        try:
            # A folder cannot be read, and a pipe may never end.
            if file.is_file() or not file.exists():
                text = file.read_text(encoding="utf-8")
        except FileNotFoundError:
            raise InputError(f"{label} must exist; received {abbreviated(str(path))}") from None
        except OSError as error:
            received = f"{abbreviated(str(path))} ({error.strerror})"
            raise InputError(f"{label} must be readable; received {received}") from None
        except ValueError as fault:
            # Bytes that are not text, or a name with a NUL.
            raise InputError(f"{label} must be TOML; received {abbreviated(str(path))} ({fault})") from None
        if text is None:
            raise InputError(f"{label} must be a file; received {abbreviated(str(path))}")
        return cls.from_dict(serialization.read_toml(text, label, str(path)), file.parent)

    def to_toml(self) -> str:
        """Return the scene as TOML text, which ``from_toml`` reads."""
        return serialization.toml(self.to_dict())

    def replace(self, settings: Mapping[str, Any]) -> Scene:
        """Return a copy with dotted keys changed, such as ``{"effects.impact.hardness": 3e5}``; rows of a
        list are numbered from 0: ``"effects.magnetic_cylinders.cylinders.0.radius"``."""
        if not settings:
            return self
        data = self.to_dict()
        for key, value in settings.items():
            plain_data.change(data, key, value)
        return type(self).from_dict(data)

    def without(self, *names: str) -> Scene:
        """Return a copy without some effects; raise InputError if one is absent, or needed by others."""
        if not names:
            return self
        data = self.to_dict()
        for name in names:
            if name not in data["effects"]:
                present = ", ".join(data["effects"]) or "none, as this scene has none"
                received = f"{abbreviated(name)}{did_you_mean(name, data['effects'])}"
                raise InputError(f"effect to leave out must be one of {present}; received {received}")
        others = {kind: values for kind, values in data["effects"].items() if kind not in names}
        return type(self).from_dict({**data, "effects": others})


def _of(effect: Effect, materials: Materials) -> Effect:
    """Return an effect bound to the materials, if it uses them."""
    return effect.with_materials(materials) if isinstance(effect, UsesMaterials) else effect


def _names(kind: type[Component]) -> list[str]:
    """Return the name of an effect in files, or for a contract the names of the effects that implement it."""
    if not kind.__dict__.get("contract"):
        return [f"effects.{kind.kind()}"]
    # Includes those that are imported on first use.
    plugins.load_parts()
    return [f"effects.{name}" for name in sorted(kind.known())] or [kind.kind()]
