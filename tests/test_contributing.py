"""The examples of CONTRIBUTING.md and their tests run as printed."""

from pathlib import Path

import pytest

from tests.test_guides import SNIPPET
from tisim.describe import reference
from tisim.scene import plugins

TEXT = (Path(__file__).parents[1] / "CONTRIBUTING.md").read_text(encoding="utf-8")
FILES = {title: code for language, title, code in SNIPPET.findall(TEXT) if language == "python"}
EXAMPLES = [name.removeprefix("test_") for name in FILES if name.startswith("test_")]


def test_every_example_is_a_file_with_a_test():
    assert TEXT.count("\n```") / 2 == len(FILES) == 2 * len(EXAMPLES) > 0
    assert {name.removeprefix("test_") for name in FILES} == set(EXAMPLES)


@pytest.mark.long
@pytest.mark.parametrize("name", EXAMPLES)
def test_an_example_passes_its_test(name, own_file):
    for file in (name, f"test_{name}"):
        own_file(file, FILES[file])
    plugins.load(name)
    tests = [test for word, test in vars(plugins.load(f"test_{name}")).items() if word.startswith("test_")]
    assert tests
    for test in tests:
        test()
    entries = [entry for entry in reference.entries() if entry.kind.__module__ == name.removesuffix(".py")]
    assert [entry.name for entry in entries] == [name.removesuffix(".py")] * (name != "bend.py")
