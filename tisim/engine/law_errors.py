"""Compiler errors of user laws are reported in one line, which names the file and the line of the fault.

Taichi compiles a law when a scene is first run. Its own message lists every call from the loop of a step down
to the fault.
"""

from __future__ import annotations

import ast
import re
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

from tisim.errors import InputError

PACKAGE = Path(__file__).parents[1]
PLACE = re.compile(r'File "(.+?)", line (\d+), in (\w+):')
NO_SOURCE = re.compile(r"Cannot find source code for Object: <function (?:.*<locals>\.)?([\w.]+)")
"""Compiler message for a function that was typed at a prompt or read from standard input or the command line.
"""


@contextmanager
def in_a_line() -> Iterator[None]:
    """Raise InputError with file and line if a law from outside this package cannot be compiled."""
    try:
        yield
    except InputError:
        raise
    except Exception as error:
        message = str(error)
        if unread := NO_SOURCE.search(message):
            rule = "defined in a file or in a cell of a notebook, where its source can be read"
            raise InputError(f"{unread[1]} must be {rule}; received one without a source") from error
        places = PLACE.findall(message)
        file, line, function = places[-1] if places else ("", "", "")
        if not places or PACKAGE in Path(file).parents:
            raise
        what = " ".join(message.strip().splitlines()[-1].split())
        where = f"{file}, line {line}, in {_owner(file, int(line))}{function},"
        raise InputError(f"{where} must be code that Taichi can compile; received {what}") from error


def _owner(file: str, line: int) -> str:
    """Return the name of the class around a line of a file, followed by a dot; empty outside classes."""
    classes = [
        node.name
        for node in ast.walk(ast.parse(Path(file).read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef) and node.lineno <= line <= (node.end_lineno or line)
    ]
    return f"{classes[-1]}." if classes else ""
