"""Records the cases for the viewers of the pages: small files that a browser plays without a network.

    python docs/recordings.py [CASE ...]        runs the cases (all by default), some minutes of CPU time

For each case in recordings.toml it writes a recording and a still picture to docs/_static/recordings. The
recording is a script that calls a function of docs/_static/recordings.js with its data, because a page that
is opened as a file may load scripts, and no data. Frames, and then particles, are left out until the
recording keeps its limit, and the page says so.
"""

from __future__ import annotations

import base64
import json
import sys
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryDirectory
from time import process_time
from typing import Any

import numpy as np
from matplotlib import colormaps
from PIL import Image

from tisim import InputError, Recording, run
from tisim.cases import case
from tisim.console import progress_bar
from tisim.io.reader import frames
from tisim.plotting import scenery as pictured
from tisim.plotting.bodies import shapes_of, solids_of
from tisim.rendering.camera import USUAL_CAMERA, Raster
from tisim.rendering.render import render
from tisim.report.columns import Column, Scale, whole_numbers
from tisim.report.compressed_trajectory import CompressedTrajectory, compress, quantities
from tisim.report.kept_frames import KeptFrames
from tisim.report.page import embedded
from tisim.report.scenery import MAPS, scenery

DOCS = Path(__file__).parent
SETTINGS = DOCS / "recordings.toml"
FOLDER = DOCS / "_static" / "recordings"
LARGEST, LARGEST_IN_ALL = 250_000, 3_000_000
"""Limits of the sizes of a recording and of all recordings, bytes."""
LEAST_FRAMES = 30
"""Particles are left out rather than frames if fewer than these would remain."""
SEED = 0
STILL = 800, 500
"""Pixels of a still picture, across and upwards."""
QUALITY = 82
"""Of the compression of still pictures, 0..100."""
LEAST_RADIUS = 2.5
"""Of a particle in a still picture, pixels."""
PLAIN = (0.42, 0.60, 0.78)
"""Colour of particles that no quantity colours, as in the viewer: red, green and blue, 0..1."""
DARKEST = 0.19
"""Part of the map of colours that still pictures leave out, as the viewer does on a dark ground."""
BEGIN, END = "tisimRecording(", ");\n"
"""Of the script that holds a recording."""


@dataclass(frozen=True)
class Recorded:
    """A case that is recorded; see recordings.toml for the settings. name : of the case."""

    name: str
    size: str
    colour: str
    variant: str | None = None
    frames: int | None = None
    every: float | None = None
    still: float = 1.0
    near: bool = False
    note: str = ""

    @property
    def script(self) -> Path:
        return FOLDER / f"{self.name}.js"

    @property
    def picture(self) -> Path:
        return FOLDER / f"{self.name}.webp"

    @property
    def fields(self) -> tuple[str, ...]:
        """Return the quantities that are recorded beside positions and sizes."""
        return (self.colour,) if self.colour else ()

    @property
    def command(self) -> str:
        """Return the command that runs the scene."""
        size = [] if self.size == "default" else ["--size", self.size]
        variant = [] if self.variant is None else ["--variant", self.variant]
        return " ".join(["tisim run", self.name, *size, *variant])


def every_case() -> dict[str, Recorded]:
    """Return the recorded cases by their names."""
    table = tomllib.loads(SETTINGS.read_text(encoding="utf-8"))
    return {name: Recorded(name, **values) for name, values in table.items()}


def record(one: Recorded) -> None:
    """Run a case and write its recording and its still picture."""
    scene = case.every()[one.name].scene_of(one.size, SEED, one.variant)
    with TemporaryDirectory() as folder, progress_bar("{task.description}") as bar:
        task, path = bar.add_task(one.name, total=1.0), Path(folder) / "trajectory.h5"
        begin = process_time()
        result = run(
            scene,
            lambda part: bar.update(task, completed=part),
            Recording(path, frames=one.frames, every=one.every),
        )
        seconds = process_time() - begin
        if not result.status.ok:
            raise InputError(f"{one.name} must run to its end; received {result.status.reason}")
        bar.update(task, completed=1.0)
        with frames(path) as trajectory:
            sequence = KeptFrames(trajectory)
            text = thinned(one, sequence, seconds)
            FOLDER.mkdir(parents=True, exist_ok=True)
            one.script.write_text(text, encoding="utf-8")
            still(one, sequence)
    print(f"{one.name}: recording {len(text) / 1e3:.0f} kB, {seconds:.0f} s of CPU time", flush=True)


def thinned(one: Recorded, sequence: KeptFrames, seconds: float) -> str:
    """Return the script of a recording, of at most LARGEST bytes. seconds : CPU time of the run."""
    stride, part, count = 1, 1, len(sequence)
    while True:
        chosen = sorted({*range(0, count, stride), count - 1})
        text = script(one, sequence, compress(sequence, chosen, part, one.fields), part, seconds)
        if len(text) <= LARGEST:
            return text
        if count / (stride + 1) >= LEAST_FRAMES:
            stride += 1
        else:
            part += 1


