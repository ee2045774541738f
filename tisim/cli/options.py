"""Options shared by several commands."""

from collections.abc import Collection
from pathlib import Path
from typing import Annotated, Any

import typer

from tisim.errors import InputError, abbreviated


def nameable(path: Path | None) -> Path | None:
    """Return a path from the command line; InputError if the system cannot have a path of this name."""
    if path is None:
        return None
    try:
        str(path).encode()
        path.lstat()
    except (FileNotFoundError, NotADirectoryError, PermissionError):
        pass
    except (OSError, ValueError) as error:
        # Too long, a loop of links, a NUL, or bytes that are not text.
        why = error.strerror if isinstance(error, OSError) else "not a name"
        raise InputError(
            f"path must be a valid name of a file or folder; received {abbreviated(str(path))} ({why})"
        ) from None
    return path


def given_options(context: typer.Context) -> dict[str, Any]:
    """Return the arguments and options of a command that were given, by the names of its parameters."""
    sources = {name: context.get_parameter_source(name) for name in context.params}
    # Versions of typer differ in the module of this enumeration.
    return {
        name: value
        for name, value in context.params.items()
        if getattr(sources[name], "name", "") == "COMMANDLINE"
    }


def given_words(context: typer.Context, left_out: Collection[str] = ()) -> list[str]:
    """Return a command as it was given, in words, options in the order of their definition.

    left_out : names of parameters.
    """
    given, words, options = given_options(context), [str(context.info_name)], list[str]()
    for parameter in context.command.params:
        name = str(parameter.name)
        if name not in given or name in left_out:
            continue
        value = given[name]
        if parameter.param_type_name == "argument":
            words.append(str(value))
        elif isinstance(value, bool):
            options += [parameter.opts[0] if value else parameter.secondary_opts[0]]
        else:
            for one in value if isinstance(value, list | tuple) else (value,):
                options += [parameter.opts[0], str(one)]
    return words + options


def _load_plugins(paths: list[str] | None) -> list[str]:
    """Load plugins first, because later arguments may use their definitions."""
    from tisim.scene import plugins

    for path in paths or ():
        plugins.load(path)
    # Some versions of typer ask for the length of the returned value.
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
        "--set",
        metavar="KEY=VALUE",
        help="Change a setting, as effects.impact.hardness=3e5. Repeatable.",
    ),
]
SceneVariant = Annotated[
    str | None, typer.Option("--variant", help="Name of the scene, for a case with several.")
]
Out = Annotated[
    Path | None,
    typer.Option(
        "--out",
        metavar="DIR",
        callback=nameable,
        help="Folder to write to; out/NAME by default, out/NAME-cost for cost, out/NAME-figures for figures.",
    ),
]
Seed = Annotated[int | None, typer.Option(help="Seed of all random numbers.")]
Size = Annotated[str | None, typer.Option(help="Size of the case; 'tisim cases' lists the sizes.")]
Device = Annotated[str, typer.Option(help="cpu, cuda or vulkan.")]
Precision = Annotated[str, typer.Option(help="f64 or f32.")]
Arithmetic = Annotated[
    str,
    typer.Option(
        help="strict, or fast: fused multiply-add, reordered sums, approximate reciprocals and "
        "roots; faster, with different rounding errors."
    ),
]
Threads = Annotated[int, typer.Option(help="CPU threads; 0 for all cores.")]
Overwrite = Annotated[
    bool,
    typer.Option(
        "--overwrite",
        help="Start from the beginning; replace earlier results, and files that tisim has not written.",
    ),
]
Fresh = Annotated[
    bool | None,
    typer.Option(
        "--fresh/--resume", show_default=False,
        help="--fresh starts from the beginning; --resume fails if there is nothing to resume. Without "
             "either, the same command resumes where it was stopped.",
    ),
]  # fmt: skip
Absent = Annotated[
    list[str] | None,
    typer.Option("--without", metavar="EFFECT", help="Leave out an effect, such as cooling. Repeatable."),
]
Frames = Annotated[
    int | None,
    typer.Option("--frames", help="Also write trajectory.h5 with this number of frames after the start."),
]
Every = Annotated[
    float | None,
    typer.Option("--every", metavar="SECONDS", help="Simulated time between frames, in place of --frames."),
]
