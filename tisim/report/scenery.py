"""Everything that a report draws beside the particles, and the part of space that it shows at first."""

from __future__ import annotations

import numpy as np
from matplotlib import colormaps

from tisim.effects.walls.confinement import confinement
from tisim.plotting.bodies import shapes_of
from tisim.plotting.cloud import gravity
from tisim.plotting.field_lines import LINE_COLOURS, FieldLines, arrowheads, ends
from tisim.report import bodies
from tisim.report.compressed_trajectory import CompressedTrajectory, FrameSequence
from tisim.shapes.particle_shape import ParticleShape

MAPS = ("viridis", "cividis", "inferno", "coolwarm")
"""Colour maps; the first is the default. All but the last are perceptually uniform."""
MAP_COLOURS = 48
"""Number of colours from which the browser interpolates a map."""
MOST_SHOWN = 97.0
"""Percentile of the particles of a frame, along each axis and in either direction, that the view shows at
first; the others may be far away."""


def scenery(
    sequence: FrameSequence, trajectory: CompressedTrajectory, lines: str | None = None
) -> dict[str, object]:
    """Return everything that is drawn beside the particles, as plain data.

    lines : name of a field whose lines in the last frame are drawn (see ``FieldLines``).
    """
    scene, domain = sequence.scene, sequence.scene.domain
    low, high = trajectory.low, trajectory.high
    box_low, box_high = domain.bounds()
    box = None
    focus = _focus(sequence, trajectory)
    if box_low is not None and box_high is not None:
        shown = trajectory.times if domain.shears() else trajectory.times[:1]
        edges = [domain.edges(float(time)).tolist() for time in shown]
        box = {"origin": box_low.tolist(), "edges": edges, "periodic": list(domain.joined())}
        low, high = np.minimum(low, box_low), np.maximum(high, box_high)
        focus = np.minimum(focus[0], box_low), np.maximum(focus[1], box_high)
    travel = {
        name.removesuffix("_travel"): values[trajectory.indices]
        for name, values in sequence.measures.items()
        if name.endswith("_travel")
    }
    magnets = bodies.magnets(scene)
    for magnet in magnets:
        centre = np.array(magnet.centre)
        focus = np.minimum(focus[0], centre - magnet.radius), np.maximum(focus[1], centre + magnet.radius)
    walls = bodies.bodies(scene, trajectory.times, travel, *focus)
    if confinement(scene) is not None:
        held = bodies.container(scene, (sequence[k].arrays for k in trajectory.indices.tolist()))
        walls += [] if held is None else [held]
    # Walls near the particles are in view as a whole, such as the hopper above a bed.
    size = float(np.linalg.norm(focus[1] - focus[0]))
    near = [points for points in (body.places() for body in walls) if _within(points, focus, size)]
    if near:
        every = np.concatenate(near)
        focus = np.minimum(focus[0], every.min(axis=0)), np.maximum(focus[1], every.max(axis=0))
    low, high = np.minimum(low, focus[0]), np.maximum(high, focus[1])
    for points in (*(body.places() for body in walls), *(magnet.ends() for magnet in magnets)):
        low, high = np.minimum(low, points.min(axis=0)), np.maximum(high, points.max(axis=0))
    return {
        "box": box, "low": low.tolist(), "high": high.tolist(),
        "focus": {"low": focus[0].tolist(), "high": focus[1].tolist()},
        "bodies": [body.facts() for body in walls], "magnets": [magnet.facts() for magnet in magnets],
        "shapes": [_shape(shape) for shape in shapes_of(scene)], "gravity": gravity(scene).tolist(),
        "medianRadius": _median_radius(sequence),
        "lines": None if lines is None else _field_lines(sequence, trajectory, lines, np.array(focus)),
    }  # fmt: skip


def _field_lines(
    sequence: FrameSequence, trajectory: CompressedTrajectory, name: str, around: np.ndarray
) -> dict[str, object]:
    """Return the lines of a field in the last frame, as plain data. around : points among the lines, m."""
    last = int(trajectory.indices[-1])
    time = float(sequence.times[last])
    with FieldLines(sequence.scene, name) as field:
        found = field.lines(sequence[last].arrays, time, around)
    colour = [round(255 * part) for part in LINE_COLOURS[name]]
    pieces = np.concatenate([ends(found), arrowheads(found)])
    return {"name": name, "time": time, "colour": colour, "ends": bodies.digits(pieces)}


def _within(points: np.ndarray, box: tuple[np.ndarray, np.ndarray], margin: float) -> bool:
    """Return whether points (m, shape (n, 3)) are in a box or within a margin (m) of it."""
    return bool((points >= box[0] - margin).all() and (points <= box[1] + margin).all())


def _focus(sequence: FrameSequence, trajectory: CompressedTrajectory) -> tuple[np.ndarray, np.ndarray]:
    """Return the corners (m) of a box around most particles at the first, the middle and the last frame."""
    corners = []
    for k in trajectory.indices[[0, len(trajectory.indices) // 2, -1]].tolist():
        arrays = sequence[k].arrays
        if len(arrays["radius"]):
            position, radius = arrays["position"].astype(float), arrays["radius"].astype(float)[:, None]
            few = len(radius) < 100
            ends = (0.0, 100.0) if few else (100 - MOST_SHOWN, MOST_SHOWN)
            low, high = (np.percentile(position, end, axis=0) for end in ends)
            # As far beyond these percentiles as a uniform cloud reaches.
            beyond = 0.0 if few else (100 - MOST_SHOWN) / (2 * MOST_SHOWN - 100)
            room = beyond * (high - low) + float(np.median(radius))
            corners += [low - room, high + room]
    if not corners:
        return trajectory.low, trajectory.high
    return np.min(corners, axis=0), np.max(corners, axis=0)


def _median_radius(sequence: FrameSequence) -> float:
    """Return the median radius (m) in the last frame with particles."""
    for k in (len(sequence) - 1, 0):
        radius = sequence[k].arrays["radius"]
        if len(radius):
            return float(np.median(radius))
    return 1.0


def _shape(shape: ParticleShape) -> dict[str, object]:
    """Return a shape of particles as plain data; one that is neither a rod nor a superquadric is drawn as the
    ellipsoid of its extents."""
    radius = shape.bounding_radius()
    if (rod := shape.rod()) is not None:
        return {"family": 1, "axes": [rod[1], 0.0, rod[0]], "exponents": [2.0] * 3, "radius": radius}
    axes, exponents = shape.superquadric() or (tuple(shape.half_extents().tolist()), (2.0, 2.0, 2.0))
    return {"family": 2, "axes": list(axes), "exponents": list(exponents), "radius": radius}


def colour_maps() -> dict[str, list[list[int]]]:
    """Return the colour maps, as red, green and blue from 0 to 255."""
    places = np.linspace(0, 1, MAP_COLOURS)
    return {name: np.rint(255 * colormaps[name](places)[:, :3]).astype(int).tolist() for name in MAPS}
