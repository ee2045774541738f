"""The commands that show what runs have left: ``tisim plot``, ``movie``, ``export``, ``figures``."""

from __future__ import annotations

import io
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from tisim.backend import runtime
from tisim.cli import targets
from tisim.cli.options import CaseName, Device, Out, Overwrite, Plugins, Precision, Size, Threads, nameable
from tisim.console import err, progress_bar
from tisim.errors import InputError
from tisim.files import lock, ownership, regular_file
from tisim.files.resuming import resumes

if TYPE_CHECKING:
    from collections.abc import Callable

    from matplotlib.figure import Figure

File = Annotated[
    Path,
    typer.Argument(
        help="A run's folder, or its trajectory.h5 or result.h5.", metavar="FILE", callback=nameable
    ),
]
World = Annotated[int, typer.Option(help="Which world of a batch, from 0.")]
Into = Annotated[
    Path | None,
    typer.Option(
        "--out", metavar="DIR", callback=nameable, help="Folder to write to; that of the file by default."
    ),
]


def plot(
    file: File, world: World = 0, folder: Into = None, overwrite: Overwrite = False, plugins: Plugins = None
) -> None:
    """Draw the cloud, energy, centre of gravity and number of particles in time, and what its case shows."""
    from cases.case import every
    from tisim.io.reader import frames
    from tisim.plotting import time_series

    file = _file(file)
    place = folder or file.parent
    with frames(file, world) as found:
        pictures = {"cloud.png": time_series.clouds(found), "time_series.png": time_series.quantities(found)}
        case = every().get(found.scene.name)
        if case and case.pictures:
            pictures |= case.pictures(found)
        for figure in pictures.values():
            time_series.mark_missing(figure, found)
        _tell(found.missing)
    ownership.claim(place, pictures, overwrite)
    for name, figure in pictures.items():
        print(_saved(figure, place / name))


def figures(
    case: CaseName, size: Size = None, folder: Out = None,
    device: Device = "cpu", precision: Precision = "f64", threads: Threads = 0, overwrite: Overwrite = False,
    plugins: Plugins = None,
) -> None:  # fmt: skip
    """Make the figures of a case that take many runs, and the numbers in them.

    Stopped, it keeps nothing, and begins anew.
    """
    from tisim.files.atomic import replace_file

    found = targets.case(case)
    chosen = size or "default"
    found.size(chosen)
    if found.figures is None:
        raise InputError(f"case must be one with figures; received {case!r}")
    runtime.init(device, precision, threads)
    place = folder or Path("out") / f"{found.name}-figures"
    ownership.check_all(place, overwrite)
    resumes(place, "figures", False, "finished figures" * ownership.has_results(place), None, overwrite)
    ownership.claim(place, (lock.LOCK,), overwrite)
    with lock.acquire(place):
        with _bar("running") as progress:
            made = found.figures(chosen, progress)
        ownership.claim(place, made, overwrite)
        for name, what in made.items():
            if isinstance(what, str):
                replace_file(place / name, what.encode())
                print(place / name)
            else:
                print(_saved(what, place / name))


def movie(
    file: File,
    to: Annotated[
        Path | None,
        typer.Option("--to", metavar="NAME.gif", callback=nameable, help="A .gif, or an .mp4 with ffmpeg."),
    ] = None,
    rate: Annotated[int, typer.Option(help="Frames a second.")] = 20,
    world: World = 0,
    overwrite: Overwrite = False,
    plugins: Plugins = None,
) -> None:
    """Draw a trajectory as a moving picture."""
    from tisim.io.reader import frames
    from tisim.plotting.movie import check, while_drawn
    from tisim.plotting.movie import movie as draw

    file = _file(file)
    path = to or file.with_suffix(".gif")
    with frames(file, world) as found:
        check(found, path, rate)
        ownership.claim(path.parent, (path.name, while_drawn(path)), overwrite)
        with _bar("drawing") as progress:
            draw(found, path, rate, progress)
        _tell(found.missing)
    print(path)


def export(
    file: File,
    kind: Annotated[str, typer.Option("--format", help="vtk (ParaView), xyz (OVITO, ASE) or h5md.")] = "vtk",
    folder: Into = None,
    overwrite: Overwrite = False,
    plugins: Plugins = None,
) -> None:
    """Write the frames of a run for other programs; h5md is a copy."""
    from tisim.io.export import check, file_names
    from tisim.io.export import export as write
    from tisim.io.reader import frames, world_count

    file = _file(file)
    check(file, kind)
    place = folder or file.parent
    ownership.claim(place, file_names(file, kind), overwrite)
    with _bar("writing") as progress:
        made = write(file, kind, place, progress)
    for world in range(number := world_count(file)):
        with frames(file, world) as found:
            _tell(f"world {world}: {found.missing}" if found.missing and number > 1 else found.missing)
    print(made)


def _tell(missing: str) -> None:
    if missing:
        print(missing, file=sys.stderr)


def _file(path: Path) -> Path:
    """The trajectory in a folder, or its result where it has none; InputError where there is neither."""
    if not regular_file.is_folder(path):
        return path
    for file in (path / "trajectory.h5", path / "result.h5"):
        if regular_file.exists(file):
            return file
    begun = regular_file.exists(path / "checkpoint.h5")
    why = ", with only the checkpoint of an unfinished run" if begun else ", with neither"
    if regular_file.exists(path / "search.h5"):
        drawn = ", ".join(sorted(str(file) for file in path.glob("*.png"))) or "none yet"
        raise InputError(
            f"folder must be that of a run; received that of a search, whose pictures are: {drawn}"
        )
    raise InputError(f"folder must be one with a trajectory.h5 or result.h5; received {str(path)!r}{why}")


def _saved(figure: Figure, path: Path) -> Path:
    from tisim.files.atomic import replace_file

    image = io.BytesIO()
    figure.savefig(image, dpi=150, format="png")
    replace_file(path, image.getvalue())
    return path


@contextmanager
def _bar(what: str) -> Iterator[Callable[[float], None]]:
    with progress_bar("{task.description}", console=err()) as bar:
        task = bar.add_task(what, total=1.0)
        yield lambda fraction: bar.update(task, completed=fraction)
