"""Plots of pair forces against the distance of two grains, for the pages of the reference.

The forces are those of a run: the effects of the law's snippet (snippets.py), with a world for each distance.
The plots are kept in docs/pair_forces, and drawn again if the law, its snippet or the plot changes:

    python docs/pair_plots.py
"""

from __future__ import annotations

import hashlib
import inspect
import warnings
from pathlib import Path

import matplotlib as mpl
import numpy as np
import snippets
from matplotlib.figure import Figure

import tisim
from tisim.describe import reference
from tisim.steppers import FixedStep, Verlet

RADIUS, DENSITY = 1e-3, 2500.0
"""Radius (m) and density (kg/m^3) of the grains, as in the snippets."""
RANGES = {
    "contact": (0.97, 1.01),
    "dipole_dipole": (1.0, 3.0),
    "granular": (0.97, 1.01),
    "hertz": (0.97, 1.01),
    "mie": (0.98, 1.6),
    "morse": (0.97, 1.4),
    "near_field": (0.2, 2.0),
    "self_gravity": (1.0, 4.0),
    "softened_self_gravity": (0.0, 0.4),
    "truncated_dipole_dipole": (1.0, 3.0),
    "truncated_near_field": (0.2, 2.2),
}
"""The distances of a plot, relative to the sum of the radii, of each law that depends on the distance alone.
Forces that also depend on velocities or on the past, such as those of bonds and liquid bridges, have none."""
POINTS = 120


FOLDER = Path(__file__).parent / "pair_forces"


def outdated(folder: Path = FOLDER) -> list[str]:
    """Return the laws without a plot, NAME.svg, of the present version."""
    versions = {name: _version(name) for name in RANGES}
    texts = {path.stem: path.read_text(encoding="utf-8") for path in folder.glob("*.svg")}
    return [name for name, version in versions.items() if version not in texts.get(name, "")]


def write(folder: Path = FOLDER) -> None:
    """Write the plots that are outdated."""
    folder.mkdir(exist_ok=True)
    for name in outdated(folder):
        _draw(name, folder / f"{name}.svg", _version(name))


def force(name: str) -> tuple[np.ndarray, np.ndarray]:
    """Return distances of two grains (m), and the force on one towards the other by each of them (N)."""
    distances = 2 * RADIUS * np.linspace(*RANGES[name], POINTS)
    with warnings.catch_warnings():
        # Grains overlap at the start.
        warnings.simplefilter("ignore")
        results = tisim.run([_scene(name, distance) for distance in distances])
    return distances, np.array([result.state["force"][0, 2] for result in results])


def _scene(name: str, distance: float) -> tisim.Scene:
    """Two grains at rest, above each other, for a step in which they do not move."""
    return tisim.Scene(
        particles=tisim.Particles(
            position=[[0, 0, 0], [0, 0, distance]],
            velocity=[[0, 0, 0]] * 2,
            radius=RADIUS,
            density=DENSITY,
        ),
        materials=snippets.materials(name),
        effects=snippets.effects(name),
        stepper=Verlet(control=FixedStep(dt=1e-15)),
        duration=1e-15,
    )


def _version(name: str) -> str:
    """Return a digest of everything that a plot shows."""
    law = inspect.getsource(inspect.getmodule(reference.find(name).kind) or snippets)
    scene = f"{snippets.EFFECTS[name]} {snippets.materials(name)} {RANGES[name]} {POINTS}"
    text = f"{law} {scene} {inspect.getsource(_draw)}"
    return hashlib.sha256(text.encode()).hexdigest()


def _draw(name: str, path: Path, version: str) -> None:
    distances, forces = force(name)
    with mpl.rc_context({"svg.hashsalt": name, "font.size": 9, "axes.formatter.limits": (-3, 4)}):
        figure = Figure(figsize=(4.5, 2.8), layout="constrained")
        axes = figure.subplots()
        axes.axhline(0, color="0.6", linewidth=0.8)
        axes.axvline(2e3 * RADIUS, color="0.6", linewidth=0.8, linestyle=":")
        axes.plot(1e3 * distances, forces)
        axes.set_xlabel("distance of the centres (mm); dotted: grains touch")
        axes.set_ylabel("force (N), attraction > 0")
        axes.set_xlim(1e3 * distances[0], 1e3 * distances[-1])
        figure.savefig(path, format="svg", metadata={"Date": None, "Description": version})


if __name__ == "__main__":
    write()
