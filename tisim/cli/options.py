"""Commands share these options."""

from pathlib import Path
from typing import Annotated

import typer

from tisim.errors import InputError, abbreviated


def nameable(path: Path | None) -> Path | None:
    """Return a path of a command line; InputError where the system can have none of this name."""
    if path is None:
        return None
    try:
        str(path).encode()
        path.lstat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        pass
    except (OSError, ValueError) as error:
        # Too long, a loop of links, a NUL, or bytes that are no text.
        why = error.strerror if isinstance(error, OSError) else "not a name"
        raise InputError(
            f"path must be one that this system can have; received {abbreviated(str(path))} ({why})"
        ) from None
    return path


def _load_plugins(paths: list[str] | None) -> list[str]:
    """Load plugins before anything else is done: what is read later may be made of what they define."""
    from tisim.scene import plugins

    for path in paths or ():
        plugins.load(path)
    # Some versions of typer ask for the length of what they get back.
    return paths or []


Plugins = Annotated[
    list[str] | None,
    typer.Option(
        "--plugin", metavar="FILE.py", callback=_load_plugins, is_eager=True,
        help="Your own effects, sources, operators or steppers. Repeatable.",
    ),
]  # fmt: skip
Target = Annotated[
    str,
    typer.Argument(
        metavar="CASE_OR_FILE",
        help="A case of 'tisim cases', a scene file, or your own NAME.py with a CASE.",
    ),
]
CaseName = Annotated[
    str, typer.Argument(metavar="CASE", help="A case of 'tisim cases', or your own NAME.py with a CASE.")
]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change a setting: effects.impact.hardness=3e5. Repeatable."
    ),
]
SceneVariant = Annotated[
    str | None, typer.Option("--variant", help="Which scene of the case, where it has one for a variant.")
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        callback=nameable,
        help="Folder to write to; out/NAME by default, out/NAME-cost of cost, out/NAME-figures of figures.",
    ),
]
Seed = Annotated[int | None, typer.Option(help="Seed of all that is random.")]
Size = Annotated[str | None, typer.Option(help="Size of the case; 'tisim cases' lists those of each.")]
Device = Annotated[str, typer.Option(help="cpu, cuda or vulkan.")]
Precision = Annotated[str, typer.Option(help="f64 or f32.")]
Arithmetic = Annotated[
    str,
    typer.Option(help="strict, or fast: fused, regrouped, by estimates; quicker, in other last bits."),
]
Threads = Annotated[int, typer.Option(help="CPU threads; 0 for all cores.")]
Overwrite = Annotated[
    bool,
    typer.Option("--overwrite", help="Begin anew, and replace earlier results and files of other origin."),
]
Fresh = Annotated[
    bool | None,
    typer.Option(
        "--fresh/--resume", show_default=False,
        help="Begin anew; or be refused where there is nothing to go on with. Without either, the same "
        "command goes on where it was stopped.",
    ),
]  # fmt: skip
Absent = Annotated[
    list[str] | None,
    typer.Option("--without", metavar="EFFECT", help="Leave an effect out: cooling. Repeatable."),
]
Frames = Annotated[
    int | None,
    typer.Option("--frames", help="Also write trajectory.h5, with so many frames after the start."),
]
Every = Annotated[
    float | None, typer.Option("--every", metavar="SECONDS", help="As --frames, by simulated time between.")
]
