"""What tisim new writes runs, and so do the tests that it writes."""

import pytest

from tisim import Scene
from tisim.scene import plugins


def run_tests(name):
    """The tests beside a file that has been loaded."""
    tests = [test for word, test in vars(plugins.load(f"test_{name}.py")).items() if word.startswith("test_")]
    assert tests
    for test in tests:
        test()


@pytest.mark.long
def test_an_effect(tisim, own_file, toml):
    code, out, _ = tisim("new", "effect", "soft_law")
    assert code == 0
    assert out.split("\n")[:2] == ["soft_law.py", "test_soft_law.py"]
    text = Scene.from_toml(toml).to_toml()
    own_file(
        toml, f"{text}\n[effects.soft_law]\nstrength = 1e-6\nlength = 1e-4\n".replace("\n[effects]\n", "")
    )
    code, _, err = tisim("run", toml, "--plugin", "soft_law.py")
    assert code == 0, err
    run_tests("soft_law")


@pytest.mark.long
def test_a_case(tisim, own_file):
    assert tisim("new", "case", "my_fall")[0] == 0
    code, out, _ = tisim("check", "my_fall.py")
    assert code == 0
    assert "pass" in out
    assert tisim("run", "my_fall.py", "--size", "small")[0] == 0
    run_tests("my_fall")


@pytest.mark.long
def test_a_problem(tisim, own_file):
    assert tisim("new", "problem", "my_throw")[0] == 0
    code, out, err = tisim("optimize", "my_throw.py")
    assert code == 0, err
    assert "miss (m)" in out
    run_tests("my_throw")


WRONG = [
    (["law", "soft_law"], "kind must be one of effect, case, problem; received 'law'"),
    (["effect", "SoftLaw"], "name must be a name of Python in lower case; received 'SoftLaw'"),
    (["effect", "class"], "name must be a name of Python in lower case; received 'class'"),
    (["case", "json"], "name must be one that no other module has; received 'json'"),
    (["effect", "gravity"], "name must be one that no other effect has; received 'gravity'"),
    (["effect", "there"], "file to write must be one that is not there yet; received 'there.py'"),
    (["effect", "tested"], "file to write must be one that is not there yet; received 'test_tested.py'"),
]


@pytest.mark.parametrize(("arguments", "message"), WRONG, ids=[" ".join(words) for words, _ in WRONG])
def test_nothing_is_overwritten_and_wrong_names_are_refused(tisim, own_file, tmp_path, arguments, message):
    own_file("there.py", "kept"), own_file("test_tested.py", "kept")
    code, out, err = tisim("new", *arguments)
    assert (code, out, err) == (2, "", f"{message}\n")
    assert {path.name: path.read_text() for path in tmp_path.iterdir()} == {
        "there.py": "kept", "test_tested.py": "kept"
    }  # fmt: skip
