"""Checks of initial states, and their layout in the memory of a batch."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from tisim.backend import runtime
from tisim.components.ranges import WHOLE
from tisim.effects.base import Constraint, PairEvent, Pairwise
from tisim.errors import InputError, Words, must
from tisim.operators.base import AddsParticles, adding, largest_inserted
from tisim.pairs.pair_chunks import PairChunks
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.state.fields import CORE, SHARED, Field
from tisim.state.status import NO_ONE, WorldStatus

ROUNDED_SIDE = 1e-6
"""A law may exceed half a side of the box by this fraction, to allow for rounding in single precision."""
LEAST_ERRORS = {"f32": 1e-6, "f64": 2e-15}
"""The least relative errors that may be requested of a stepper: about eight times the rounding of positions.
"""


def check_start(fields: Sequence[Field], scene: Scene, start: Arrays) -> None:
    """Raise InputError unless an initial state has the fields that the scene needs and no others, of the
    right shape, with positions in the domain.

    A quantity that effects share, such as temperature, is accepted even if the scene does not use it.
    """
    low, high = scene.domain.bounds()
    if low is not None:
        inside = (start["position"] >= low) & (start["position"] < high) | ~np.array(scene.domain.joined())
        must(bool(inside.all()), "particles.position", "inside the domain", Words("a particle outside"))
        check_sides(scene, start)
    field_names = {f.name for f in fields} | SHARED.keys()
    for name in start:
        must(
            name in field_names,
            f"particles.{name}",
            f"a field of the scene ({', '.join(sorted(field_names))})",
            name,
        )
    n = len(start["mass"])
    missing = [f.name for f in fields if f.default is None and f.name not in start and n]
    if missing:
        names = ", ".join(sorted(missing))
        raise InputError(f"particles must be given {names}, which effects of the scene need; received none")
    if "fixed" in start and start["fixed"].shape == (n,):
        rest = not np.any(start["velocity"][start["fixed"] != 0])
        must(rest, "particles.velocity", "0 for fixed particles", Words("one that moves"))
    for f in {**SHARED, **{f.name: f for f in fields}}.values():
        if f.name in start:
            check_field(f, start[f.name], n)
    if n:
        hard = any(isinstance(effect, PairEvent) and effect.hard for effect in scene.effects)
        scene.stepper.control.check_start(start, hard, scene.stepper.independent(scene.effects))
    check_held(scene, start)
    check_rounding(scene)
    for effect in scene.acting():
        effect.check_start(start, scene)
    with np.errstate(over="ignore", invalid="ignore"):
        momentum = np.abs(start["mass"][:, None] * start["velocity"]).sum(axis=0).max()
    must(
        bool(np.isfinite(momentum)),
        "particles.velocity",
        "small enough for the total momentum to be a finite number",
        float(momentum),
    )
    # If rounding is coarser than a radius, contacts cannot be found.
    farthest = np.abs(start["position"]).max(axis=1)
    coarse = np.spacing(farthest.astype(_real())) > start["radius"]
    worst = float(farthest[coarse][0]) if coarse.any() else 0.0
    rule = f"so near the origin that {runtime.current().precision} rounds it by less than a radius"
    must(not coarse.any(), "particles.position", rule, worst)


def check_held(scene: Scene, start: Arrays) -> None:
    """Raise InputError if two constraints hold the same particle, or if a constraint holds an inserted
    particle."""
    constraints = [effect for effect in scene.effects if isinstance(effect, Constraint)]
    by = np.zeros(len(start["mass"]), int)
    for constraint in constraints:
        # All held particles may be inserted later.
        later = any(effect.gives(constraint) for effect in scene.effects)
        if constraint.mark in start or not later:
            held = constraint.held(start, scene.domain)
            rule = f"{constraint.marks()} for some particles, as effects.{constraint.label} holds those"
            must(later or bool(held.any()), f"particles.{constraint.mark}", rule, Words("none of it"))
            by += held
        rule = f"held by one of {', '.join(one.label for one in constraints)}"
        must(bool((by <= 1).all()), "particles", rule, Words(f"one held by {by.max(initial=0)}"))
        for effect in adding(scene.effects):
            where = f"quantities of grains of effects.{effect.label}"
            rule = f"without {constraint.mark}, as effects.{constraint.label} does not hold inserted grains"
            must(constraint.mark not in (effect.inserted_quantities() or ()), where, rule, constraint.mark)


def check_inserted(fields: Sequence[Field], effect: AddsParticles) -> None:
    """Raise InputError unless the particles that an effect inserts have the fields that the scene needs and
    no others, with the shape and range required of an initial state."""
    given = effect.inserted_quantities()
    if given is None:
        return
    core, where = {f.name for f in CORE}, f"quantities of grains of effects.{effect.label}"
    known = {f.name: f for f in fields if f.name not in core}
    for name in given:
        must(name in {*known, *SHARED}, where, f"fields of the scene ({', '.join(sorted(known))})", name)
    missing = sorted(name for name, f in known.items() if f.default is None and name not in given)
    must(not missing, where, f"given {', '.join(missing)}, which effects of the scene need", sorted(given))
    for name, values in given.items():
        for k in range(len(values)):
            of_class = f"effects.{effect.label}.grains.{k}.quantities"
            check_field({**SHARED, **known}[name], values[k : k + 1], 1, of_class)


def radii(scene: Scene, start: Arrays) -> np.ndarray:
    """Return the radii (m) of an initial state, then those of the largest insertable particles."""
    return np.concatenate([start["radius"], largest_inserted(scene.acting())["radius"]])


def check_sides(scene: Scene, start: Arrays) -> None:
    """Raise InputError if a particle could touch another one and its periodic image at once; only the nearest
    image is considered."""
    low, high = scene.domain.bounds()
    near = any(
        isinstance(effect, PairEvent) or (isinstance(effect, Pairwise) and effect.short_ranged)
        for effect in scene.effects
    )
    radius = radii(scene, start)
    if low is None or high is None or not near or len(radius) < 2:
        return
    reach = 2 * float(np.partition(radius, -2)[-2:].sum())
    narrow = np.array(scene.domain.imaged()) & (high - low < reach)
    rule = f"at least {reach:g} m wide where it is periodic, twice the distance of its largest touching pair"
    must(not narrow.any(), scene.domain.label, rule, (high - low).tolist())


def check_reach(scenes: Sequence[Scene], starts: Sequence[Arrays], pairs: PairChunks | None) -> None:
    """Raise InputError if the range of a law exceeds half a side of a periodic box.

    Each particle interacts with the nearest image of another one only; beyond half a side the force of the
    next image would be missing.

    pairs : the pair lists at the initial state. The larger particle of a pair determines the range of the
    laws beyond the surface of the smaller one.
    """
    if pairs is None or not pairs.half_list.laws or not any(scenes[0].domain.imaged()):
        return
    laws = ", ".join(law.data.label for law in pairs.half_list.laws)
    known = [radii(scene, start) for scene, start in zip(scenes, starts, strict=True)]
    later = [radius[len(start["radius"]) :] for radius, start in zip(known, starts, strict=True)]
    search_radii = pairs.half_list.search_radii(later)
    for scene, radius, search_radius in zip(scenes, known, search_radii, strict=True):
        low, high = scene.domain.bounds()
        if low is None or high is None or len(radius) < 2:
            continue
        order = np.argsort(radius, kind="stable")
        reach = float((search_radius[order[1:]] + radius[order[:-1]]).max())
        narrow = np.array(scene.domain.imaged()) & (0.5 * (high - low) * (1 + ROUNDED_SIDE) < reach)
        rule = f"at least {2 * reach:g} m wide where it is periodic, twice the range over which {laws} acts"
        must(not narrow.any(), scene.domain.label, rule, (high - low).tolist())


def check_rounding(scene: Scene) -> None:
    """Raise InputError if the stepper is asked for errors below the rounding of the precision in use."""
    precision = runtime.current().precision
    for name, error in scene.stepper.control.asked().items():
        where, received, least = f"stepper.control.{name}", error, LEAST_ERRORS[precision]
        if "stepper" not in scene.model_fields_set:
            # The stepper was chosen automatically, with errors in proportion to the accuracy of the scene.
            where, received, least = "scene.accuracy", scene.accuracy, scene.accuracy / error * least
        rule = f"at least {least:.3g} in {precision}, which rounds positions by {np.finfo(_real()).eps:.1e}"
        must(error > 0.999 * LEAST_ERRORS[precision], where, rule, received)


def check_field(f: Field, values: np.ndarray, n: int, where: str = "particles") -> None:
    """Raise InputError unless the values of n particles have the shape and the range of a field.

    where : the path of the values in error messages.
    """
    label = f"{where}.{f.name}"
    must(values.shape == f.shape(n), label, f"of shape {f.shape(n)}", values.shape)
    if f.integer:
        whole = (values == np.rint(values)) & (np.abs(values) < WHOLE)
        worst = float(values[~whole][0]) if not whole.all() else 0
        must(bool(whole.all()), label, "whole numbers", worst)
    rounded: np.ndarray
    with np.errstate(over="ignore"):
        rounded = values.astype(_real())
    unrepresentable, least = ~np.isfinite(rounded), float(np.finfo(_real()).tiny)
    if f.name == "mass":
        # Kernels flush smaller numbers to zero, and mass 0 marks a removed particle.
        unrepresentable |= rounded < least
    if f.name == "radius":
        # Volumes are the cube of the radius.
        unrepresentable |= (rounded < least ** (1 / 3)) | (rounded > float(np.finfo(_real()).max) ** (1 / 3))
    if unrepresentable.any():
        rule = f"within the range of {runtime.current().precision}"
        must(False, label, rule, float(values[unrepresentable][0]))
    if f.minimum is not None:
        least = float(values.min()) if values.size else np.inf
        must(least >= f.minimum, label, f"at least {f.minimum:g} {f.unit}", least)


def _real() -> type:
    return np.float64 if runtime.current().precision == "f64" else np.float32


def laid_out(f: Field, starts: Sequence[Arrays], worlds: int, capacity: int) -> np.ndarray:
    """Return a field of all worlds: the values of each initial state or the default; ids count from 0."""
    copied, number = (f.default, 0) if isinstance(f.default, str) else (None, f.default or 0)
    kind = np.int32 if f.integer else np.float64 if f.double else _real()
    column: np.ndarray = np.full(f.shape(worlds, capacity), number, dtype=kind)
    for w, start in enumerate(starts):
        n = len(start["mass"])
        default = start[copied] if copied else column[w, :n]
        column[w, :n] = np.arange(n) if f.name == "id" else start.get(f.name, default)
    return column


def world_columns(scenes: Sequence[Scene], starts: Sequence[Arrays], worlds: int) -> dict[str, Any]:
    """Return the initial values of world fields that are not 0, by name; worlds without a scene have
    ended."""
    empty = worlds - len(scenes)
    counts = np.array([len(start["mass"]) for start in starts] + [0] * empty)
    frames = [
        np.average(start["velocity"], axis=0, weights=start["mass"]) if len(start["mass"]) else np.zeros(3)
        for start in starts
    ]
    volumes = [volume(scene, start) for scene, start in zip(scenes, starts, strict=True)]
    return {
        "frame": np.array(frames + [np.zeros(3)] * empty),
        "seed": np.array([scene.seed for scene in scenes] + [0] * empty),
        "skin": np.array([scene.skin or 0.0 for scene in scenes] + [0.0] * empty),
        "count": counts,
        "next_id": counts,
        "most": np.array([scene.capacity() for scene in scenes] + [0] * empty),
        "status": np.array([WorldStatus.RUNNING] * len(scenes) + [WorldStatus.ENDED] * empty),
        "end": np.array([scene.duration for scene in scenes] + [0.0] * empty),
        "volume": np.array(volumes + [1.0] * empty),
        "approach_time": np.inf,
        "failing_particle": NO_ONE,
        "failing_effect": NO_ONE,
        "ending_effect": NO_ONE,
    }


def volume(scene: Scene, start: Arrays) -> float:
    """Return the volume (m^3) of the domain.

    Along axes without joined faces the extent is the extent of the particles. A scene without particles uses
    one of the largest particles that may be inserted.
    """
    place, radius = start["position"], start["radius"]
    if not len(place):
        place, later = np.zeros((1, 3)), radii(scene, start)
        radius = later if len(later) else np.ones(1)
    reach = radius.max()
    extent = (place.max(axis=0) + reach) - (place.min(axis=0) - reach)
    low, high = scene.domain.bounds()
    if low is not None and high is not None:
        extent = np.where(scene.domain.joined(), high - low, extent)
    return float(np.prod(extent))
