"""A law that cannot be compiled is reported in one line, which names the line of its author's file.

Taichi compiles a law when a scene is first run, and shows every place from the loop of a step down to the
fault.
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
"""A compiler says this of a function that was typed in, or read from standard input or a command line."""


@contextmanager
def in_a_line() -> Iterator[None]:
    """Raise InputError, naming file and line, where a law outside of this package cannot be compiled."""
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
        raise InputError(f"{where} must be what Taichi can compile; received {what}") from error


def _owner(file: str, line: int) -> str:
    """Return the class that a line of a file stands in, and a dot; nothing outside of one."""
    classes = [
        node.name
        for node in ast.walk(ast.parse(Path(file).read_text(encoding="utf-8")))
        if isinstance(node, ast.ClassDef) and node.lineno <= line <= (node.end_lineno or line)
    ]
    return f"{classes[-1]}." if classes else ""
