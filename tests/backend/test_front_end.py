"""What the front end of the compiler remembers is what it would find."""

import ast
import importlib
import inspect
import textwrap
from types import SimpleNamespace

import pytest

from tisim.backend.front_end import ShortTextWrapper, _by_code, _by_place, _in_class_body
from tisim.backend.taichi import BACKEND, ti


def decorated(function):
    """As in the packages: a decorator that calls, at level 0, what asks for the frame at level 3."""
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


def test_equal_codes_of_two_files_are_two():
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
    called = importlib.import_module(f"{BACKEND}.lang.ast.ast_transformer_utils").TextWrapper
    assert called is ShortTextWrapper


@pytest.mark.skipif(BACKEND != "taichi", reason="Quadrants remembers the texts of places itself")
def test_the_text_of_a_place_is_taichis():
    from taichi.lang.ast.ast_transformer_utils import ASTTransformerContext

    tell = ASTTransformerContext.get_pos_info
    assert tell.__wrapped__ is not tell
    lines, first = inspect.getsourcelines(test_equal_codes_of_two_files_are_two)
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
