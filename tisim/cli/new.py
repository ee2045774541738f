"""The command ``tisim new`` writes a runnable file for users to extend, with a test."""

from __future__ import annotations

import keyword
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Annotated

import typer

from tisim.errors import InputError, abbreviated, did_you_mean, must
from tisim.files import regular_file

TEMPLATES = Path(__file__).with_name("templates")
SCENE_COMMAND = "tisim run {0}.toml --plugin {0}.py"
USES = {
    "effect": SCENE_COMMAND,
    "contact_part": SCENE_COMMAND,
    "operator": SCENE_COMMAND,
    "source": SCENE_COMMAND,
    "stepper": SCENE_COMMAND,
    "case": "tisim check {}.py",
    "problem": "tisim optimize {}.py",
}
"""The kinds of file that can be written, each with a command that uses the file."""
FORCES = ("pair", "external")
"""Kinds of effects: a force between two particles, or a force on each particle."""

What = Annotated[str, typer.Argument(metavar="WHAT", help=f"{', '.join(USES)}.")]
Name = Annotated[str, typer.Argument(metavar="NAME", help="Name of the file NAME.py, such as soft_shell.")]
Kind = Annotated[
    str | None,
    typer.Option(
        "--kind", help="For an effect: pair (between two particles; default) or external (on each)."
    ),
]


def new(what: What, name: Name, kind: Kind = None) -> None:
    """Write an example to start from: an effect, a case or another part.

    The example is in NAME.py and runs as it is; test_NAME.py tests it.

    For an effect, contact_part, operator, source or stepper it also writes NAME.toml, a scene that uses it.
    Existing files are not overwritten. NAME.py begins with a short contract: the names that such a file must
    define, and those that it may define.
    """
    rule = f"one of {', '.join(USES)}"
    if what not in USES:
        raise InputError(f"WHAT must be {rule}; received {abbreviated(what)}{did_you_mean(what, USES)}")
    must(kind is None or what == "effect", "--kind", "given for an effect only", kind)
    must(kind is None or kind in FORCES, "--kind", f"one of {', '.join(FORCES)}", kind)
    must(name.isidentifier() and name == name.lower() and not keyword.iskeyword(name), "name",
         "a lower-case Python identifier", name)  # fmt: skip
    template = (kind or FORCES[0]) if what == "effect" else what
    files = {Path(f"{name}.py"): f"{template}.txt", Path(f"test_{name}.py"): f"test_{template}.txt"}
    if USES[what] == SCENE_COMMAND:
        files[Path(f"{name}.toml")] = f"scene_{template}.txt"
    for path in files:
        if regular_file.exists(path):
            raise InputError(f"{path} must be a new file; it already exists")
    _check_name(what, name)
    for path, text in files.items():
        _write(path, Template((TEMPLATES / text).read_text(encoding="utf-8")).substitute(fields_of(name)))
        print(path)
    print(f"to try it: {USES[what].format(name)}; python -m pytest test_{name}.py")


def fields_of(name: str) -> dict[str, str]:
    """Return the values of the fields of a template: the name of the file, and of the class in it."""
    return {"name": name, "Class": "".join(word.capitalize() for word in name.split("_"))}


def _check_name(what: str, name: str) -> None:
    """Raise InputError if the name is already that of a Python module or of a part of scenes."""
    from tisim.components.component import snake_case
    from tisim.describe import reference

    must(find_spec(name) is None, "name", "a name that no other Python module has", name)
    of_scene = USES[what] == SCENE_COMMAND
    must(
        not of_scene or name not in reference.names(),
        "name",
        "a name that no other effect, operator, source or stepper has",
        name,
    )
    # Scenes find a part by its class, whose name must lead back to the name of the file.
    found = snake_case(fields_of(name)["Class"])
    must(not of_scene or found == name, "name", f"words of two letters or more, such as {found}", name)


def _write(path: Path, text: str) -> None:
    """Create a file; InputError if it exists or cannot be created."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise InputError(f"{path} must be a file that can be written; received {error.strerror}") from None
