"""Options that commands share."""

from pathlib import Path
from typing import Annotated

import typer

Target = Annotated[
    str, typer.Argument(metavar="CASE_OR_TOML", help="A case of 'tisim cases', or a scene file.")
]
CaseName = Annotated[str, typer.Argument(metavar="CASE", help="A case of 'tisim cases'.")]
Changes = Annotated[
    list[str] | None,
    typer.Option(
        "--set", metavar="KEY=VALUE", help="Change a setting: effects.impact.hardness=3e5. Repeatable."
    ),
]
Out = Annotated[
    Path | None, typer.Option("--out", metavar="DIR", help="Folder to write to; out/NAME by default.")
]
Seed = Annotated[int | None, typer.Option(help="Of all that is random.")]
Size = Annotated[str | None, typer.Option(help="Size of the case; 'tisim cases' lists those of each.")]
Device = Annotated[str, typer.Option(help="cpu or cuda.")]
Precision = Annotated[str, typer.Option(help="f64 or f32.")]
Threads = Annotated[int, typer.Option(help="CPU threads; 0 for all cores.")]
Overwrite = Annotated[
    bool, typer.Option("--overwrite", help="Replace what an earlier run has left, and files of other origin.")
]
Resume = Annotated[bool, typer.Option("--resume", help="Go on from where Ctrl-C stopped the same run.")]
Frames = Annotated[
    int | None,
    typer.Option("--frames", help="Also write trajectory.h5, with so many frames after the start."),
]
Every = Annotated[
    float | None, typer.Option("--every", metavar="SECONDS", help="As --frames, by simulated time between.")
]
