"""The front end of Taichi and of Quadrants is relieved of work that gives the same each time.

Where a class defines a function for kernels, both look up the line of the class in its file to learn that it
is one, though the frame of the caller says so. Taichi 1.7.4, which reads a function anew wherever it is
called, also looks up its source each time, and sets for every expression a text that shows its place, for an
error that may come. Together that is a third of the time to start a simulation whose kernels lie in the
cache. Here what is found is remembered, and errors say the same. Quadrants remembers sources by itself. Both
take each of those texts into words to wrap it; here that is done where it does not fit into a line.
"""

from __future__ import annotations

import functools
import importlib
import sys
from collections.abc import Callable
from textwrap import TextWrapper
from types import CodeType
from typing import Any


def relieve(package: str) -> None:
    """Let the front end of ``taichi`` or ``quadrants`` remember what it has found."""
    kernels: Any = importlib.import_module(f"{package}.lang.kernel_impl")
    kernels._inside_class = _in_class_body
    texts: Any = importlib.import_module(f"{package}.lang.ast.ast_transformer_utils")
    texts.TextWrapper = ShortTextWrapper
    if package == "taichi":
        kernels.getsourcelines = _by_code(kernels.getsourcelines)
        kernels.getsourcefile = _by_code(kernels.getsourcefile)
        context = texts.ASTTransformerContext
        context.get_pos_info = _by_place(context.get_pos_info)


class ShortTextWrapper(TextWrapper):
    """This wrapper does not take text into words that fits into one line: most lines of sources do, and twice
    for each expression that took a twelfth of a process whose kernels lie in the cache."""

    def wrap(self, text: str) -> list[str]:
        if len(text) > self.width or not self._odd.isdisjoint(text):
            return super().wrap(text)
        line = text.replace("\n", " ").rstrip(" ")
        return [line] if line else []

    _odd = frozenset("\t\x0b\x0c\r")


def _in_class_body(level_of_class_stackframe: int) -> bool:
    """Return whether what is being decorated is defined in the body of a class; the frame at the level named
    runs its ``class`` statement, and the one below it the body."""
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals


def _by_code(look_up: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return ``look_up`` with a memory, so that it is called once for all functions of one definition."""
    known: dict[tuple[CodeType, str], Any] = {}

    @functools.wraps(look_up)
    def remembered(function: Any) -> Any:
        code = function.__code__
        # Codes of two files are equal where they do the same.
        key = (code, code.co_filename)
        if key not in known:
            known[key] = look_up(function)
        return known[key]

    return remembered


def _by_place(describe: Callable[[Any, Any], str]) -> Callable[[Any, Any], str]:
    """Return ``describe`` with a memory, so that it is called once for each place in a source."""
    known: dict[tuple[Any, ...], str] = {}

    @functools.wraps(describe)
    def remembered(context: Any, node: Any) -> str:
        begin, end = (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)
        # The lines as well: a file may have been edited and read again.
        lines = tuple(context.src[node.lineno - 1 : node.end_lineno])
        place = (context.file, context.func.func.__name__, context.lineno_offset)
        key = (*place, lines, type(node), *begin, *end)
        if key not in known:
            known[key] = describe(context, node)
        return known[key]

    return remembered
