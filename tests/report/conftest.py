"""Recordings that are written without a run, and a browser that shows their reports."""

from __future__ import annotations

from contextlib import contextmanager
from pathlib import Path

import numpy as np
import pytest

from tisim import Box, Particles, Scene
from tisim.io.reader import Frame
from tisim.io.trajectory import Trajectory, recorded_fields


def particles(n, **fields):
    """A start of n equal spheres."""
    given = {"position": np.zeros((n, 3)), "velocity": np.zeros((n, 3)), "radius": 1e-3, "mass": 1e-6}
    return Particles(**given | fields)


def scene(n=4, **settings):
    """Particles in a periodic box of 2 cm, without effects."""
    return Scene(
        **{"particles": particles(n), "domain": Box(low=(-0.01,) * 3, high=(0.01,) * 3), "duration": 1.0}
        | settings
    )


def recorded(path, of_scene, frames, measures=()):
    """Write a trajectory of frames, each a dict of arrays (``id`` and ``position`` at least)."""
    with Trajectory(path, [of_scene]) as file:
        for k, given in enumerate(frames):
            n = len(given["id"])
            arrays = {
                field.name: np.full(field.shape(n), 1e-3 if field.name in ("radius", "mass") else 0.0)
                for field in recorded_fields(of_scene)
            }
            arrays = {name: np.asarray(given.get(name, values)) for name, values in arrays.items()}
            file.write(0, Frame(k * 0.01, k, arrays, measures[k] if measures else {}))
    return path


@pytest.fixture
def record(tmp_path):
    """Write a trajectory, as ``recorded``, into a folder of the test."""

    def write(of_scene, frames, name="trajectory.h5", measures=()):
        return recorded(tmp_path / name, of_scene, frames, measures)

    return write


@pytest.fixture
def opened(browser):
    """Open a page as a file, and wait until it is ready. At the end no script may have failed, and no request
    may have left the page."""
    problems = []

    @contextmanager
    def show(path, width=1000, height=800, **settings):
        context = browser.new_context(viewport={"width": width, "height": height}, **settings)
        page = context.new_page()
        page.on(
            "console", lambda said: problems.append(said.text) if said.type in ("error", "warning") else None
        )
        page.on("pageerror", lambda error: problems.append(str(error)))
        address = Path(path).as_uri()
        page.on(
            "request",
            lambda request: (
                None
                if request.url.startswith(("data:", "blob:")) or request.url == address
                else problems.append(f"request of {request.url}")
            ),
        )
        page.goto(address)
        page.wait_for_selector("html[data-ready=yes]", timeout=60_000)
        try:
            yield page
        finally:
            context.close()

    yield show
    assert problems == []


@pytest.fixture
def touching(record, rng):
    """Grains that touch, across periodic faces too: the file, and for each frame Hertz's forces (N) by
    ids."""
    from tisim import Material
    from tisim.effects import Granular

    grains = scene(
        40,
        materials={"glass": Material(young=1e7, poisson=0.25, restitution=0.5, friction=0.5)},
        effects=(Granular(),),
    )
    made, expected, place = [], [], rng.uniform(-0.01, 0.01, (40, 3))
    for k in range(6):
        ids = np.array([one for one in range(40) if one != 7 or k not in (2, 3)])
        place = np.mod(place + rng.normal(0, 3e-4, (40, 3)) + 0.01, 0.02) - 0.01
        radius = np.full(len(ids), 2e-3)
        made.append({"id": ids, "position": place[ids], "radius": radius})
        apart = place[ids][:, None] - place[ids]
        depth = 4e-3 - np.linalg.norm(apart - 0.02 * np.rint(apart / 0.02), axis=2)
        pairs = np.argwhere(np.triu(depth >= 0, 1))
        # E* = E / (2 (1 - nu^2)) of two equal materials, R* = R / 2.
        modulus = 1e7 / (2 * (1 - 0.25**2))
        force = 4 / 3 * modulus * np.sqrt(1e-3) * np.maximum(depth, 0) ** 1.5
        expected.append({(int(ids[i]), int(ids[j])): float(force[i, j]) for i, j in pairs})
    return record(grains, made), expected


def growing_packing():
    """A scene of spheres in a cylinder of four of their diameters, and states in which they grow fourfold.

    The second state has no sphere.
    """
    from tisim.effects import Confinement, HardRods
    from tisim.geometry import CylindricalContainer
    from tisim.shapes import SpherocylinderShape
    from tisim.steppers import MechanicalContraction

    balls = HardRods(rods=(SpherocylinderShape(length=0.0, diameter=0.002),))
    made = scene(
        2, stepper=MechanicalContraction(),
        domain=Box(low=(-0.01,) * 3, high=(0.01,) * 3, periodic=(False, False, True)),
        effects=(balls, Confinement(container=CylindricalContainer(diameter=4.0))),
    )  # fmt: skip
    place, turn = np.array([[0.0, 0, -0.005], [0.0, 0, 0.005]]), np.tile([1.0, 0, 0, 0], (2, 1))
    states = [
        {
            "id": np.arange(n), "position": place[:n], "orientation": turn[:n], "radius": np.full(n, radius),
            "shape": np.zeros(n, int),
        }
        for n, radius in ((2, 2.5e-4), (0, 0.0), (2, 1e-3))
    ]  # fmt: skip
    return made, states
