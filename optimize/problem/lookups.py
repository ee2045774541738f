"""Values that a function finds by a name while it runs: environment variables, modules that it imports, and
globals in ways that its code does not show."""

from __future__ import annotations

import dis
import importlib.util
import re
import types
from collections.abc import Iterator
from dataclasses import dataclass, field

ENVIRONMENT = frozenset(("environ", "environb", "getenv", "getenvb"))
"""Names in the module os."""
HIDDEN_GLOBALS = frozenset(("eval", "exec", "globals", "__import__"))
"""Functions of Python with which code finds values by any name."""
HIDDEN_ATTRIBUTES = frozenset(
    ("import_module", "run_path", "run_module", "f_globals", "f_locals", "f_builtins", "__globals__")
)
"""Attributes with which it does."""
ANY_ATTRIBUTE = frozenset(("getattr", "vars", "__dict__", "attrgetter", "__getattribute__"))
"""Names of which any attribute of a module may be read."""
QUERIES = frozenset(("eval", "query", "evaluate"))
"""Methods of tables that find variables of the caller in a text."""
_SILENT = frozenset(("CACHE", "PUSH_NULL", "PRECALL", "EXTENDED_ARG", "NOP"))


@dataclass
class Lookups:
    """What the code of a function looks up.

    names : of globals and attributes. variables : of the environment. imports : (module, level, names
    imported from it). hidden : names by which it finds values that cannot be known in advance.
    """

    names: set[str] = field(default_factory=set)
    variables: set[str] = field(default_factory=set)
    imports: set[tuple[str, int, tuple[str, ...]]] = field(default_factory=set)
    hidden: set[str] = field(default_factory=set)

    def add(self, code: types.CodeType) -> None:
        """Add the lookups of a code object, without the code objects inside it."""
        own = set(code.co_names)
        self.names |= own
        steps = [step for step in dis.get_instructions(code) if step.opname not in _SILENT]
        for index, step in enumerate(steps):
            name = step.argval
            if step.opname == "IMPORT_NAME":
                level, names = (before.argval for before in steps[index - 2 : index])
                self.imports.add((name, level, tuple(names or ())))
            elif not isinstance(name, str):
                continue
            elif name in ENVIRONMENT:
                self._environment(steps, index)
            elif (
                (step.opname in ("LOAD_GLOBAL", "LOAD_NAME") and name in HIDDEN_GLOBALS)
                or (name in HIDDEN_ATTRIBUTES and step.opname != "LOAD_CONST")
                or (name == "modules" and "sys" in own)
                or (name in HIDDEN_GLOBALS and "builtins" in own)
            ):
                self.hidden.add(name)
        if own & (ANY_ATTRIBUTE | QUERIES):
            texts = [text for text in code.co_consts if isinstance(text, str)]
            self.names.update(name for text in texts for name in re.findall(r"[^\W\d]\w*", text))

    def _environment(self, steps: list[dis.Instruction], index: int) -> None:
        """Add the variable that is read at a step which loads os.environ or os.getenv."""
        step, name = steps[index], steps[index].argval
        if step.opname == "LOAD_CONST" or step.opname.startswith("STORE_"):
            return
        after = [*steps[index + 1 :], step, step, step]
        if step.opname == "IMPORT_FROM":
            if after[0].opname.startswith("STORE_") and after[0].argval == name:
                return
        elif after[0].opname == "CONTAINS_OP":
            asked = steps[index - (2 if step.opname == "LOAD_ATTR" else 1)]
            if _is_text(asked):
                self.variables.add(_text(asked))
                return
        elif name.startswith("environ") and after[0].opname == "LOAD_CONST" and _is_text(after[0]):
            if after[1].opname in ("BINARY_SUBSCR", "STORE_SUBSCR", "DELETE_SUBSCR"):
                self.variables.add(_text(after[0]))
                return
        else:
            called = after[1:] if after[0].argval in ("get", "__getitem__", "setdefault") else after
            rest = iter(called[1:])
            end = next(one for one in rest if not one.opname.startswith(("LOAD_", "KW_NAMES")))
            if called[0].opname == "LOAD_CONST" and _is_text(called[0]) and end.opname.startswith("CALL"):
                self.variables.add(_text(called[0]))
                return
        self.hidden.add(name)

    def modules(self, package: str) -> Iterator[str]:
        """Yield the full names of modules that may be imported by code in this package."""
        for name, level, names in sorted(self.imports):
            home = importlib.util.resolve_name("." * level + name, package) if level and package else name
            parts = home.split(".")
            yield from (".".join(parts[: n + 1]) for n in range(len(parts)))
            yield from (f"{home}.{one}" for one in names)


def _is_text(step: dis.Instruction) -> bool:
    return step.opname == "LOAD_CONST" and isinstance(step.argval, str | bytes)


def _text(step: dis.Instruction) -> str:
    return step.argval.decode() if isinstance(step.argval, bytes) else str(step.argval)
