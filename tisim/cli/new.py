"""The command ``tisim new`` writes a file that runs, for users to extend, with its test beside it."""

from __future__ import annotations

import keyword
from importlib.util import find_spec
from pathlib import Path
from string import Template
from typing import Annotated

import typer

from tisim.errors import InputError, must
from tisim.files import regular_file

TEMPLATES = Path(__file__).with_name("templates")
KINDS = {
    "effect": "tisim run scene.toml --plugin {}",
    "case": "tisim check {}",
    "problem": "tisim optimize {}",
}
"""Kinds of files, and the command that uses each."""

Kind = Annotated[str, typer.Argument(metavar="KIND", help=f"{', '.join(KINDS)}.")]
Name = Annotated[str, typer.Argument(metavar="NAME", help="Name of the file NAME.py, such as soft_shell.")]


def new(kind: Kind, name: Name) -> None:
    """Write NAME.py with a pair force, a case or an inverse problem that runs, and test_NAME.py.

    Files that are there already stay as they are.
    """
    must(kind in KINDS, "kind", f"one of {', '.join(KINDS)}", kind)
    must(name.isidentifier() and name == name.lower() and not keyword.iskeyword(name), "name",
         "a name of Python in lower case", name)  # fmt: skip
    fields = {"name": name, "Class": "".join(word.capitalize() for word in name.split("_"))}
    files = {Path(f"{name}.py"): f"{kind}.txt", Path(f"test_{name}.py"): f"test_{kind}.txt"}
    for path in files:
        must(not regular_file.exists(path), "file to write", "one that is not there yet", str(path))
    _check_name(kind, name)
    for path, template in files.items():
        _write(path, Template((TEMPLATES / template).read_text(encoding="utf-8")).substitute(fields))
        print(path)
    print(f"to try it: {KINDS[kind].format(f'{name}.py')}; python -m pytest test_{name}.py")


def _check_name(kind: str, name: str) -> None:
    """Raise InputError where Python, or for an effect a scene, would take the name for something else."""
    from tisim.effects import Effect
    from tisim.scene import plugins

    must(find_spec(name) is None, "name", "one that no other module has", name)
    plugins.load_parts()
    must(kind != "effect" or name not in Effect.known(), "name", "one that no other effect has", name)


def _write(path: Path, text: str) -> None:
    """Make a file; InputError where there is one or it cannot be made."""
    try:
        with path.open("x", encoding="utf-8") as file:
            file.write(text)
    except OSError as error:
        raise InputError(f"{path} must be a file that can be made; received {error.strerror}") from None