def script(
    one: Recorded, sequence: KeptFrames, trajectory: CompressedTrajectory, part: int, seconds: float
) -> str:
    """Return the script of a compressed trajectory."""
    scene = sequence.scene
    facts = {
        "name": scene.name, "trajectory": trajectory.facts(), "colour": one.colour,
        "lengths": [len(column.data) for column in trajectory.columns],
        "scene": _surroundings(one, sequence, trajectory), "materials": list(scene.materials),
        "seconds": seconds,
        "whole": {"frames": len(sequence), "particles": [len(sequence[k].arrays["id"]) for k in (0, -1)]},
    }  # fmt: skip
    data = base64.b64encode(b"".join(column.data for column in trajectory.columns)).decode()
    return f'{BEGIN}"{one.name}", {embedded(facts)},\n"{data}"{END}'


def _surroundings(one: Recorded, sequence: KeptFrames, trajectory: CompressedTrajectory) -> dict[str, object]:
    """Return all but the particles, as plain data, with the part of space that is in view at first."""
    found = scenery(sequence, trajectory)
    if one.near:
        found["focus"] = {"low": trajectory.low.tolist(), "high": trajectory.high.tolist()}
    return found


def contents(facts: Mapping[str, Any]) -> str:
    """Return what a recording has, from its facts: numbers of particles and frames, and what is left out."""
    counts, whole = facts["trajectory"]["counts"], facts["whole"]
    (start, end), drawn = whole["particles"], len(facts["trajectory"]["times"])
    particles = f"{start} particles" if start == end else f"{start} particles at the start, {end} at the end"
    if max(counts) < max(start, end):
        particles = f"{max(counts)} of {max(start, end)} particles"
    return f"{particles}; {drawn} frames" + (f" of {whole['frames']}" if drawn < whole["frames"] else "")


def facts_of(text: str) -> dict[str, Any]:
    """Return the facts of the script of a recording."""
    return _parts(text)[1]


def _parts(text: str) -> tuple[str, dict[str, Any], str]:
    """Return the name of the case, the facts and the data of the script of a recording."""
    if not (text.startswith(BEGIN) and text.endswith(END)):
        raise ValueError("not the script of a recording")
    name, facts, data = json.loads(f"[{text[len(BEGIN) : -len(END)]}]")
    return name, facts, data


def decoded(text: str) -> tuple[str, dict[str, Any], dict[str, np.ndarray]]:
    """Return the name of the case, the facts, and the values of each quantity of a recording, shape (frames,
    particles, components)."""
    name, facts, data = _parts(text)
    binary, begin, found = base64.b64decode(data), 0, {}
    trajectory = facts["trajectory"]
    for length, told in zip(facts["lengths"], trajectory["columns"], strict=True):
        scale = Scale(
            told["bits"], tuple(told["origin"]), tuple(told["step"]), told["logarithmic"], told["missing"]
        )
        packed = binary[begin : begin + length]
        column = Column(told["name"], told["unit"], scale, told["frames"], told["order"], packed)
        found[column.name] = scale.values(whole_numbers(column, trajectory["particles"]))
        begin += length
    if begin != len(binary):
        raise ValueError(f"{len(binary) - begin} bytes more than its columns have")
    return name, facts, found


def still(one: Recorded, sequence: KeptFrames) -> None:
    """Draw a frame on a transparent ground, in the colours of the viewer."""
    frame = sequence[round(one.still * (len(sequence) - 1))]
    state, scene = frame.arrays, sequence.scene
    around = pictured.scenery(scene, [state], frame.time, frame.measures, state)
    part = pictured.window([state], [] if one.near else [around], ratio=STILL[0] / STILL[1])
    raster = Raster(USUAL_CAMERA, part, *STILL)
    tints = np.tile(PLAIN, (len(state["radius"]), 1))
    if one.colour:
        columns = facts_of(one.script.read_text(encoding="utf-8"))["trajectory"]["columns"]
        low, high = next(told["shown"] for told in columns if told["name"] == one.colour)
        values = np.clip((quantities(state)[one.colour] - low) / (high - low or 1.0), 0, 1)
        tints = colormaps[MAPS[0]](DARKEST + (1 - DARKEST) * values)[:, :3]
    visible = {**state, "radius": np.maximum(state["radius"], LEAST_RADIUS / raster.scale)}
    solids = [*solids_of(visible, shapes_of(scene), tints), *around.solids]
    picture = render(raster, solids, around.walls, around.edges)
    pixels = np.rint(255 * np.clip(picture.rgba[::-1], 0, 1)).astype(np.uint8)
    Image.fromarray(pixels).save(one.picture, quality=QUALITY, method=6)


def main(names: list[str]) -> None:
    """Record the cases of some names, or all."""
    known = every_case()
    if unknown := [name for name in names if name not in known]:
        sys.exit(f"case must be one of {', '.join(known)}; received {', '.join(unknown)}")
    for name in names or known:
        record(known[name])


if __name__ == "__main__":
    main(sys.argv[1:])
