"""Speed-ups of the front ends of Taichi and Quadrants, which otherwise repeat the same work many times.

When a class defines a function for kernels, both look up the line of the class in its file to recognize it,
although the frame of the caller identifies it. Both look up the source of a function again at every call, and
wrap each line of it and each text that shows a place in it, for possible errors. Taichi 1.7.4 makes that text
again each time. Quadrants 1.3 and 1.4 read each kernel twice, the first time to find the parts of dataclasses
it uses, and copy the syntax tree of each function to name these parts; no kernel of tisim has a dataclass.
All this takes a third of the start of a simulation with cached kernels with Taichi, and two thirds with
Quadrants. Here results are cached, work without effect is skipped, and error messages stay the same.
"""

from __future__ import annotations

import functools
import importlib
import inspect
import linecache
import sys
import textwrap
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import is_dataclass
from textwrap import TextWrapper
from types import CodeType, FrameType, SimpleNamespace
from typing import Any


@contextmanager
def quick_import() -> Iterator[None]:
    """Speed up ``inspect.getframeinfo`` during the import of ``taichi`` or ``quadrants``: it only looks up
    the line of a frame.

    The original searches all modules for the frame's module, for each of some 200 functions that they define.
    """
    thorough = inspect.getframeinfo
    inspect.getframeinfo = _line_of_frame  # type: ignore[assignment]
    try:
        yield
    finally:
        inspect.getframeinfo = thorough


def _line_of_frame(frame: FrameType, context: int = 1) -> inspect.Traceback:
    code = frame.f_code
    line = linecache.getline(code.co_filename, frame.f_lineno, frame.f_globals)
    place = (code.co_filename, frame.f_lineno, code.co_name)
    return inspect.Traceback(*place, [line], 0) if line else inspect.Traceback(*place, None, None)


def relieve(package: str) -> None:
    """Make the front end of ``taichi`` or ``quadrants`` cache its look-ups."""
    kernels: Any = importlib.import_module(f"{package}.lang.kernel_impl")
    kernels._inside_class = _in_class_body
    texts: Any = importlib.import_module(f"{package}.lang.ast.ast_transformer_utils")
    texts.TextWrapper = ShortTextWrapper
    if package == "taichi":
        kernels.textwrap = QUICK_TEXTS
        kernels.getsourcelines = _by_code(kernels.getsourcelines)
        kernels.getsourcefile = _by_code(kernels.getsourcefile)
        context = texts.ASTTransformerContext
        context.get_pos_info = _by_place(context.get_pos_info)
    else:
        functions: Any = importlib.import_module("quadrants.lang._func_base")
        functions.textwrap = QUICK_TEXTS
        functions.get_source_info_and_src = _by_code(functions.get_source_info_and_src)
        names: Any = importlib.import_module("quadrants.lang._kernel_impl_dataclass")
        names.unpack_ast_struct_expressions = _where_there_are_parts(names.unpack_ast_struct_expressions)
        kernel: Any = importlib.import_module("quadrants.lang.kernel").Kernel
        kernel._try_load_fastcache = _read_once(kernel._try_load_fastcache)


def _where_there_are_parts(put_names: Callable[..., Any]) -> Callable[..., Any]:
    """Return ``put_names``, called only for functions with parts of dataclasses."""

    @functools.wraps(put_names)
    def put(tree: Any, struct_locals: set[str]) -> Any:
        return put_names(tree, struct_locals) if struct_locals else tree

    return put


def _read_once(load: Callable[..., set[str] | None]) -> Callable[..., set[str] | None]:
    """Return ``load`` with a shortcut for kernels without dataclasses.

    ``load`` returns the parts of dataclasses that a kernel uses, or None if the kernel must be read to find
    them. The shortcut returns an empty set for a kernel of tisim that takes no dataclass.
    """

    @functools.wraps(load)
    def loaded(kernel: Any, values: tuple[Any, ...], key: Any) -> set[str] | None:
        used = load(kernel, values, key)
        if used is not None or not kernel.func.__module__.startswith("tisim."):
            return used
        if any(map(is_dataclass, (*values, *(argument.annotation for argument in kernel.arg_metas)))):
            return None
        kernel.used_py_dataclass_parameters_by_key_enforcing[key] = set()
        return set()

    return loaded


class ShortTextWrapper(TextWrapper):
    """A text wrapper that does not split text that fits into one line.

    Most source lines fit, and splitting them twice for each expression took a twelfth of the time of a
    process with cached kernels.
    """

    def wrap(self, text: str) -> list[str]:
        if len(text) > self.width or not self._odd.isdisjoint(text):
            return super().wrap(text)
        line = text.replace("\n", " ").rstrip(" ")
        return [line] if line else []

    _odd = frozenset("\t\x0b\x0c\r")


_LINES = ShortTextWrapper(width=9999, tabsize=4)
QUICK_TEXTS = SimpleNamespace(fill=lambda line, tabsize, width: _LINES.fill(line), dedent=textwrap.dedent)
"""Replaces ``textwrap`` in the reading of sources, without a new wrapper for each line."""


def _in_class_body(level_of_class_stackframe: int) -> bool:
    """Return whether the decorated function is defined in the body of a class.

    The frame at the given level runs the ``class`` statement, and the one below it the body.
    """
    return "__qualname__" in sys._getframe(level_of_class_stackframe - 1).f_locals


def _by_code(look_up: Callable[[Any], Any]) -> Callable[[Any], Any]:
    """Return ``look_up`` with a cache: it is called once for all functions of one definition."""
    known: dict[tuple[CodeType, str], Any] = {}

    @functools.wraps(look_up)
    def remembered(function: Any) -> Any:
        code = function.__code__
        # Code objects of two files compare equal if they do the same.
        key = (code, code.co_filename)
        if key not in known:
            known[key] = look_up(function)
        return known[key]

    return remembered


def _by_place(describe: Callable[[Any, Any], str]) -> Callable[[Any, Any], str]:
    """Return ``describe`` with a cache: it is called once for each place in a source."""
    known: dict[tuple[Any, ...], str] = {}

    @functools.wraps(describe)
    def remembered(context: Any, node: Any) -> str:
        begin, end = (node.lineno, node.col_offset), (node.end_lineno, node.end_col_offset)
        # The lines are part of the key, as a file may have been edited and read again.
        lines = tuple(context.src[node.lineno - 1 : node.end_lineno])
        place = (context.file, context.func.func.__name__, context.lineno_offset)
        key = (*place, lines, type(node), *begin, *end)
        if key not in known:
            known[key] = describe(context, node)
        return known[key]

    return remembered
