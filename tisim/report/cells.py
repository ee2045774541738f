"""Scenes, results and trajectories as HTML in the output of a cell of a notebook."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from typing import TYPE_CHECKING, cast

import numpy as np

from tisim.describe.explained_parts import Part
from tisim.engine.assembly import measured
from tisim.engine.result import Result
from tisim.errors import InputError, RunError
from tisim.files import pictures
from tisim.io.reader import Frames, RecordedTrajectory, RecordedWorld
from tisim.notebook import CELL_DOTS_PER_INCH, card, card_picture, card_table
from tisim.plotting.style import si, superscripts
from tisim.report import tables
from tisim.scene.scene import Scene

if TYPE_CHECKING:
    from matplotlib.figure import Figure

MOST_DRAWN = 20_000
"""Largest number of particles of which a cell has a picture."""
LONGEST_SETTINGS = 150
"""Number of characters of the settings of a part that are shown."""
MOST_MEASURES = 12
"""Largest number of rows of measures in a cell."""
ROLES = ("domain", "stepper", "effect", "material", "contact")
"""Parts of a scene in a cell, in order; the particles are described by their numbers."""


def scene_cell(scene: Scene) -> str:
    """Return a scene as HTML: its parts with their settings and units, and a picture of the start."""
    rows = [("particles", "", _particles(scene))]
    parts = sorted(
        (part for part in tables.scene_parts(scene) if part[0] in ROLES),
        key=lambda one: ROLES.index(one[0]),
    )
    rows += [(role, part.name, _settings(part)) for role, part in parts]
    rows.append(("", "accuracy, seed", f"{scene.accuracy:g}, {scene.seed}"))
    html = [card_table(("", "part", "settings"), rows)]
    notes = list[str]()
    if scene.capacity() <= MOST_DRAWN:
        html += _drawn(lambda: _start(scene), "the particles at the start", notes)
    else:
        notes.append(f"The picture is left out, because there may be more than {MOST_DRAWN:,} particles.")
    return card(scene.name, f"scene of {si(scene.duration, 's')}", html, notes)


def result_cell(result: Result) -> str:
    """Return a result as HTML: its status, counts, balances and measures, with pictures of start and end."""
    status, scene = result.status, result.scene
    state, units = result.state, measured(scene.effects)
    rows = [
        ("time", f"{si(result.time, 's')} of {si(scene.duration, 's')}"),
        ("particles", _change(len(result.start["mass"]), len(state["mass"]))),
    ]
    kept = ("mass", "charge", "kinetic energy of translation")
    for name, unit, start, end in tables.balances(result.start, state):
        if name in kept:
            rows.append((name, f"{_change(start, end)} {unit}"))
    rows += [(name.replace("_", " "), f"{number:,}") for name, number in result.work.items() if number]
    rows += [
        (name.replace("_", " "), superscripts(f"{value:.6g} {units.get(name, '')}".rstrip()))
        for name, value in list(result.measures.items())[:MOST_MEASURES]
    ]
    rows.append(("wall time", f"{result.wall_s:.3g} s, {_where(result)}"))
    html, notes = [card_table(("", ""), rows)], list[str]()
    if len(result.measures) > MOST_MEASURES:
        notes.append(f"{len(result.measures) - MOST_MEASURES} more measures are in result.measures.")
    if max(len(result.start["mass"]), len(state["mass"])) <= MOST_DRAWN:
        html += _drawn(lambda: _clouds(result), "the particles at the start and at the end", notes)
    notes.append("result.view() shows the particles in three dimensions.")
    ended = "ok" if status.ok else f"failed {status.reason}" if status.failed else status.reason
    return card(scene.name, f"result: {ended}", html, notes)


def trajectory_cell(world: RecordedWorld) -> str | None:
    """Return a trajectory as HTML: its frames and curves of its time series."""
    if isinstance(world, RecordedTrajectory) and len(world.worlds) > 1:
        raise InputError("trajectory must be of one world")
    times, notes = world.times, list[str]()
    span = f", t = {si(times[0], 's')} to {si(times[-1], 's')}" if len(times) else ""
    html = _drawn(lambda: _curves(world), "time series", notes) if len(times) > 1 else []
    notes.append("trajectory.view() plays it in three dimensions, and to_frame() returns its time series.")
    return card(world.scene.name, f"trajectory: {len(times)} frames{span}", html, notes)


def _particles(scene: Scene) -> str:
    arrays = scene.particles.unplaced(scene.seed)
    n, radius = len(arrays["mass"]), arrays.get("radius")
    size = ""
    if radius is not None and n:
        low, high = float(np.min(radius)), float(np.max(radius))
        size = f", radius {si(low, 'm')}" + (f" to {si(high, 'm')}" if high > low else "")
    inserted = f", up to {scene.capacity():,} later" if scene.capacity() > n else ""
    return f"{n:,}{size}{inserted}"


def _settings(part: Part) -> str:
    """Return the settings of a part and its nested parts that do not leave something out."""
    texts = [
        superscripts(f"{name} {value} {unit}".rstrip())
        for one in part.all()
        for name, value, unit, _ in one.parameters
        if name not in one.off
    ]
    text = ", ".join(texts)
    return text if len(text) <= LONGEST_SETTINGS else f"{text[: LONGEST_SETTINGS - 4]} ..."


def _change(start: float, end: float) -> str:
    first, last = (f"{value:,}" if isinstance(value, int) else f"{value:.6g}" for value in (start, end))
    return first if first == last else f"{first} \N{RIGHTWARDS ARROW} {last}"


def _where(result: Result) -> str:
    names = ("device", "precision", "arithmetic")
    return ", ".join(result.settings[name] for name in names if name in result.settings)


def _drawn(draw: Callable[[], Figure], text: str, notes: list[str]) -> Iterator[str]:
    """Yield a picture as HTML; if it cannot be drawn, add the reason to the notes."""
    try:
        with pictures.drawing(text):
            yield card_picture(pictures.image(draw(), dpi=CELL_DOTS_PER_INCH), text)
    except (InputError, RunError) as failure:
        notes.append(f"{failure}.")


def _start(scene: Scene) -> Figure:
    # Matplotlib takes a third of a second to import.
    from tisim.plotting.bodies import shapes_of
    from tisim.plotting.cloud import directions, gravity, panel
    from tisim.plotting.colours import colouring
    from tisim.plotting.scenery import scenery, window
    from tisim.plotting.style import empty

    state = scene.start()
    figure, around = empty(4.6, 4.6, pad=0.05), scenery(scene, [state], 0.0)
    axis, part = figure.subplots(), window([state], [around])
    # Other quantities, such as the temperature, are mostly equal at the start.
    colours = colouring(scene, (state,), "material") if len(scene.materials) > 1 else None
    panel(axis, state, part, around, None if colours is None else colours.of(state), shapes_of(scene))
    directions(axis, part, gravity(scene))
    if colours is not None:
        colours.legend(figure, np.array([axis]))
    return figure


def _clouds(result: Result) -> Figure:
    from tisim.plotting.cloud import cloud

    return cloud(result)


def _curves(world: RecordedWorld) -> Figure:
    from tisim.plotting.time_series import quantities

    # The function asks for a scene, times and frames alone.
    return quantities(cast(Frames, world))
