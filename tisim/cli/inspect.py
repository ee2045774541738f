"""The commands ``tisim plot``, ``movie``, ``export`` and ``figures`` show the results of runs."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tisim.backend import runtime
from tisim.cli import targets
from tisim.cli.options import (
    Arithmetic,
    CaseName,
    Device,
    Out,
    Overwrite,
    Plugins,
    Precision,
    Size,
    Threads,
    nameable,
)
from tisim.console import shown_progress
from tisim.errors import InputError
from tisim.files import output_folder, pictures, regular_file
from tisim.files.output_folder import resumes
from tisim.streams import say

if TYPE_CHECKING:
    from collections.abc import Mapping, Sequence

    from matplotlib.figure import Figure

    from tisim.io.reader import Frames
    from tisim.plotting.look import Look
    from tisim.report.spectrum import Spectrum

File = Annotated[
    Path,
    typer.Argument(
        help="A run's folder, or its trajectory.h5 or result.h5.", metavar="FILE", callback=nameable
    ),
]
OTHER_FOLDERS = {"search.h5": "a search", "cost.h5": "a study of costs"}
"""Files that mark folders without frames, each with the kind of the folder; such folders hold their own
pictures."""
World = Annotated[int, typer.Option(help="Index of the world in a batch, from 0.")]
Colour = Annotated[
    str | None,
    typer.Option(
        "--colour", "--color", metavar="FIELD",
        help="Quantity that colours grains: material, radius, speed, or a recorded field.",
    ),
]  # fmt: skip
View = Annotated[str, typer.Option(metavar="AZIMUTH,ELEVATION", help="Direction of the viewer in degrees.")]
Crop = Annotated[
    str, typer.Option(metavar="LEFT,RIGHT,BOTTOM,TOP", help="Part of the picture that is shown, 0 to 1.")
]
Clip = Annotated[
    list[str] | None,
    typer.Option(metavar="PART", help="Part of space that is drawn, in m, such as 'y<0.01'; repeatable."),
]
Lines = Annotated[
    str | None,
    typer.Option(metavar="FIELD", help="Field whose lines are drawn: magnetic, electric or flow."),
]
IntoFolder = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", callback=nameable, help="Folder to write to; by default the folder of FILE."
    ),
]


def plot(
    file: File,
    world: World = 0,
    folder: IntoFolder = None,
    overwrite: Overwrite = False,
    plugins: Plugins = None,
    colour: Colour = None,
    view: View = "",
    crop: Crop = "",
    clip: Clip = None,
    lines: Lines = None,
) -> None:
    """Draw pictures of a run.

    They show the particles, the time series of energy, centre of gravity and number of particles, the forces
    on walls and driven groups, and more if the run is of a case. The options are for the particles.
    """
    from tisim.io.reader import frames

    file = trajectory_file(file)
    out_folder = folder or file.parent
    with frames(file, world) as trajectory:
        with pictures.drawing(f"{file}"):
            from tisim.plotting.look import Look

            drawn = _pictures(trajectory, Look.of(colour, view, crop, tuple(clip or ()), lines))
        print_missing(trajectory.missing)
    output_folder.claim(out_folder, drawn, overwrite)
    for name, figure in drawn.items():
        print(_save(figure, out_folder / name))


def _pictures(trajectory: Frames, look: Look) -> dict[str, Figure]:
    """Return the figures of a trajectory by the names of their files."""
    from tisim.plotting import loads, time_series

    drawn = {
        "cloud.png": time_series.clouds(trajectory, look),
        "time_series.png": time_series.quantities(trajectory),
    }
    if loads.bodies(trajectory):
        drawn["loads.png"] = loads.loads(trajectory)
    drawn |= case_pictures(trajectory)
    for figure in drawn.values():
        time_series.mark_missing(figure, trajectory)
    return drawn


def case_pictures(trajectory: Frames) -> Mapping[str, Figure]:
    """Return the figures that the case of a run draws of it, by the names of their files."""
    from tisim.cases.case import every

    case = every().get(trajectory.scene.name)
    return case.pictures(trajectory) if case and case.pictures else {}


def case_spectra(trajectory: Frames) -> Sequence[Spectrum]:
    """Return the spectra that the case of a run computes of it."""
    from tisim.cases.case import every

    case = every().get(trajectory.scene.name)
    return case.spectra(trajectory) if case and case.spectra else ()


def figures(
    case: CaseName, size: Size = None, folder: Out = None,
    device: Device = "cpu", precision: Precision = "f64", threads: Threads = 0,
    arithmetic: Arithmetic = "strict", overwrite: Overwrite = False,
    plugins: Plugins = None,
) -> None:  # fmt: skip
    """Draw the figures of a case, which need many runs.

    The numbers in them are written as CSV files.

    An interrupted command keeps no results; it starts from the beginning when run again.
    """
    from tisim.files.atomic import replace_file

    chosen_case = targets.case(case)
    size_name = size or "default"
    chosen_case.size(size_name)
    if chosen_case.figures is None:
        raise InputError(f"case must be one that has figures; received {case!r}")
    # Check that drawing works before the runs.
    with pictures.drawing(f"figures of {chosen_case.name}"):
        from tisim.plotting import style

        pictures.image(style.empty(1.0, 1.0))
    runtime.init(device, precision, threads, arithmetic)
    out_folder = folder or Path("out") / f"{chosen_case.name}-figures"
    output_folder.check_all(out_folder, overwrite)
    resumes(
        out_folder,
        "figures",
        False,
        "finished figures" * output_folder.has_results(out_folder),
        None,
        overwrite,
    )
    output_folder.claim(out_folder, (output_folder.LOCK,), overwrite)
    with output_folder.lock(out_folder):
        with shown_progress("running") as progress:
            results = chosen_case.figures(size_name, progress)
        output_folder.claim(out_folder, results, overwrite)
        # Write numbers first, so that a figure that cannot be drawn does not lose them.
        for name, content in sorted(results.items(), key=lambda item: not isinstance(item[1], str)):
            if isinstance(content, str):
                replace_file(out_folder / name, content.encode())
                print(out_folder / name)
            else:
                print(_save(content, out_folder / name))


def movie(
    file: File,
    to: Annotated[
        Path | None,
        typer.Option("--to", metavar="NAME.gif", callback=nameable, help="A .gif or .mp4 file."),
    ] = None,
    rate: Annotated[int, typer.Option(help="Frames per second.")] = 20,
    world: World = 0,
    overwrite: Overwrite = False,
    plugins: Plugins = None,
    colour: Colour = None,
    view: View = "",
    crop: Crop = "",
    clip: Clip = None,
    lines: Lines = None,
) -> None:
    """Draw the trajectory of a run as a moving picture.

    An .mp4 needs ffmpeg, which the extra "movie" of tisim installs.
    """
    from tisim.io.reader import frames

    file = trajectory_file(file)
    path = to or file.with_suffix(".gif")
    with frames(file, world) as trajectory, pictures.drawing(str(path)):
        from tisim.plotting.look import Look
        from tisim.plotting.movie import check, while_drawn
        from tisim.plotting.movie import movie as draw

        look = Look.of(colour, view, crop, tuple(clip or ()), lines)
        check(trajectory, path, rate, look)
        output_folder.claim(path.parent, (path.name, while_drawn(path)), overwrite)
        with shown_progress("drawing") as progress:
            draw(trajectory, path, rate, progress, look)
        print_missing(trajectory.missing)
    print(path)


def export(
    file: File,
    kind: Annotated[str, typer.Option("--format", help="vtk (ParaView), xyz (OVITO, ASE) or h5md.")] = "vtk",
    folder: IntoFolder = None,
    overwrite: Overwrite = False,
    plugins: Plugins = None,
    fields: Annotated[
        str,
        typer.Option(metavar="FIELD,...", help="Fields that are written, for vtk and xyz; all unless given."),
    ] = "",
) -> None:
    """Convert the frames of a run to a format of other programs.

    A trajectory is H5MD already; the format h5md makes a copy of it. For vtk the walls are written as
    triangles.
    """
    from tisim.io.export import check, file_names
    from tisim.io.export import export as write
    from tisim.io.reader import frames, world_count

    file = trajectory_file(file)
    names = [name.strip() for name in fields.split(",")] if fields else []
    check(file, kind, names)
    out_folder = folder or file.parent
    output_folder.claim(out_folder, file_names(file, kind), overwrite)
    with shown_progress("writing") as progress:
        path = write(file, kind, out_folder, progress, names)
    for world in range(count := world_count(file)):
        with frames(file, world) as trajectory:
            print_missing(
                f"world {world}: {trajectory.missing}"
                if trajectory.missing and count > 1
                else trajectory.missing
            )
    print(path)


def _save(figure: Figure, path: Path) -> Path:
    return pictures.write(path, lambda: figure)


def print_missing(missing: str) -> None:
    """Print a sentence about what a trajectory lacks, if there is one."""
    if missing:
        say(missing)


def trajectory_file(path: Path) -> Path:
    """Return the trajectory in a folder, or else its result; InputError if the folder has neither."""
    if not regular_file.is_folder(path):
        return path
    for file in (path / "trajectory.h5", path / "result.h5"):
        if regular_file.exists(file):
            return file
    unfinished = regular_file.exists(path / "checkpoint.h5")
    why = ", with only the checkpoint of an unfinished run" if unfinished else ", with neither"
    for name, what in OTHER_FOLDERS.items():
        if regular_file.exists(path / name):
            pictures = ", ".join(sorted(str(file) for file in path.glob("*.png"))) or "none yet"
            raise InputError(
                f"folder must be the folder of a run; received the folder of {what}, with the pictures: "
                f"{pictures}"
            )
    raise InputError(f"folder must be one with a trajectory.h5 or result.h5; received {str(path)!r}{why}")
