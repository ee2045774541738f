"""A movie of a run, as .gif or .mp4."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from subprocess import CalledProcessError

import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tisim.errors import InputError, RunError, Words, must
from tisim.files.atomic import replacing
from tisim.io.reader import Frames
from tisim.plotting import cloud
from tisim.plotting.facets import PROJECTION, shapes_of
from tisim.scene.initial_state import Arrays

SIDE = 5.0
"""Side of the picture, inches."""
DPI = 110
"""Pixels per inch."""


def movie(
    frames: Frames, path: Path, rate: int = 20, progress: Callable[[float], None] = lambda fraction: None
) -> None:
    """Write a movie of all frames, ``rate`` of them per second, replacing an earlier one.

    path : ends in .gif, or in .mp4 if ffmpeg is installed; raise InputError otherwise.
    progress : called with the finished fraction, 0..1.
    """
    writer = check(frames, path, rate)
    coloured, ranges = _scales(frames)
    figure = Figure(figsize=(SIDE + 0.9 * (coloured is not None), SIDE), facecolor="white")
    FigureCanvasAgg(figure)
    axis = figure.add_axes((0.0, 0.0, SIDE / figure.get_figwidth(), 0.93))
    shapes = shapes_of(frames.scene)
    box = cloud.corners(*frames.scene.domain.bounds())
    square = cloud.view(ranges, np.vstack([box, *walls_of_all(frames, ranges)]))
    if coloured is not None:
        side = figure.add_axes(((SIDE + 0.05) / figure.get_figwidth(), 0.2, 0.025, 0.55))
        cloud.scale(figure, None, coloured, side)
    # The text is between the caption and the drawing, and covers neither grains nor the colour scale.
    figure.text(0.5, 0.935, frames.missing, ha="center", fontsize=7)
    unfinished = path.with_name(while_drawn(path))
    try:
        with replacing(path, unfinished), writer.saving(figure, str(unfinished), DPI):
            for k, frame in enumerate(frames):
                axis.clear()
                walls = cloud.walls_at(frames.scene, [ranges], frame.time)
                colours = cloud.heat_colours(frame.arrays, coloured)
                cloud.panel(axis, frame.arrays, square, box, colours, walls, shapes)
                cloud.directions(axis, square, cloud.gravity(frames.scene))
                figure.suptitle(cloud.caption(frame.arrays, frame.time, frames.scene), fontsize=10, y=0.985)
                writer.grab_frame()
                progress((k + 1) / len(frames))
    except CalledProcessError as error:
        raise RunError(f"{path} could not be written: {error}") from error


def while_drawn(path: Path) -> str:
    """Return the name of the unfinished file; its suffix still tells the writer the format."""
    return f"{path.stem}.new{path.suffix}"


def check(frames: Frames, path: Path, rate: int) -> AbstractMovieWriter:
    """Return the writer for such a file; raise InputError if there are not enough frames, or no writer is
    available."""
    must(0 < rate <= 100, "frames a second", "1 to 100", rate)
    must(len(frames) > 1, "file", "one with 2 frames or more", Words(f"{len(frames)} frames"))
    if path.suffix == ".mp4":
        if not FFMpegWriter.isAvailable():
            raise InputError(f"movie must be a .gif if ffmpeg is not installed; received {path.name!r}")
        return FFMpegWriter(fps=rate, codec="libx264", extra_args=["-pix_fmt", "yuv420p"])
    must(path.suffix == ".gif", "movie", "a .gif or .mp4 file", path.name)
    return PillowWriter(fps=rate)


def walls_of_all(frames: Frames, ranges: Arrays) -> list[np.ndarray]:
    """Return the projected outlines of walls at the times of all frames, m, because moving walls may extend
    farther between the first and the last frame."""
    return [line for t in frames.times for line in cloud.walls_at(frames.scene, [ranges], float(t))]


def _scales(frames: Frames) -> tuple[cloud.Normalize | None, Arrays]:
    """Return the temperature scale and the extent of the cloud over all frames."""
    position, radius, heat = [], [], []
    for frame in frames:
        arrays = frame.arrays
        if not len(arrays["radius"]):
            continue
        for extreme in (np.argmin, np.argmax):
            for k in {int(i) for i in extreme(arrays["position"] @ PROJECTION, axis=0)}:
                position.append(arrays["position"][k])
                radius.append(arrays["radius"].max())
        if "temperature" in arrays:
            heat.append({name: arrays[name] for name in ("temperature", "radius")})
    norm = cloud.temperatures(heat)
    return norm, {"position": np.array(position).reshape(-1, 3), "radius": np.array(radius)}
