"""Every use of random numbers draws from a stream of its own."""

import ast
from pathlib import Path

from tests import rooms
from tisim.numerics import random_streams

STREAMS = {name: value for name, value in vars(random_streams).items() if name.isupper()}


def stream_names(tree):
    """The stream of every call of ``bits`` in a module, as it is written."""
    calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return [ast.unparse(call.args[1]) for call in calls if ast.unparse(call.func).endswith("philox.bits")]


def test_no_two_streams_are_the_same():
    assert len(set(STREAMS.values())) == len(STREAMS) > 1
    assert all(0 <= stream < 2**32 for stream in STREAMS.values())


def test_whoever_draws_names_its_stream_and_no_other_does():
    files = rooms.modules(Path(__file__).parents[2])
    uses_by_file = {
        name: set(stream_names(ast.parse(file.read_text(encoding="utf-8")))) for name, file in files.items()
    }
    uses = [stream for streams in uses_by_file.values() for stream in streams]
    assert sorted(uses) == sorted(STREAMS)
