"""Every use of random numbers has its own stream."""

import ast
from pathlib import Path

from tests import rooms
from tisim.numerics import random_streams

STREAMS = {name: value for name, value in vars(random_streams).items() if name.isupper()}


def named(tree):
    """The streams named in an expression or a module."""
    return {node.id for node in ast.walk(tree) if isinstance(node, ast.Name) and node.id in STREAMS}


def calls_of_bits(tree):
    calls = (node for node in ast.walk(tree) if isinstance(node, ast.Call))
    return [call for call in calls if ast.unparse(call.func).endswith("philox.bits")]


def test_no_two_streams_are_the_same():
    assert len(set(STREAMS.values())) == len(STREAMS) > 1
    assert all(0 <= stream < 2**32 for stream in STREAMS.values())


def test_streams_are_named_exactly_by_their_users():
    files = rooms.modules(Path(__file__).parents[2])
    trees = {name: ast.parse(file.read_text(encoding="utf-8")) for name, file in files.items()}
    assert all(len(named(call.args[1])) == 1 for tree in trees.values() for call in calls_of_bits(tree))
    uses = [
        stream
        for name, tree in trees.items()
        if not name.endswith("random_streams")
        for stream in named(tree)
    ]
    assert sorted(uses) == sorted(STREAMS)
