"""The cached look-ups of the compiler's front end equal the uncached ones."""

import ast
import importlib
import inspect
import sys
import textwrap
from dataclasses import dataclass
from types import SimpleNamespace

import pytest

from tisim.backend.front_end import (
    QUICK_TEXTS,
    ShortTextWrapper,
    _by_code,
    _by_place,
    _in_class_body,
    quick_import,
)
from tisim.backend.taichi import BACKEND, ti


def decorated(function):
    """A decorator that asks, at level 0, for the frame at level 3, as in the packages."""
    function.in_class = _in_class_body(3)
    return function


def test_a_function_of_a_class_is_distinguished_from_others():
    class Law:
        @decorated
        def force(self):
            pass

        inner = staticmethod(lambda: decorated(lambda: None))

    @decorated
    def free():
        pass

    assert Law.force.in_class
    assert not free.in_class
    assert not Law.inner().in_class


def test_kernels_of_classes_and_free_ones_run():
    @ti.data_oriented
    class Adder:
        @ti.func
        def one(self):
            return 1

        @ti.kernel
        def two(self) -> ti.i32:
            return self.one() + self.one()

    @ti.func
    def three():
        return 3

    @ti.kernel
    def six() -> ti.i32:
        return three() + three()

    from tisim.backend import runtime
    from tisim.backend.thread import in_taichi_thread

    runtime.current()
    assert in_taichi_thread(lambda: (Adder().two(), six()))() == (2, 6)


def test_one_definition_is_looked_up_once():
    asked = []

    @_by_code
    def look(function):
        asked.append(function)
        return inspect.getsourcelines(function)

    def make(number):
        def closure():
            return number

        return closure

    first, second = make(1), make(2)
    assert look(first) == look(second) == inspect.getsourcelines(first)
    assert asked == [first]


def test_equal_codes_of_two_files_differ():
    code = (
        compile("def f():\n    pass\n", "one.py", "exec"),
        compile("def f():\n    pass\n", "two.py", "exec"),
    )
    functions = []
    for one in code:
        names: dict = {}
        exec(one, names)
        functions.append(names["f"])
    look = _by_code(lambda function: function.__code__.co_filename)
    assert [look(function) for function in functions] == ["one.py", "two.py"]


def test_text_of_one_line_is_wrapped_as_by_python():
    line = "    total = self.term(effect, w, i, j, separation, distance, t)"
    texts = [
        line,
        line + "\n",
        " " * 12 + "^" * 9 + "  ",
        "",
        "   ",
        "\n",
        "a\tb",
        "a\r",
        line.ljust(80),
        2 * line,
        "x" * 80,
    ]
    for text in texts:
        assert ShortTextWrapper(width=80).wrap(text) == textwrap.wrap(text, 80)
        wide = {"tabsize": 4, "width": 9999}
        assert QUICK_TEXTS.fill(text, **wide) == textwrap.fill(text, **wide)
    called = importlib.import_module(f"{BACKEND}.lang.ast.ast_transformer_utils").TextWrapper
    assert called is ShortTextWrapper


@pytest.mark.skipif(BACKEND != "taichi", reason="Quadrants remembers the texts of places itself")
def test_positions_in_source_text_equal_taichis():
    from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext

    tell = ASTTransformerContext.get_pos_info
    assert tell.__wrapped__ is not tell
    lines, first = inspect.getsourcelines(test_equal_codes_of_two_files_differ)
    tree = ast.parse(textwrap.dedent("".join(lines)))

    def context(src):
        named = SimpleNamespace(func=SimpleNamespace(__name__="name"))
        return SimpleNamespace(file="f.py", func=named, src=src, indent=0, lineno_offset=first - 1)

    calls = []
    remembered = _by_place(lambda context, node: calls.append(node) or tell.__wrapped__(context, node))
    nodes = [node for node in ast.walk(tree) if hasattr(node, "lineno")]
    for node in nodes * 2:
        assert remembered(context(lines), node) == tell.__wrapped__(context(lines), node)
    assert len(calls) <= len(nodes)
    edited = [line.replace("names", "other") for line in lines]
    for node in nodes:
        if any("names" in line for line in lines[node.lineno - 1 : node.end_lineno]):
            assert remembered(context(edited), node) == tell.__wrapped__(context(edited), node)


def test_quick_imports_report_the_same_frames():
    thorough = inspect.getframeinfo

    def told():
        class Here:
            frame = sys._getframe()
            # Both calls are on one line, because the frame reports the line that is running.
            both = (thorough(frame), inspect.getframeinfo(frame))

        return Here.both

    with quick_import():
        assert inspect.getframeinfo is not thorough
        (before, quick), (outside, beyond) = told(), (thorough(FROZEN), inspect.getframeinfo(FROZEN))
    assert inspect.getframeinfo is thorough
    for expected, found in ((before, quick), (outside, beyond)):
        assert (found.function, found.lineno, found.code_context) == (
            expected.function,
            expected.lineno,
            expected.code_context,
        )
    assert "both" in quick.code_context[0]


FROZEN = eval(compile("__import__('sys')._getframe()", "<nowhere>", "eval"))
"""A frame without a file."""


@dataclass
class Pair:
    """An argument that a Quadrants kernel takes apart."""

    first: ti.i32
    second: ti.i32


@pytest.mark.skipif(BACKEND != "quadrants", reason="Taichi reads each kernel once")
def test_a_kernel_without_dataclasses_is_read_once(monkeypatch):
    from quadrants.lang.kernel import Kernel

    from tisim.backend import runtime
    from tisim.backend.thread import in_taichi_thread

    passes = []
    read = Kernel.get_tree_and_ctx

    def count(kernel, *values, **settings):
        passes.append(settings["pass_idx"])
        return read(kernel, *values, **settings)

    monkeypatch.setattr(Kernel, "get_tree_and_ctx", count)

    def kernels(module):
        @ti.kernel
        def double(number: ti.i32) -> ti.i32:
            return 2 * number

        @ti.kernel
        def total(pair: Pair, more: ti.i32) -> ti.i32:
            return pair.first + pair.second + more

        for kernel in (double, total):
            kernel._primal.func.__module__ = module
        return double, total

    runtime.current()
    # Kernels of other modules are read as usual.
    for module, times in (("tisim.kernels", [1]), ("mine", [0, 1])):
        double, total = kernels(module)
        assert in_taichi_thread(double)(21) == 42
        assert passes == times
        passes.clear()
        assert in_taichi_thread(total)(Pair(1, 2), 3) == 6
        assert passes == [0, 1]
        passes.clear()
