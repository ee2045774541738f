"""The tables and curves of a report on a run, as plain data."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from tisim.describe import docstrings
from tisim.describe.explained_parts import Part, explained, explained_materials
from tisim.engine.assembly import measured
from tisim.materials.materials import Materials
from tisim.plotting.style import WIDE
from tisim.plotting.time_series import TimeSeries
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene

MOST_POINTS = 2000
"""Largest number of points of a curve; of a longer series every second, third, ... is shown."""
SIGNIFICANT = 7
"""Significant digits of the points of curves."""
COMPONENTS = ("_x", "_y", "_z")
"""Ends of the names of measures that are components of one vector."""


@dataclass(frozen=True)
class Curves:
    """Quantities against time in one panel.

    unit : of all curves. logarithmic : whether the vertical axis is. curves : label and values of each, shape
        (frames,).
    """

    title: str
    unit: str
    curves: tuple[tuple[str, np.ndarray], ...]
    logarithmic: bool = False

    def facts(self, chosen: slice) -> dict[str, object]:
        """Return some of the points as plain data; a value that is not finite is None."""
        curves = [{"label": label, "values": digits(values[chosen])} for label, values in self.curves]
        return {"title": self.title, "unit": self.unit, "logarithmic": self.logarithmic, "curves": curves}


def digits(values: np.ndarray) -> list[float | None]:
    """Return numbers rounded to SIGNIFICANT digits, and None for those that are not finite."""
    return [
        float(f"{value:.{SIGNIFICANT}g}") if np.isfinite(value) else None
        for value in np.asarray(values, float).tolist()
    ]


def scene_parts(scene: Scene) -> Iterator[tuple[str, Part]]:
    """Yield the parts of a scene, each with its role: the particles, the domain, the stepper, the effects,
    and the materials with the properties of their contacts."""
    yield "particles", explained(scene.particles)
    yield "domain", explained(scene.domain)
    yield "stepper", explained(scene.stepper)
    for effect in scene.acting():
        for part in explained(effect).all():
            yield "effect", part
    for part in explained_materials(Materials(scene.materials, scene.material_pairs)):
        yield "material" if part.summary == "a material" else "contact", part


def publications(parts: Sequence[Part]) -> list[str]:
    """Return the full references of the works that the sources of parts cite in short form."""
    cited = " ".join(one.source for part in parts for one in part.all())
    return [f"{short}: {work}" for short, work in docstrings.PUBLICATIONS.items() if short in cited]


def balances(first: Arrays, last: Arrays) -> list[tuple[str, str, float, float]]:
    """Return the balances of a run: name, unit, and the values at the start and at the end."""
    rows: list[tuple[str, str, float, float]] = []

    def add(name: str, unit: str, values: Sequence[float]) -> None:
        rows.append((name, unit, float(values[0]), float(values[1])))

    states = (first, last)
    add("number of particles", "", [len(state["mass"]) for state in states])
    masses = [state["mass"].astype(float) for state in states]
    add("mass", "kg", [mass.sum() for mass in masses])
    if all("charge" in state for state in states):
        add("charge", "C", [state["charge"].astype(float).sum() for state in states])
    velocities = [state["velocity"].astype(float) for state in states]
    for k, axis in enumerate("xyz"):
        add(
            f"momentum along {axis}",
            "kg m/s",
            [mass @ v[:, k] for mass, v in zip(masses, velocities, strict=True)],
        )
    energies = [0.5 * mass @ (v**2).sum(axis=1) for mass, v in zip(masses, velocities, strict=True)]
    add("kinetic energy of translation", "J", energies)
    return rows


def time_series(
    series: TimeSeries, scene: Scene, measures: Mapping[str, np.ndarray], *, number: bool = False
) -> tuple[np.ndarray, list[dict[str, object]]]:
    """Return times (s) and panels of curves as plain data: the quantities of a ``TimeSeries``, and the
    measures of the effects.

    number : whether to return the number of particles even if it is constant.
    """
    chosen = slice(None, None, -(-len(series.time) // MOST_POINTS) or 1)
    panels = [*_standard(series, scene, number), *_measured(scene, measures)]
    return series.time[chosen], [panel.facts(chosen) for panel in panels]


def _standard(series: TimeSeries, scene: Scene, number: bool) -> Iterator[Curves]:
    flow = " relative to the flow" if scene.domain.shears() else ""
    energy = series.kinetic_energy
    positive = energy[energy > 0]
    wide = len(positive) > 0 and bool(positive.max() > WIDE * positive.min())
    yield Curves(f"kinetic energy{flow}", "J", (("", energy),), wide)
    jumps = any(scene.domain.joined())
    vector = series.drift if jumps else series.shift
    title = "velocity of the centre of gravity" if jumps else "displacement of the centre of gravity"
    curves = tuple((axis, vector[:, k]) for k, axis in enumerate("xyz"))
    yield Curves(f"{title}{flow}", "m/s" if jumps else "m", curves)
    if number or np.ptp(series.number):
        yield Curves("number of particles", "", (("", series.number.astype(float)),))


def _measured(scene: Scene, measures: Mapping[str, np.ndarray]) -> Iterator[Curves]:
    """Yield the measures, three components in one panel."""
    unit_of, done = measured(scene.effects), set[str]()
    for name in measures:
        stem = name[:-2]
        if name in done:
            continue
        if name.endswith(COMPONENTS) and all(f"{stem}{end}" in measures for end in COMPONENTS):
            done |= {f"{stem}{end}" for end in COMPONENTS}
            curves = tuple((end[1:], measures[f"{stem}{end}"]) for end in COMPONENTS)
            yield Curves(stem.replace("_", " "), unit_of.get(name, ""), curves)
        else:
            yield Curves(name.replace("_", " "), unit_of.get(name, ""), (("", measures[name]),))
