"""A movie of a run, as .gif or .mp4."""

from __future__ import annotations

import importlib.util
from collections.abc import Callable, Iterator
from contextlib import contextmanager, nullcontext
from pathlib import Path
from subprocess import CalledProcessError

import matplotlib
import numpy as np
from matplotlib.animation import AbstractMovieWriter, FFMpegWriter, PillowWriter
from matplotlib.backends.backend_agg import FigureCanvasAgg
from matplotlib.figure import Figure

from tisim.errors import InputError, RunError, Words, must
from tisim.files.atomic import replacing
from tisim.io.reader import Frames
from tisim.plotting import cloud
from tisim.plotting.bodies import shapes_of
from tisim.plotting.colours import Colouring, chosen, sample, scaled, values_of
from tisim.plotting.field_lines import FieldLines, check_lines
from tisim.plotting.look import USUAL, Look
from tisim.plotting.scenery import finite_grains, remaining, scenery, window
from tisim.rendering.camera import Window
from tisim.scene.initial_state import Arrays

SIDE = 5.0
"""Side of the picture, inches."""
LEGEND = 1.3
"""Width of the legend, inches."""
DPI = 120
"""Pixels per inch. The picture has even numbers of pixels, which H.264 demands."""
FFMPEG = "imageio_ffmpeg"
"""Module that carries ffmpeg, for machines without it."""


def movie(
    frames: Frames,
    path: Path,
    rate: int = 20,
    progress: Callable[[float], None] = lambda fraction: None,
    look: Look = USUAL,
) -> None:
    """Write a movie of all frames, ``rate`` of them per second, replacing an earlier one.

    path : ends in .gif, or in .mp4 if ffmpeg or imageio-ffmpeg is installed; raise InputError otherwise.
    progress : called with the finished fraction, 0..1. look : view, crop, cuts and colours.
    """
    check(frames, path, rate, look)
    coloured, outermost, part = _scales(frames, look)
    figure = Figure(figsize=(SIDE + LEGEND * (coloured is not None), SIDE), facecolor="white")
    FigureCanvasAgg(figure)
    axis = figure.add_axes((0.0, 0.0, SIDE / figure.get_figwidth(), 0.93))
    shapes = shapes_of(frames.scene)
    if coloured is not None:
        beside = figure.add_axes(((SIDE + 0.05) / figure.get_figwidth(), 0.2, 0.025, 0.55))
        coloured.legend(figure, None, beside)
    # The text is between the caption and the drawing, and covers neither grains nor the legend.
    figure.text(0.5, 0.935, frames.missing, ha="center", fontsize=7)
    unfinished = path.with_name(while_drawn(path))
    try:
        with (
            nullcontext() if look.lines is None else FieldLines(frames.scene, look.lines) as field,
            _writer(path, rate) as writer,
            replacing(path, unfinished),
            writer.saving(figure, str(unfinished), DPI),
        ):
            for k, frame in enumerate(frames):
                axis.clear()
                around = scenery(frames.scene, [outermost], frame.time, frame.measures, frame.arrays)
                if field is not None:
                    around = field.beside(around, frame.arrays, frame.time)
                colours = None if coloured is None else coloured.of(frame.arrays)
                cloud.panel(axis, frame.arrays, part, around, colours, shapes, look, int(SIDE * DPI))
                cloud.directions(axis, part, cloud.gravity(frames.scene), camera=look.camera)
                figure.suptitle(cloud.caption(frame.arrays, frame.time, frames.scene), fontsize=10, y=0.985)
                writer.grab_frame()
                progress((k + 1) / len(frames))
    except CalledProcessError as error:
        raise RunError(f"{path} could not be written: {error}") from error


def while_drawn(path: Path) -> str:
    """Return the name of the unfinished file; its suffix still tells the writer the format."""
    return f"{path.stem}.new{path.suffix}"


def check(frames: Frames, path: Path, rate: int, look: Look = USUAL) -> None:
    """Raise InputError if there are not enough frames, if the scene lacks the lines that are wanted, or if
    there is no writer for such a file."""
    check_lines(frames.scene, look.lines)
    must(0 < rate <= 100, "frames a second", "1 to 100", rate)
    must(len(frames) > 1, "file", "one with 2 frames or more", Words(f"{len(frames)} frames"))
    must(path.suffix in (".gif", ".mp4"), "movie", "a .gif or .mp4 file", path.name)
    if path.suffix == ".mp4":
        with _ffmpeg():
            if not FFMpegWriter.isAvailable():
                advice = 'python -m pip install "tisim[movie]"'
                rule = f"a .gif, as there is no ffmpeg ({advice} installs one)"
                raise InputError(f"movie must be {rule}; received {path.name!r}")


@contextmanager
def _writer(path: Path, rate: int) -> Iterator[AbstractMovieWriter]:
    """Yield the writer for a file."""
    if path.suffix == ".gif":
        yield PillowWriter(fps=rate)
    else:
        with _ffmpeg():
            yield FFMpegWriter(fps=rate, codec="libx264", extra_args=["-pix_fmt", "yuv420p", "-crf", "20"])


@contextmanager
def _ffmpeg() -> Iterator[None]:
    """Use the ffmpeg of this machine, or else of imageio-ffmpeg if that is installed."""
    if FFMpegWriter.isAvailable() or importlib.util.find_spec(FFMPEG) is None:
        yield
        return
    import imageio_ffmpeg

    with matplotlib.rc_context({"animation.ffmpeg_path": imageio_ffmpeg.get_ffmpeg_exe()}):
        yield


def _scales(frames: Frames, look: Look) -> tuple[Colouring | None, Arrays, Window]:
    """Return the colours, the outermost grains of all frames, and the window."""
    outermost: list[Arrays] = []
    values: list[np.ndarray] = []
    name: str | None = None
    for frame in frames:
        grains = frame.arrays
        if not values and len(grains["radius"]):
            name = chosen(frames.scene, [grains], look.colour)
        if name is not None:
            values.append(sample(values_of(grains, name)))
        outermost.append(_outermost(grains, look, whole=not outermost))
    together = {key: np.concatenate([one[key] for one in outermost]) for key in ("position", "radius")}
    surroundings = []
    for k, time in enumerate(frames.times):
        # Moving walls may extend farther between the first and the last frame. Containers only grow.
        known = {key: float(series[k]) for key, series in frames.measures.items()}
        now = grains if k == len(frames) - 1 else None
        surroundings.append(scenery(frames.scene, [together], float(time), known, now))
    part = window(outermost, surroundings, look)
    return None if name is None else scaled(frames.scene, name, values), together, part


def _outermost(grains: Arrays, look: Look, whole: bool) -> Arrays:
    """Return the grains with the largest and least coordinates in the projection, of all or of those that
    have not left the others."""
    place, radius = finite_grains(grains)
    seen = look.camera.project(place)
    kept = np.arange(len(place)) if whole else np.flatnonzero(remaining(seen, radius))
    if len(kept):
        kept = kept[np.unique([pick(seen[kept], axis=0) for pick in (np.argmin, np.argmax)])]
    return {"position": place[kept], "radius": np.full(len(kept), radius.max(initial=0.0))}
