"""Lines along a field of a scene, for pictures and reports: magnetic and electric lines, and streamlines."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import ExitStack
from dataclasses import replace
from typing import Self

import numpy as np
from scipy.constants import mu_0

from tisim.effects.magnetic.moment import MOMENT
from tisim.errors import must
from tisim.plotting.scenery import Scenery, finite_grains
from tisim.rendering.surfaces import DrawnLines
from tisim.scene.initial_state import Arrays
from tisim.scene.scene import Scene
from tisim.sources.base import Source
from tisim.sources.sampling import FieldSampler

QUANTITIES = {
    "magnetic": "magnetic_flux_density", "electric": "electric_field", "flow": "flow_velocity",
}  # fmt: skip
"""Standard names of the quantities whose lines can be drawn, by the names that users give."""
LINE_COLOURS = {"magnetic": (0.23, 0.37, 0.68), "electric": (0.78, 0.42, 0.12), "flow": (0.25, 0.58, 0.80)}
"""Red, green and blue of lines, 0..1."""
LINE_WIDTH = 3.0
"""Width of a line, rays."""
SEEDS_ALONG_SIDE = 7
"""Lines along each side of the section in which lines begin."""
LINE_STEPS = 160
"""Number of steps along the diagonal of the box; a line has at most these many in either direction."""
ROOM_FOR_LINES = 0.15
"""The box of lines in open space is larger than the one around particles and magnets by this, relative to its
diagonal, on each side."""
ARROW_LENGTH, ARROW_SLOPE = 0.03, 0.35
"""Length of an arrowhead relative to the diagonal of a box around all lines, and half its width over its
length."""
ARROW_PLACES = (0.35, 0.5, 0.65)
"""Places of the arrowheads of successive lines, as fractions of their lengths, so that they are not in one
plane."""
SUMMED_PAIRS = 2_000_000
"""Pairs of a point and a dipole that are summed at a time."""

Field = Callable[[np.ndarray], np.ndarray]
"""A field at points (m, shape (n, 3)), shape (n, 3)."""


def follow(field: Field, seeds: np.ndarray, step: float, count: int) -> np.ndarray:
    """Return points (m) of lines along a field from seeds (m, shape (n, 3)), shape (count + 1, n, 3).

    The classical Runge-Kutta method follows the direction of the field. A line ends where the field is 0; its
    other points are there.

    step : length of a piece, m; negative against the field. count : number of pieces.
    """

    def along(place: np.ndarray) -> np.ndarray:
        value = field(place)
        size = np.linalg.norm(value, axis=1, keepdims=True)
        return np.divide(value, size, out=np.zeros_like(value), where=size > 0)

    points = [np.asarray(seeds, float)]
    for _ in range(count):
        r = points[-1]
        a = along(r)
        b = along(r + 0.5 * step * a)
        c = along(r + 0.5 * step * b)
        points.append(r + step / 6 * (a + 2 * b + 2 * c + along(r + step * c)))
    return np.array(points)


def lines_through(field: Field, low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    """Return lines of a field through a box (corners in m), each as points (m), shape (k, 3).

    They begin on a lattice in the section through the middle of the box that is normal to the mean field, or
    to z if that is 0, and end at the faces of the box.
    """
    middle, side = (low + high) / 2, high - low
    part = (np.arange(SEEDS_ALONG_SIDE) + 0.5) / SEEDS_ALONG_SIDE - 0.5
    everywhere = middle + side * np.stack(np.meshgrid(part, part, part), axis=-1).reshape(-1, 3)
    mean = field(everywhere).mean(axis=0)
    normal = mean / np.linalg.norm(mean) if np.linalg.norm(mean) > 0 else np.array([0.0, 0.0, 1.0])
    # The rows of the lattice are along the side that is most nearly normal to the mean field.
    first = np.eye(3)[np.argmin(np.abs(normal))]
    first = first - (first @ normal) * normal
    first /= np.linalg.norm(first)
    second = np.cross(normal, first)
    extent = [float((np.abs(one) * side).sum()) for one in (first, second)]
    a, b = np.meshgrid(part * extent[0], part * extent[1])
    seeds = middle + a.reshape(-1, 1) * first + b.reshape(-1, 1) * second
    seeds = seeds[((seeds >= low) & (seeds <= high)).all(axis=1)]
    step = float(np.linalg.norm(side)) / LINE_STEPS
    ways = [follow(field, seeds, sign * step, LINE_STEPS) for sign in (-1.0, 1.0)]
    found = []
    for k in range(len(seeds)):
        backward, forward = (_inside(way[:, k], low, high) for way in ways)
        found.append(np.concatenate([backward[:0:-1], forward]))
    return [line for line in found if len(line) > 1]


def _inside(line: np.ndarray, low: np.ndarray, high: np.ndarray) -> np.ndarray:
    """Return the points of a line before it leaves a box or ends."""
    out = np.logical_not(((line >= low) & (line <= high)).all(axis=1))
    out[1:] |= (line[1:] == line[:-1]).all(axis=1)
    return line[: np.argmax(out)] if out.any() else line


def dipole_field(
    points: np.ndarray, position: np.ndarray, moment: np.ndarray, radius: np.ndarray
) -> np.ndarray:
    """Return the flux density (T) of uniformly magnetised spheres at points (m, shape (n, 3)).

        B = mu_0/(4 pi) (3 n (n.m) - m)/r^3 outside,    mu_0 m/(2 pi R^3) inside

    position, moment, radius : m, A m^2 and m, shape (k, 3), (k, 3) and (k,).
    """
    total = np.zeros((len(points), 3))
    count = max(1, SUMMED_PAIRS // max(len(points), 1))
    for begin in range(0, len(position), count):
        some = slice(begin, begin + count)
        apart = points[:, None] - position[None, some]
        distance = np.linalg.norm(apart, axis=2)[..., None]
        m, size = moment[None, some], radius[None, some, None]
        within = distance < size
        far = np.where(within, size, distance)
        outside = (3 * apart * (apart * m).sum(axis=2, keepdims=True) / far**2 - m) / (4 * np.pi * far**3)
        total += np.where(within, m / (2 * np.pi * size**3), outside).sum(axis=1)
    return mu_0 * total


def check_lines(scene: Scene, name: str | None) -> None:
    """Raise InputError if a scene has no lines of a name; None is of no lines."""
    sources = _sampled(scene)
    known = [own for own, one in QUANTITIES.items() if one in sources]
    if "magnetic" not in known and any(MOMENT in effect.fields for effect in scene.effects):
        known.append("magnetic")
    rule = f"one of {', '.join(known)}" if known else "left out in this scene"
    must(name is None or name in known, "lines", rule, name)


def _sampled(scene: Scene) -> set[str]:
    """Return the quantities that have a source in a scene."""
    return {one.quantity for one in scene.effects if isinstance(one, Source)}


class FieldLines:
    """The lines of one quantity of a scene. It is a context manager.

    name : a key of QUANTITIES. Magnetic lines are of the sources of the scene, and of particles with moments
    as spheres of uniform magnetisation; images of these in periodic boxes are left out. InputError if the
    scene has neither a source nor moments.
    """

    def __init__(self, scene: Scene, name: str) -> None:
        check_lines(scene, name)
        self.scene, self.name, self.held = scene, name, ExitStack()
        quantity = QUANTITIES[name]
        self.sampler = (
            self.held.enter_context(FieldSampler(scene.effects, quantity))
            if quantity in _sampled(scene)
            else None
        )

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *failure: object) -> None:
        self.held.close()

    def field(self, state: Arrays, time: float) -> Field:
        """Return the field at a state and a time (s)."""

        def value(points: np.ndarray) -> np.ndarray:
            total = np.zeros(points.shape) if self.sampler is None else self.sampler(points, time)[0]
            if self.name == "magnetic" and MOMENT.name in state and len(state["radius"]):
                total = total + dipole_field(points, state["position"], state[MOMENT.name], state["radius"])
            return total

        return value

    def lines(self, state: Arrays, time: float, around: np.ndarray) -> list[np.ndarray]:
        """Return the lines at a state and a time (s); see ``lines_through``.

        They are in the box of the domain, and in open space in a box around the particles and other points
        (m, shape (n, 3)).
        """
        low, high = self.scene.domain.bounds()
        if low is None or high is None:
            place, radius = finite_grains(state)
            every = np.concatenate([around, place - radius[:, None], place + radius[:, None]])
            low, high = every.min(axis=0), every.max(axis=0)
            room = ROOM_FOR_LINES * float(np.linalg.norm(high - low))
            low, high = low - room, high + room
        return lines_through(self.field(state, time), low, high)

    def beside(self, around: Scenery, state: Arrays, time: float) -> Scenery:
        """Return the surroundings of particles with the lines among them."""
        corners = [one.centre + sign * one.sizes()[:, None] for one in around.solids for sign in (-1, 1)]
        found = self.lines(state, time, np.concatenate([around.points, *corners]))
        colour = np.array(LINE_COLOURS[self.name])
        pieces = np.concatenate([ends(found), arrowheads(found)])
        return replace(around, edges=(*around.edges, DrawnLines.of(pieces, colour, LINE_WIDTH)))


def arrowheads(lines: list[np.ndarray]) -> np.ndarray:
    """Return arrowheads that show the direction of lines, one on each that is long enough: four barbs as
    pairs of points (m), the tip first, shape (barbs, 2, 3).

    lines : points (m) in the direction of the field, shape (k, 3) each.
    """
    barbs = [np.empty((0, 2, 3))]
    if lines:
        every = np.concatenate(lines)
        length = ARROW_LENGTH * float(np.linalg.norm(np.ptp(every, axis=0)))
    for number, line in enumerate(lines):
        along = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(line, axis=0), axis=1))])
        if along[-1] < 3 * length:
            continue
        at = ARROW_PLACES[number % len(ARROW_PLACES)] * along[-1]
        tip, tail = (np.array([np.interp(s, along, x) for x in line.T]) for s in (at + length, at))
        way = (tip - tail) / np.linalg.norm(tip - tail)
        aside = np.cross(way, np.eye(3)[np.argmin(np.abs(way))])
        aside *= ARROW_SLOPE * length / np.linalg.norm(aside)
        across = np.cross(way, aside)
        for off in (aside, -aside, across, -across):
            barbs.append(np.stack([tip, tip - length * way + off])[None])
    return np.concatenate(barbs)


def ends(lines: list[np.ndarray]) -> np.ndarray:
    """Return the pieces of lines as pairs of points (m), shape (pieces, 2, 3)."""
    pairs = [np.stack([line[:-1], line[1:]], axis=1) for line in lines]
    return np.concatenate([np.empty((0, 2, 3)), *pairs])
